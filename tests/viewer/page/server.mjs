// The program under test, the browser, and pages. Nothing here decides by time: limits only end what hangs.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createRequire } from "node:module";

const require = createRequire(`${process.env.PAGE_BUILD}/`);
const { chromium } = require("playwright-core");
export const kPatience = 120_000; // ms

export class Served {
    static running = new Set();
    /// Of tests that ended before they stopped theirs: node waits for them, and says nothing until then.
    static stopAll() {
        for (const one of Served.running) one.process.kill("SIGKILL");
    }
    /// Starts `trocar view` and waits for its address.
    static async start(scene, more = []) {
        const served = new Served();
        served.process = spawn(process.env.TROCAR, ["view", scene, "--quiet", ...more], { stdio: ["ignore", "pipe", "pipe"] });
        served.errors = "";
        served.process.stderr.on("data", (data) => { served.errors += data; });
        Served.running.add(served);
        served.ended = new Promise((resolve) => served.process.on("exit", (code) => {
            Served.running.delete(served);
            resolve(code);
        }));
        served.url = await new Promise((resolve, reject) => {
            let text = "";
            served.process.stdout.on("data", (data) => {
                text += data;
                if (text.includes("\n")) resolve(text.split("\n")[0]);
            });
            served.process.on("exit", (code) => reject(new Error(`trocar ended with ${code}: ${served.errors}`)));
        });
        return served;
    }
    async stop() {
        this.process.kill("SIGINT");
        return this.ended;
    }
}

/// As root in a container (no sandbox can be made there) as well as without root, and where no network is reached: nothing is looked up, updated or
/// synchronised. The profile is a fresh folder for every launch.
const kAnywhere = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];

/// Without a graphics card. The browser's own choice there: WebGL drawn in software, the page put together by the CPU. `forced`: the page as well goes through WebGL's software
/// renderer, as the usual flags of test machines have it: what is then drawn waits for what the page's parts take.
export async function openBrowser(forced = false) {
    const more = forced ? ["--use-gl=angle", "--use-angle=swiftshader", "--ignore-gpu-blocklist"] : ["--disable-gpu-compositing"];
    return chromium.launch({
        executablePath: process.env.CHROMIUM,
        args: [...kAnywhere, "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", ...more],
    });
}

/// Where the catheter stands as at the start, nothing is paused, and there is no driver.
export async function afresh(page) {
    await page.keyboard.press("Escape");
    await page.evaluate(() => document.activeElement?.blur());
    const before = await status(page);
    await page.keyboard.press("r");
    await until(page, "t.run > g", before.run); // what was pressed before is done as well: the status is no older
    if ((await status(page)).paused) await page.keyboard.press("Space");
    await until(page, "!t.paused && t.drive[0] === 0");
    return status(page);
}

/// A page that has its first frame; complaints of the console are gathered in page.complaints.
export async function openPage(browser, url, options = {}) {
    const page = await browser.newPage({ viewport: { width: 960, height: 620 }, ...options });
    page.setDefaultTimeout(kPatience);
    page.complaints = [];
    page.on("console", (message) => { if (["error", "warning"].includes(message.type())) page.complaints.push(message.text()); });
    page.on("pageerror", (error) => page.complaints.push(error.message));
    await page.goto(url);
    await until(page, "s.status !== undefined && s.pictures > 0");
    await page.evaluate(() => { // messages go away by themselves: they are kept for a test that reads them late
        window.said = [];
        new MutationObserver((changes) => {
            for (const { addedNodes } of changes) for (const line of addedNodes) window.said.push(line.textContent);
        }).observe(document.getElementById("messages"), { childList: true });
    });
    return page;
}

/// Waits until an expression about window.trocar (s), its status (t), what its messages said (window.said) and `given` (g) holds. Through the debugger: the
/// page's own policy lets no text be run.
export async function until(page, expression, given) {
    page.debugger ??= await page.context().newCDPSession(page);
    const text = `(() => { const s = window.trocar, t = s?.status ?? {}, g = ${JSON.stringify(given ?? null)}; return s !== undefined && !!(${expression}); })()`;
    for (const end = Date.now() + kPatience; Date.now() < end; await new Promise((next) => setTimeout(next, 40))) {
        const { result, exceptionDetails } = await page.debugger.send("Runtime.evaluate", { expression: text });
        if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description}`);
        if (result.value === true) return;
    }
    throw new Error(`never came true: ${expression} (${JSON.stringify(given)}); the status is ${JSON.stringify(await status(page))}`);
}
export const status = (page) => page.evaluate(() => window.trocar.status);

/// The pixels of a part of the page, four numbers each.
async function pixelsOf(browser, page, clip, read) {
    const png = (await page.screenshot({ clip, timeout: kPatience })).toString("base64");
    const blank = await browser.newPage();
    const seen = await blank.evaluate(async ([data, text]) => {
        const image = new Image();
        image.src = `data:image/png;base64,${data}`;
        await image.decode();
        const canvas = document.createElement("canvas");
        [canvas.width, canvas.height] = [image.width, image.height];
        const pen = canvas.getContext("2d");
        pen.drawImage(image, 0, 0);
        return new Function("pixels", "width", text)(pen.getImageData(0, 0, canvas.width, canvas.height).data, canvas.width);
    }, [png, read]);
    await blank.close();
    return seen;
}

/// Of every row that has any: how many of its pixels are bluish.
export const bluishWidths = (browser, page, clip) => pixelsOf(browser, page, clip, `
    const widths = [];
    for (let begin = 0; begin < pixels.length; begin += 4 * width) {
        let count = 0;
        for (let k = begin; k < begin + 4 * width; k += 4) count += pixels[k + 2] > 150 && pixels[k + 2] > 1.25 * pixels[k] ? 1 : 0;
        if (count > 0) widths.push(count);
    }
    return widths;`);

/// Mean brightness, and shares of reddish and bluish pixels, 0..1, of a part of the page.
export const look = (browser, page, clip) => pixelsOf(browser, page, clip, `
    let sum = 0, red = 0, bluish = 0;
    for (let k = 0; k < pixels.length; k += 4) {
        sum += (pixels[k] + pixels[k + 1] + pixels[k + 2]) / 765;
        red += pixels[k] > 90 && pixels[k] > 1.5 * pixels[k + 2] ? 1 : 0;
        bluish += pixels[k + 2] > 150 && pixels[k + 2] > 1.25 * pixels[k] ? 1 : 0;
    }
    const count = pixels.length / 4;
    return { brightness: sum / count, red: red / count, bluish: bluish / count };`);

export function noComplaints(page) {
    const real = page.complaints.filter((text) => !/GPU stall due to ReadPixels|GL Driver Message|Automatic fallback to software WebGL/.test(text));
    assert.deepEqual(real, []);
}
