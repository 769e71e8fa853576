// The page as a user sees it, in headless Chromium with software WebGL.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test as testOf } from "node:test";
import { afresh, bluishWidths, kPatience, look, noComplaints, openBrowser, openPage, Served, status, until } from "./server.mjs";

const folder = mkdtempSync(join(tmpdir(), "trocar-page-"));
const scene = join(process.env.TROCAR_SOURCE, "assets/scenes/u_bend.json");
const middle = { x: 200, y: 60, width: 450, height: 480 };
/// A test that hangs ends with its name.
const test = (name, body) => testOf(name, { timeout: 150_000 }, body);
let served, browser, page; // one page for most: opening one is what takes longest

/// A block of tissue that is held on one side.
const tissueScene = join(folder, "tissue.json");
writeFileSync(tissueScene, JSON.stringify({
    name: "tissue", units: { length: "mm", pressure: "kPa" }, time: { step: 0.01, duration: 1 }, budget: "exact",
    bodies: {
        block: {
            kind: "deformable", surface: { shape: "box", centre: [0, 0, 0], extent: [60, 40, 60], cells: 4 },
            material: { young_modulus: 5, poisson_ratio: 0.4, density: 1000, viscosity: 0.001, mass_damping: 5 },
            coarse: { surface_triangles: 120 }, fixed: [{ direction: [0, 0, 1], fraction: 0.1 }],
        },
    },
    effects: ["elasticity", "damping"],
}));

before(async () => {
    served = await Served.start(scene);
    browser = await openBrowser();
    page = await openPage(browser, served.url);
});
after(async () => {
    await browser?.close();
    const code = await served?.stop();
    Served.stopAll();
    rmSync(folder, { recursive: true });
    assert.equal(code, 0);
});

test("the first screen says what to press, and the page has nothing to complain about", async () => {
    assert.ok(await page.isVisible("#welcome"));
    const text = await page.innerText("#welcome");
    for (const word of ["push", "pull back", "turn", "budget", "pause"]) assert.ok(text.includes(word), word);
    await page.keyboard.press("Enter");
    assert.ok(!(await page.isVisible("#welcome")));
    await until(page, "s.frames > 5");
    noComplaints(page);
});

test("the page begins with the report's view, the patient's front, and so does the X-ray monitor", async () => {
    const fresh = await openPage(browser, served.url);
    const along = (which) => `s.looking.reduce((sum, x, k) => sum + x * s.scene.view.${which}[k], 0) > 0.9999`;
    await until(fresh, along("front"));
    assert.ok(await fresh.evaluate(() => window.trocar.scene.view.front[1] < -0.9)); // y points forwards
    await fresh.keyboard.press("Escape");
    await fresh.keyboard.press("x");
    await until(fresh, "s.xray.pictures > 0 && s.xray.latest.primary === 0 && s.xray.latest.secondary === 0");
    for (const [edge, letter] of [["n", "H"], ["s", "F"], ["w", "R"], ["e", "L"]]) assert.equal(await fresh.innerText(`#edge-${edge}`), letter);
    await fresh.close();
});

test("before the first step the page says where the catheter stands, and calls nothing tested", async () => {
    const paused = await Served.start(scene, ["--paused"]);
    const page = await openPage(browser, paused.url);
    await page.keyboard.press("Escape");
    await until(page, "t.paused && t.step === 0");
    const { insertion_m } = await status(page);
    assert.ok(insertion_m > 1e-3, `${insertion_m}`);
    assert.equal(await page.innerText("#insertion"), `${(1e3 * insertion_m).toFixed(1)} mm`);
    for (const id of ["#level", "#assumed", "#error", "#exact"]) assert.equal(await page.innerText(id), "–", id);
    await page.keyboard.press("n");
    await until(page, "t.step === 1 && document.getElementById('level').textContent.includes('all tested')");
    assert.equal(await page.getAttribute("#level", "class"), "good");
    await page.close();
    assert.equal(await paused.stop(), 0);
});

test("with sphere trees and exact contact off nothing is called tested", async () => {
    const start = await afresh(page);
    const flip = async (name, on) => {
        await page.evaluate((id) => document.getElementById(id).click(), `effect-${name}`);
        await until(page, `t.effects.${name} === ${on}`);
    };
    await flip("coarse_contact", false);
    await flip("exact_contact", false);
    const { step } = await status(page);
    await until(page, "t.step > g + 2 && !t.exact_ran && document.getElementById('error').textContent === 'nothing is tested'", step);
    assert.equal(await page.innerText("#level"), "sphere trees off");
    assert.notEqual(await page.getAttribute("#level", "class"), "good");
    assert.equal(await page.getAttribute("#error", "class"), "bad");
    assert.equal(await page.innerText("#assumed"), "–");
    assert.equal(await page.innerText("#exact"), "off");
    assert.equal(await page.evaluate(() => document.querySelectorAll("#levels .on").length), 0);
    await flip("coarse_contact", true);
    await flip("exact_contact", true);
    await until(page, "document.getElementById('level').textContent.includes('all tested') && t.step > g", start.step);
});

test("keys move the catheter, and it stops when they are let go", async () => {
    const start = await afresh(page);
    await page.keyboard.down("w");
    await until(page, "t.insertion_m > g + 5e-3", start.insertion_m);
    await page.keyboard.up("w");
    await until(page, "t.drive[0] === 0");
    await page.keyboard.down("ArrowRight");
    await until(page, "t.rotation_rad > g + 0.2", start.rotation_rad);
    await page.keyboard.up("ArrowRight");
    await until(page, "t.drive[1] === 0");
    const there = await status(page);
    await page.keyboard.down("s");
    await until(page, "t.insertion_m < g - 2e-3", there.insertion_m);
    await page.keyboard.up("s");
    await until(page, "s.latencyMs.length > 0");
    noComplaints(page);
});

test("the pad moves the catheter with the mouse", async () => {
    const start = await afresh(page);
    const box = await page.locator("#pad").boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2, box.y + 10);
    await until(page, "t.insertion_m > g + 2e-3", start.insertion_m);
    await page.mouse.up();
    await until(page, "t.drive[0] === 0");
});

test("a gamepad's stick moves the catheter, and its name is shown", async () => {
    const start = await afresh(page);
    await page.evaluate(() => { // no such device here: one that is indistinguishable to the page
        window.fakePad = { id: "test pad", connected: true, axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false })) };
        Object.defineProperty(navigator, "getGamepads", { configurable: true, value: () => [null, window.fakePad] });
    });
    const tilt = (...axes) => page.evaluate((to) => { window.fakePad.axes = to; }, axes);
    await tilt(0, -1, 0, 0);
    await until(page, "t.insertion_m > g + 2e-3", start.insertion_m);
    await tilt(0, 0, 1, 0);
    await until(page, "t.drive[0] === 0 && t.rotation_rad > g + 0.2", start.rotation_rad);
    await tilt(0.1, -0.1, 0.1, 0);
    await until(page, "t.drive[0] === 0 && t.drive[1] === 0"); // a stick at rest is never quite in the middle
    await until(page, "document.body.innerText.includes('gamepad: test pad')");
    await page.evaluate(() => Object.defineProperty(navigator, "getGamepads", { configurable: true, value: () => [] }));
    noComplaints(page);
});

test("the budget slider changes the level reached, by keyboard alone", async () => {
    await afresh(page);
    await page.keyboard.down("w"); // deep enough for a few hundred pairs
    await until(page, "t.insertion_m > 0.08");
    await page.keyboard.up("w");
    await page.click("[data-mode=work]");
    await until(page, "t.budget.mode === 'work'");
    await page.focus("#budget");
    await page.keyboard.press("End");
    await until(page, "t.budget.units > 1e6 && t.pairs_open === 0 && t.level === s.scene.leaf_level");
    await page.keyboard.press("Home");
    await until(page, "t.budget.units === 10 && t.pairs_open > 0 && t.assumed > 0 && t.level < s.scene.leaf_level");
    assert.match(await page.innerText("#level"), /of/);
    await until(page, "said.some((text) => /^Exact contacts do not run: 10 tests a step/.test(text))");
    await page.keyboard.press("Escape");
    for (let k = 0; k < 12; ++k) await page.keyboard.press("Equal"); // and + does the same
    await until(page, "t.budget.units > 100");
    await page.click("[data-mode=wall]");
    await until(page, "t.budget.mode === 'wall' && t.budget.ms >= 0.1 && t.budget.ms <= 33");
});

test("pause, single step, restart", async () => {
    await afresh(page);
    await page.keyboard.press("Space");
    await until(page, "t.paused");
    const paused = await status(page);
    await page.keyboard.press("n");
    await until(page, "t.step === g + 1", paused.step);
    assert.equal(await page.innerText("#pace"), "paused");
    await page.keyboard.press("r");
    await until(page, "t.step === 0 && t.run > g", paused.run);
    await page.keyboard.press("Space");
    await until(page, "!t.paused && t.step > 0");
});

test("a lost connection is said, and comes back", async () => {
    await afresh(page);
    const frames = await page.evaluate(() => {
        window.trocar.drop();
        return window.trocar.frames;
    });
    await until(page, "said.some((text) => /connection/.test(text))");
    await until(page, "s.frames > g + 3 && s.status !== undefined", frames);
    await until(page, "document.querySelectorAll('#messages p').length === 0");
    await page.keyboard.down("w");
    await until(page, "t.drive[0] === 1");
    await page.keyboard.up("w");
});

test("a second viewer watches and says so", async () => {
    await afresh(page);
    const watcher = await openPage(browser, served.url);
    await watcher.keyboard.press("Escape");
    await until(watcher, "t.driver !== 0 && t.driver !== t.you");
    await watcher.keyboard.press("Space");
    await until(watcher, "said.some((text) => /drives; you watch/.test(text))");
    await page.close(); // the driver goes
    await until(watcher, "t.driver === 0");
    await watcher.keyboard.down("w"); // a free driver's seat is taken by the next viewer with input
    await until(watcher, "t.driver === t.you && t.drive[0] === 1");
    await watcher.keyboard.up("w");
    page = watcher;
});

test("the picture shows vessel and catheter, and the X-ray is another picture", async () => {
    await afresh(page);
    await page.keyboard.down("w");
    await until(page, "t.insertion_m > 0.06");
    await page.keyboard.up("w");
    const shaded = await look(browser, page, middle);
    assert.ok(shaded.red > 0.05, `vessel: ${JSON.stringify(shaded)}`);
    assert.ok(shaded.bluish > 0.0002, `catheter: ${JSON.stringify(shaded)}`);
    await page.keyboard.press("x");
    await until(page, "s.xray.shown && s.xray.pictures > 2");
    const xray = await look(browser, page, middle);
    assert.ok(xray.red < 0.01 && xray.bluish < 0.01 && xray.brightness > 0.3, `X-ray: ${JSON.stringify(xray)}`);
    await page.keyboard.press("t"); // the table, so that the tip is in the middle
    await until(page, "s.xray.latest.zoom === 3 && Math.abs(s.xray.latest.tip[0] - 256) < 30 && Math.abs(s.xray.latest.tip[1] - 256) < 30");
    await page.keyboard.press("v");
    await until(page, "s.xray.latest.zoom === 1");
    await page.keyboard.press("x");
    const pictures = await page.evaluate(() => window.trocar.pictures);
    await until(page, "!s.xray.shown && s.pictures > g", pictures);
    noComplaints(page);
});

/// A straight vessel, and contrast that nobody injects but by command.
const contrastScene = join(folder, "contrast.json");
writeFileSync(contrastScene, JSON.stringify({
    name: "contrast", units: { length: "mm", pressure: "kPa" }, time: { step: 0.01, duration: 100 }, budget: "work:20000",
    bodies: { tube: { kind: "static", hollow: true, surface: { shape: "tube", axis: [[0, 0, 0, 4], [0, 0, 120, 4]], sides: 16 } } },
    instruments: {
        wire: {
            length: 100, radius: 0.5, young_modulus: 60000, segment: 5, skin_triangles: 600, lumen: "tube", inserted: 20,
            entry: { position: [0, 0, 10], direction: [0, 0, 1] },
        },
    },
    effects: { coarse_contact: true, exact_contact: true, contrast: { rate: 2, start: 1e5, duration: 1 } },
}));

test("the C-arm stands at presets and where the picture is dragged to; letters and cube say which side is where", async () => {
    const suite = await Served.start(contrastScene);
    const page = await openPage(browser, suite.url);
    await page.keyboard.press("Escape");
    await page.keyboard.press("x");
    const stands = (primary, secondary) =>
        until(page, "Math.abs(s.xray.latest?.primary - g[0] * Math.PI / 180) < 0.02 && Math.abs(s.xray.latest?.secondary - g[1] * Math.PI / 180) < 0.02", [primary, secondary]);
    for (const [name, primary, secondary, west, face] of
        [["Lateral", 90, 0, "A", "L"], ["LAO 45", 45, 0, "RA", "A"], ["RAO 30", -30, 0, "RP", "A"], ["CRA 25", 0, 25, "R", "A"], ["AP", 0, 0, "R", "A"]]) {
        await page.click(`#presets >> text="${name}"`);
        await stands(primary, secondary);
        await page.waitForFunction(([id, text]) => text.split("|").includes(document.getElementById(id).textContent), ["edge-w", west]);
        assert.ok(await page.isVisible(`#orientation .face:text-is("${face}")`), `${name}: the cube shows ${face}`);
    }
    const box = await page.locator("#xray-picture").boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 - 50, box.y + box.height / 2, { steps: 5 });
    await page.mouse.up();
    await stands(20, 0); // 0.4 degrees a pixel
    await page.keyboard.press("j");
    await stands(15, 0);
    noComplaints(page);
    await page.close();
    assert.equal(await suite.stop(), 0);
});

test("contrast is injected, subtracted, kept as a roadmap; the film strip shows the last seconds; pictures are saved; the recording says how it repeats", async () => {
    const suite = await Served.start(contrastScene);
    const page = await openPage(browser, suite.url);
    await page.keyboard.press("Escape");
    await page.keyboard.press("x");
    await until(page, "s.xray.pictures > 2 && t.time_s > 0.3");
    await page.keyboard.press("m");
    await until(page, "s.xray.latest.display === 2 && document.getElementById('subtract').getAttribute('aria-pressed') === 'true'");
    await page.keyboard.press("q");
    await until(page, "t.injection.injected_mg > 400");
    await until(page, "s.xray.latest.hasContrast && s.xray.latest.grey.reduce((least, grey) => Math.min(least, grey), 255) < 150"); // the column of contrast is dark
    await page.click("#roadmap");
    await until(page, "s.xray.latest.display === 3 && s.xray.pictures > 20");
    await page.click("#film-frames canvas >> nth=1");
    assert.match(await page.innerText("#xray-words"), / s ago/);
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("#picture")]);
    assert.match(download.suggestedFilename(), /^contrast-xray-.*\.png$/);
    assert.equal(readFileSync(await download.path()).subarray(1, 4).toString(), "PNG");
    await page.click("#film-live");
    assert.doesNotMatch(await page.innerText("#xray-words"), / s ago/);
    const address = new URL(await page.getAttribute("#download", "href"), suite.url);
    const recording = await (await fetch(address)).text();
    assert.match(recording, /# Bit for bit: trocar run .* --set \/effects\/contrast\/start=[0-9.]+ --path THIS_FILE/);
    noComplaints(page);
    await page.close();
    assert.equal(await suite.stop(), 0);
});

test("without a card fewer triangles are drawn, unless a picture is asked for as it is", async () => {
    const whole = await openPage(browser, `${served.url}&pixels=1`);
    await until(whole, "s.triangles > 1000");
    const count = await whole.evaluate(() => window.trocar.scene.parts.reduce((sum, part) => sum + part.triangles, 0));
    const plain = await openPage(browser, served.url);
    await until(plain, "s.triangles > 1000");
    assert.ok(await plain.evaluate(() => window.trocar.triangles) < 0.8 * count);
    assert.ok(await whole.evaluate(() => window.trocar.triangles) >= count);
    noComplaints(whole);
    noComplaints(plain);
    await whole.close();
    await plain.close();
});

test("tissue is pulled with the mouse", async () => {
    const tissue = await Served.start(tissueScene);
    const page = await openPage(browser, tissue.url);
    await page.keyboard.press("Escape");
    const size = page.viewportSize();
    await page.keyboard.down("Shift");
    await page.mouse.move(size.width / 2, size.height / 2);
    await page.mouse.down();
    await page.mouse.move(size.width / 2 - 60, size.height / 2 + 40, { steps: 4 });
    await until(page, "t.grabbed && t.pull_n > 0");
    await page.mouse.up();
    await page.keyboard.up("Shift");
    await until(page, "!t.grabbed && t.pull_n === 0");
    noComplaints(page);
    await page.close();
    assert.equal(await tissue.stop(), 0);
});

test("after a click the keys are the view's: Space pauses and presses nothing again, W drives", async () => {
    const start = await afresh(page);
    await page.click("#record");
    await until(page, "t.run > g && t.recorded > 5", start.run);
    const recording = (await status(page)).run;
    await page.keyboard.press("Space");
    await until(page, "t.paused && t.run === g", recording);
    await page.click("#step");
    await page.keyboard.press("Space");
    await until(page, "!t.paused && t.run === g", recording);
    const there = await status(page);
    await page.click("#opacity");
    await page.keyboard.down("w");
    await until(page, "t.insertion_m > g + 2e-3", there.insertion_m);
    await page.keyboard.up("w");
    await page.click("[data-mode=wall]");
    noComplaints(page);
});

test("everything is reached by keyboard: boxes, kinds of budget, the camera", async () => {
    await afresh(page);
    await page.focus("#effect-exact_contact");
    await page.keyboard.press("Space");
    await until(page, "!t.effects.exact_contact && !t.paused");
    await page.keyboard.press("Space");
    await until(page, "t.effects.exact_contact");
    const before = await status(page);
    await page.focus("[data-mode=wall]");
    await page.keyboard.press("ArrowRight");
    await until(page, "t.budget.mode === 'work'");
    await page.keyboard.press("ArrowLeft");
    await until(page, "t.budget.mode === 'wall'");
    assert.equal((await status(page)).rotation_rad, before.rotation_rad);
    await page.keyboard.press("Space");
    await until(page, "t.paused");
    for (const code of ["j", "l", "i", "k", "u", "o"]) {
        const pictures = await page.evaluate(() => window.trocar.pictures);
        await page.keyboard.press(code);
        await until(page, "s.pictures > g", pictures);
    }
    await page.keyboard.press("h");
    assert.ok(await page.isVisible("#welcome"));
    await page.keyboard.press("Shift+Tab");
    assert.ok(await page.isVisible("#welcome"));
    await page.keyboard.press("h");
    assert.ok(!(await page.isVisible("#welcome")));
    await page.keyboard.press("Space");
});

test("lost graphics are reported, driving stops, and both come back", async () => {
    const start = await afresh(page);
    await page.evaluate(() => { window.lost = document.getElementById("view").getContext("webgl2").getExtension("WEBGL_lose_context"); window.lost.loseContext(); });
    await until(page, "said.some((text) => /lost its graphics/.test(text))");
    await page.keyboard.down("w");
    const { step } = await status(page);
    await until(page, "t.step > g + 30", step);
    assert.ok(Math.abs((await status(page)).insertion_m - start.insertion_m) < 1e-4);
    const pictures = await page.evaluate(() => { window.lost.restoreContext(); return window.trocar.pictures; });
    await until(page, "s.pictures > g && t.insertion_m > 0.022", pictures);
    await page.keyboard.up("w");
    await until(page, "document.querySelectorAll('#messages p.error').length === 0");
    page.complaints = page.complaints.filter((text) => !/context|INVALID_OPERATION/i.test(text)); // the browser's own message
});

test("on short and narrow screens nothing lies over what is pressed", async () => {
    const before = page.viewportSize();
    await page.keyboard.press("Escape");
    await page.evaluate(() => { // a long message at the same time
        const line = document.createElement("p");
        line.id = "long", line.textContent = "A message as long as any. ".repeat(20);
        document.getElementById("messages").append(line);
    });
    const sizes = [[740, 360], [640, 360], [640, 400], [844, 390], [390, 844], [360, 640], [768, 1024], [1280, 720]];
    for (const [width, height, xray] of sizes.flatMap((size) => [[...size, false], [...size, true]])) {
        await page.setViewportSize({ width, height });
        if (xray !== await page.evaluate(() => window.trocar.xray.shown)) await page.keyboard.press("x");
        await until(page, "s.xray.shown === g", xray);
        if (await page.evaluate(() => document.getElementById("panel").classList.contains("folded"))) await page.evaluate(() => document.getElementById("fold").click());
        const covered = await page.evaluate(() => [...document.querySelectorAll("#panel button, #pad, #pause")].filter((one) => one.offsetParent !== null || one.id === "pad").filter((one) => {
            one.scrollIntoView({ block: "nearest" }); // the panel scrolls: what its numbers' lengths push to its edge is reached all the same
            const box = one.getBoundingClientRect(), top = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
            return !one.contains(top);
        }).map((one) => one.id || one.dataset.mode || one.textContent));
        assert.deepEqual(covered, [], `${width} x ${height}${xray ? ", X-ray" : ""}`);
        const boxes = await page.evaluate(() => ["panel", "hand", "bar"].map((id) => document.getElementById(id).getBoundingClientRect().toJSON()));
        const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
        assert.ok(apart(boxes[0], boxes[1]) && apart(boxes[1], boxes[2]) && apart(boxes[0], boxes[2]), `${width} x ${height}: ${JSON.stringify(boxes)}`);
    }
    await page.keyboard.press("x");
    await page.evaluate(() => document.getElementById("long").remove());
    await page.setViewportSize(before);
});

test("a scene without an instrument offers no drive controls and no recording", async () => {
    const other = await Served.start(join(process.env.TROCAR_SOURCE, "assets/scenes/falling_sphere.json"));
    const page = await openPage(browser, other.url);
    assert.match(await page.innerText("#welcome"), /no instrument/);
    await page.keyboard.press("Enter");
    for (const id of ["#hand", "#record", "#download"]) assert.ok(!(await page.isVisible(id)), id);
    await page.keyboard.press("w");
    await until(page, "said.some((text) => /no instrument/.test(text))");
    noComplaints(page);
    await page.close();
    await other.stop();
});

/// The block of tissue, and a wall half a metre away from it.
const farScene = join(folder, "far.json");
writeFileSync(farScene, JSON.stringify((() => {
    const far = JSON.parse(readFileSync(tissueScene, "utf8"));
    far.bodies.wall = { kind: "static", surface: { shape: "box", centre: [500, 0, 0], extent: [60, 40, 60], cells: 4 } };
    far.effects.push("coarse_contact");
    return far;
})()));

test("where nothing was near nothing was tested, and nothing is green", async () => {
    const other = await Served.start(farScene, ["--paused"]);
    const page = await openPage(browser, other.url);
    await page.keyboard.press("Escape");
    await page.keyboard.press("n");
    await until(page, "t.step === 1 && document.getElementById('level').textContent.includes('nothing near')");
    assert.equal((await status(page)).pairs_tested, 0);
    assert.notEqual(await page.getAttribute("#level", "class"), "good");
    assert.equal(await page.evaluate(() => document.querySelectorAll("#levels .on").length), 0);
    assert.ok(!(await page.isVisible("#histories"))); // no instrument: no plots of its force and insertion
    await page.close();
    await other.stop();
});

test("the scale bar is 1, 2 or 5 times a power of ten of millimetres, and follows the zoom", async () => {
    await afresh(page);
    await page.keyboard.press("v");
    const read = async () => {
        const mm = Number.parseFloat(await page.innerText("#scale span"));
        const { width } = await page.locator("#scale i").boundingBox();
        const perPixel = await page.evaluate(() => window.trocar.mmPerPixel);
        assert.match(mm.toExponential(), /^[125]e/);
        assert.ok(width > 30 && width < 140 && Math.abs(width * perPixel - mm) < 0.03 * mm, `${mm} mm, ${width} pixels of ${perPixel} mm`);
        return mm;
    };
    const settled = () => until(page, "Math.abs(document.querySelector('#scale i').getBoundingClientRect().width * s.mmPerPixel / parseFloat(document.querySelector('#scale span').textContent) - 1) < 0.02");
    await settled();
    const whole = await read();
    const far = await page.evaluate(() => window.trocar.mmPerPixel);
    for (let k = 0; k < 25; ++k) await page.keyboard.press("u"); // nearer: 0.9 times each
    await until(page, "s.mmPerPixel < 1.001 * g", far * 0.9 ** 25); // all of them: the bar follows a frame later
    await settled();
    assert.ok(await read() < 0.3 * whole);
    await page.keyboard.press("v");
});

test("force and insertion are plotted over the same steps as the step time, with their units", async () => {
    await afresh(page);
    await page.keyboard.down("w");
    await until(page, "t.insertion_m > 0.03 && Math.abs(Number(document.getElementById('insertion-plot').dataset.last) - 1e3 * t.insertion_m) < 5");
    await page.keyboard.up("w");
    const headings = await page.innerText("#histories");
    assert.match(headings, /Contact force \[N\]/);
    assert.match(headings, /Insertion \[mm\]/);
    await until(page, "document.getElementById('force-plot').dataset.last !== ''");
    for (const id of ["force-plot", "insertion-plot"])
        assert.ok(await page.evaluate((canvas) => {
            const { width, height } = document.getElementById(canvas);
            return document.getElementById(canvas).getContext("2d").getImageData(0, 0, width, height).data.some((value) => value > 0);
        }, id), id);
});

test("states are saved under names, gone back to, taken away and forgotten", async () => {
    await afresh(page);
    await page.keyboard.down("w");
    await until(page, "t.insertion_m > 0.025");
    await page.keyboard.up("w");
    await page.keyboard.press("Space");
    await until(page, "t.paused && t.drive[0] === 0");
    const there = await status(page);
    await page.fill("#state-name", "at the bend");
    await page.keyboard.press("Enter");
    await until(page, "t.saved.length === 1 && t.saved[0].name === 'at the bend' && document.querySelectorAll('#states li').length === 1");
    await page.keyboard.press("Escape");
    await page.keyboard.press("Space");
    await until(page, "!t.paused && t.step > g + 5", there.step);
    await page.click("#state-save"); // without a name: the time
    await until(page, "t.saved.length === 2 && /^[0-9.]+ s$/.test(t.saved[1].name) && document.querySelectorAll('#states li').length === 2");
    await page.keyboard.press("Space");
    await until(page, "t.paused");
    await page.click("#states li >> nth=0 >> text=Restore");
    await until(page, "t.step === g.step && t.time_s === g.time_s && t.insertion_m === g.insertion_m && t.run > g.run", there);
    await until(page, "document.getElementById('level').textContent === '–'"); // of no step
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("#states li >> nth=0 >> text=File")]);
    assert.match(download.suggestedFilename(), /at_the_bend\.bin$/);
    const file = join(folder, "state.bin"), out = join(folder, "resumed");
    await download.saveAs(file);
    execFileSync(process.env.TROCAR, ["run", scene, "-n", String(there.step + 3), "--resume", file, "--out", out, "--no-pictures", "--quiet"]);
    assert.equal(JSON.parse(readFileSync(join(out, "summary.json"), "utf8")).steps, 3); // taken since the state
    for (let left = 1; left >= 0; --left) {
        await page.click("#states li >> nth=0 >> text=×");
        await until(page, "t.saved.length === g && document.querySelectorAll('#states li').length === g", left);
    }
    await page.keyboard.press("Space");
    noComplaints(page);
});

test("target and entry are picked by clicks, saved in a new scene, and it opens", async () => {
    const original = join(folder, "bend.json");
    copyFileSync(scene, original);
    const suite = await Served.start(original, ["--paused"]);
    const page = await openPage(browser, suite.url);
    await page.keyboard.press("Escape");
    const { vessel } = await page.evaluate(() => window.trocar.scene);
    const place = (share) => vessel.centreline.points.slice(3 * Math.floor(share * vessel.centreline.parents.length)).slice(0, 3);
    const at = (point) => page.evaluate((where) => window.trocar.at(where), point);
    await page.mouse.move(...await at(vessel.entry.position));
    await page.waitForFunction(() => document.getElementById("mark-name").checkVisibility() && document.getElementById("mark-name").textContent === "entry of catheter");
    await page.click("#pick-target");
    await page.mouse.click(470, 500); // between the legs of the bend
    await until(page, "said.some((text) => /There is no vessel under the pointer: a click on vessel picks/.test(text))");
    await page.mouse.click(...await at(place(0.8)));
    await until(page, "s.picks.target !== null && s.picks.entry === null && Math.abs(s.picks.target.radius - 0.005) < 0.001");
    assert.match(await page.innerText("#picked-target"), /radius [45]\.\d\d mm/);
    const target = await page.evaluate(() => window.trocar.picks.target.position);
    assert.ok(Math.hypot(...target.map((x, k) => x - place(0.8)[k])) < 0.006, `${target}`);
    await page.click("#pick-entry");
    await page.mouse.click(...await at([0, 0, 0.003])); // the end that the instrument's own entry is near
    await until(page, "s.picks.entry !== null && s.picks.entry.direction[2] > 0.9");
    await page.fill("#picked-name", "beyond");
    await page.click("#scene-save");
    await until(page, "s.saved?.file.endsWith('bend-picked.json')");
    assert.equal(await page.innerText("#saved-command"), `trocar view ${join(folder, "bend-picked.json")}`);
    await page.fill("#scene-file", "bend"); // the original's
    await page.click("#scene-save");
    await until(page, "said.some((text) => /nothing was saved: there is a file bend.json already/.test(text))");
    await page.click("#unpick");
    await until(page, "s.picks.target === null && s.picks.entry === null && document.getElementById('picked-target').textContent === '–'");
    for (const id of ["#centreline", "#marks"]) await page.click(id);
    assert.equal(readFileSync(original, "utf8"), readFileSync(scene, "utf8"));
    noComplaints(page);
    await page.close();
    assert.equal(await suite.stop(), 0);
    const again = await Served.start(join(folder, "bend-picked.json"), ["--script"]);
    const opened = await openPage(browser, again.url);
    await until(opened, "s.scene.targets.some((mark) => mark.name === 'beyond') && t.script && t.insertion_m > 0.01");
    const distance = await opened.evaluate((there) => Math.hypot(...window.trocar.scene.targets.find((mark) => mark.name === "beyond").position.map((x, k) => x - there[k])), target);
    assert.ok(distance < 1e-6, `${distance}`);
    await opened.close();
    assert.equal(await again.stop(), 0);
});

/// As thin as a guide wire's tip in a vessel: without help less than a pixel in the whole view.
const thinScene = join(folder, "thin.json");
writeFileSync(thinScene, readFileSync(contrastScene, "utf8").replace('"radius":0.5', '"radius":0.1').replace('"inserted":20', '"inserted":80'));

test("in the whole view the instrument is at least two pixels wide", async () => {
    const other = await Served.start(thinScene, ["--paused"]);
    const page = await openPage(browser, `${other.url}&pixels=1`);
    await page.keyboard.press("Escape");
    await page.keyboard.press("v");
    await until(page, "s.pictures > 3");
    assert.ok(await page.evaluate(() => 0.2 / window.trocar.mmPerPixel) < 2, "its own width is less than two pixels");
    const widths = await bluishWidths(browser, page, { x: 280, y: 60, width: 340, height: 480 });
    assert.ok(widths.length > 50, `${widths.length} rows show it`);
    assert.ok(widths.sort((a, b) => a - b)[Math.floor(0.05 * widths.length)] >= 2, `${widths}`);
    await page.close();
    assert.equal(await other.stop(), 0);
});

test("a recording under a work budget that is too small says so", async () => {
    await afresh(page);
    await page.click("[data-mode=work]");
    await until(page, "t.budget.mode === 'work'");
    await page.focus("#budget");
    await page.keyboard.press("Home");
    await until(page, "t.budget.units === 10");
    await page.click("#record");
    await until(page, "said.some((text) => /Recording from the start, under 10 tests a step: too few for exact contacts/.test(text))");
    await page.focus("#budget");
    await page.keyboard.press("End");
    await until(page, "t.budget.units > 1e6");
    await page.click("[data-mode=wall]");
    await until(page, "t.budget.mode === 'wall'");
});

test("on a telephone the panel is folded until it is wanted, and the toolbar scrolls to its end", async () => {
    const narrow = await openPage(browser, served.url, { viewport: { width: 390, height: 780 } });
    await narrow.keyboard.press("Escape");
    const folded = await narrow.locator("#panel").boundingBox();
    assert.ok(folded.height < 60, `${folded.height}`);
    assert.ok(!(await narrow.isVisible("#budget")));
    assert.equal(await narrow.getAttribute("#fold", "aria-expanded"), "false");
    await narrow.click("#fold");
    await narrow.waitForFunction(() => document.getElementById("panel").getBoundingClientRect().height > 150);
    assert.ok(await narrow.isVisible("#budget"));
    await narrow.click("#fold");
    assert.ok(!(await narrow.isVisible("#budget")));
    const reached = await narrow.evaluate(() => {
        const bar = document.getElementById("bar"), last = document.getElementById("help");
        const scrolls = bar.scrollWidth > bar.clientWidth && bar.scrollHeight <= bar.clientHeight + 1;
        last.scrollIntoView({ inline: "end", block: "nearest" });
        const box = last.getBoundingClientRect();
        return scrolls && last.contains(document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2));
    });
    assert.ok(reached);
    const apart = await narrow.evaluate(() => ["title", "hand", "panel", "bar", "scale"].map((id) => document.getElementById(id).getBoundingClientRect().toJSON()));
    for (const [k, a] of apart.entries()) for (const b of apart.slice(k + 1))
        assert.ok(a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top, JSON.stringify([a, b]));
    noComplaints(narrow);
    await narrow.close();
});

test("a program that was started anew is told from one that is not there", async () => {
    const first = await Served.start(scene);
    const page = await openPage(browser, first.url);
    await first.stop();
    const again = await Served.start(scene, ["--port", new URL(first.url).port]);
    await until(page, "said.some((text) => /started anew/.test(text))");
    await page.close();
    await again.stop();
});

test("a recording is downloaded and `trocar run` repeats it bit for bit", async () => {
    await afresh(page);
    await page.click("[data-mode=wall]");
    await until(page, "t.budget.mode === 'wall'");
    await page.click("#record");
    await until(page, "t.repeatable && t.budget.mode === 'work' && t.budget.units === t.work_enough && said.some((text) => /tests a step instead of/.test(text))");
    await page.locator("#view").focus();
    await page.keyboard.down("w");
    await until(page, "t.insertion_m > 0.03");
    await page.keyboard.up("w");
    assert.ok(await page.evaluate(() => window.trocar.status.exact_ran)); // as live
    await page.keyboard.press("Space");
    await until(page, "t.paused && t.repeatable");
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("#download")]);
    const path = join(folder, "hand.csv");
    await download.saveAs(path);
    const text = readFileSync(path, "utf8");
    const command = text.match(/# Bit for bit: trocar run \S+ --budget (\S+) -n (\d+) --path THIS_FILE/);
    const hash = text.match(/# state_hash (\w+)/)[1];
    execFileSync(process.env.TROCAR, ["run", scene, "--budget", command[1], "-n", command[2], "--path", path, "--out", join(folder, "out"), "--no-pictures", "--quiet"]);
    assert.equal(JSON.parse(readFileSync(join(folder, "out", "summary.json"), "utf8")).state_hash, hash);
    await page.keyboard.press("Space");
});

test("a telephone's screen holds the page, and a finger drives", async () => {
    const other = await Served.start(scene);
    const context = await browser.newContext({ viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true });
    const page = await context.newPage();
    page.setDefaultTimeout(kPatience);
    await page.goto(other.url);
    await until(page, "s.status !== undefined");
    await page.evaluate(() => document.getElementById("begin").click());
    const start = await status(page);
    const box = await page.locator("#pad").boundingBox();
    assert.ok(box.x >= 0 && box.x + box.width <= 390 && box.y >= 0 && box.y + box.height <= 780);
    const touch = await context.newCDPSession(page);
    const at = (type, y) => touch.send("Input.dispatchTouchEvent", { type, touchPoints: type === "touchEnd" ? [] : [{ x: box.x + box.width / 2, y }] });
    await at("touchStart", box.y + box.height / 2);
    await at("touchMove", box.y + 12);
    await until(page, "t.insertion_m > g + 1e-3", start.insertion_m);
    await at("touchEnd", 0);
    await until(page, "t.drive[0] === 0");
    await context.close();
    await other.stop();
});
