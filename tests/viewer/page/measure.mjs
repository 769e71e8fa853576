// From a key to the picture that shows what it did, as the page measures it: `run.sh PROGRAM BUILD SOURCE measure SCENE [KEYS]`.
// No test: it depends on the machine. The browser draws in software, so that the figure is that of a machine without a graphics card.
import { Served, openBrowser, openPage } from "./server.mjs";

const [scene, count = "40"] = process.argv.slice(2);
const served = await Served.start(scene);
const browser = await openBrowser();
try {
    const page = await openPage(browser, served.url);
    await page.keyboard.press("Enter");
    await page.waitForTimeout(1000);
    await page.evaluate(() => { window.seldinger.latencyMs.length = 0; });
    for (let key = 0; key < Number(count); ++key) {
        const code = key % 2 === 0 ? "ArrowUp" : "ArrowDown";
        await page.keyboard.down(code);
        await page.waitForTimeout(250);
        await page.keyboard.up(code);
        await page.waitForTimeout(200);
    }
    const { latency, frameMs, pixels } = await page.evaluate(() => ({
        latency: [...window.seldinger.latencyMs].sort((a, b) => a - b), frameMs: window.seldinger.frameMs, pixels: window.seldinger.pixels,
    }));
    const at = (share) => latency[Math.min(latency.length - 1, Math.floor(share * latency.length))].toFixed(0);
    console.log(`${scene}: key to picture p10/p50/p90 ${at(0.1)}/${at(0.5)}/${at(0.9)} ms of ${latency.length} keys, ` +
        `${(1000 / frameMs).toFixed(0)} pictures a second, ${(100 * pixels).toFixed(0)} % of the pixels`);
} finally {
    await browser.close();
    await served.stop();
}
