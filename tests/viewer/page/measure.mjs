// From a key to the picture that shows what it did: drawn, as the page itself measures it, and on the screen, as the browser's trace has it.
// `run.sh PROGRAM BUILD SOURCE measure SCENE [KEYS]`. No test: it depends on the machine. Without a graphics card, once as the browser puts
// the page together by itself and once with the page forced through WebGL's software renderer.
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { Served, openBrowser, openPage } from "./server.mjs";

const [scene, count = "40"] = process.argv.slice(2);
const kTraced = ["blink.user_timing", "viz", "benchmark"];

async function pressKeys(page) {
    for (let key = 0; key < Number(count); ++key) {
        const code = key % 2 === 0 ? "ArrowUp" : "ArrowDown";
        await page.keyboard.down(code);
        await page.waitForTimeout(250);
        await page.keyboard.up(code);
        await page.waitForTimeout(200);
    }
}

/// ms from each answer's mark to the moment at which the first picture that can hold it was on the screen: the canvas hands its picture to the
/// compositor by itself (frame sinks numbered from 2^31), which draws it, and says that it was displayed.
function fromMarksToScreen(file) {
    const events = JSON.parse(readFileSync(file, "utf8")).traceEvents.filter((event) => event.ts !== undefined).sort((a, b) => a.ts - b.ts);
    const after = (time, holds) => events.find((event) => event.ts >= time && holds(event))?.ts;
    const ofCanvas = (event) => event.name === "Surface::CommitFrame" && Number(/FrameSinkId\(\d+, (\d+)\)/.exec(JSON.stringify(event.args))?.[1]) >= 2 ** 31;
    return events.filter((event) => event.name === "answer").map(({ ts }) => {
        const handed = after(ts, ofCanvas);
        const drawn = handed && after(handed, (event) => event.name === "Display::DrawAndSwap");
        const shown = drawn && after(drawn, (event) => event.name === "Display::FrameDisplayed");
        return shown === undefined ? NaN : (shown - ts) / 1e3;
    });
}

function quantiles(values) {
    const sorted = values.filter(Number.isFinite).sort((a, b) => a - b);
    return [0.1, 0.5, 0.9].map((share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))]?.toFixed(0)).join("/");
}

async function measure(forced) {
    const folder = mkdtempSync(join(tmpdir(), "trocar-page-"));
    const served = await Served.start(scene);
    const browser = await openBrowser(forced);
    try {
        const page = await openPage(browser, served.url);
        await page.keyboard.press("Enter");
        await page.waitForTimeout(1000);
        await page.evaluate(() => {
            const { latencyMs } = window.trocar;
            latencyMs.length = 0;
            latencyMs.push = (ms) => {
                performance.mark("answer");
                return Array.prototype.push.call(latencyMs, ms);
            };
        });
        await browser.startTracing(page, { path: join(folder, "trace.json"), categories: kTraced });
        await pressKeys(page);
        await browser.stopTracing();
        const { drawn, frameMs, pixels } = await page.evaluate(() => ({
            drawn: [...window.trocar.latencyMs], frameMs: window.trocar.frameMs, pixels: window.trocar.pixels,
        }));
        const shown = fromMarksToScreen(join(folder, "trace.json")).map((ms, k) => drawn[k] + ms);
        console.log(`${scene}, page put together by ${forced ? "WebGL's software renderer" : "the CPU"}: key to picture, p10/p50/p90: drawn ${quantiles(drawn)} ms of ${drawn.length} keys, ` +
            `on the screen ${quantiles(shown)} ms of ${shown.filter(Number.isFinite).length}; ${(1000 / frameMs).toFixed(0)} pictures a second, ${(100 * pixels).toFixed(0)} % of the pixels`);
    } finally {
        await browser.close();
        await served.stop();
        rmSync(folder, { recursive: true });
    }
}

for (const forced of [false, true]) await measure(forced);
