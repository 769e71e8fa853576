// The X-ray monitor: what the server's C-arm sees, its arm, contrast, subtraction and roadmap.
import { FilmStrip, imageOf } from "./film";
import { axesOfArm, drawOrientation, lettersOf, type Axes, type Direction } from "./orientation";
import type { Status, XrayPicture } from "./protocol";

type Send = (message: Record<string, unknown>) => boolean;
export type Display = "log" | "subtraction" | "roadmap";

const kDisplays: Display[] = ["log", "subtraction", "roadmap"]; // as XrayPicture.display counts them
const kDegree = Math.PI / 180;
const kMostPrimary = 120, kMostSecondary = 50; // degrees, that the arm's sliders and the mouse reach: its mechanics
const kMostZoom = 8;
const kSendEvery = 60;    // ms between two messages while the arm is moved
const kDrag = 0.4;        // degrees a pixel
const kPresets: [string, number, number][] = [ // name, primary, secondary in degrees
    ["AP", 0, 0], ["Lateral", 90, 0], ["LAO 45", 45, 0], ["RAO 30", -30, 0], ["CRA 25", 0, 25], ["CAU 25", 0, -25],
];

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

/// "LAO 30°, CRA 20°"
export function angleWords(primary: number, secondary: number): string {
    const word = (radians: number, plus: string, minus: string) => {
        const degrees = Math.round(radians / kDegree);
        return degrees === 0 ? "" : `${degrees > 0 ? plus : minus} ${Math.abs(degrees)}°`;
    };
    return [word(primary, "LAO", "RAO"), word(secondary, "CRA", "CAU")].filter((text) => text !== "").join(", ") || "AP 0°";
}

export class XrayScreen {
    shown = false;
    pictures = 0;
    perSecond = 0;  // pictures, smoothed
    latest: XrayPicture | undefined;
    private readonly screen = element("xray-screen");
    private readonly canvas = element<HTMLCanvasElement>("xray-picture");
    private readonly pen = this.canvas.getContext("2d", { alpha: false })!;
    private readonly primary = element<HTMLInputElement>("primary");
    private readonly secondary = element<HTMLInputElement>("secondary");
    private readonly zoom = element<HTMLInputElement>("zoom");
    private readonly film = new FilmStrip(() => {
        const picture = this.film.reviewed ?? this.latest;
        if (picture && this.shown) this.draw(picture);
    });
    private display: Display = "log";
    private atTip = false;
    private wanted = { primary: 0, secondary: 0, zoom: 1 }; // degrees
    private movedAt = 0;  // ms: until a while later the sliders are the user's
    private sentAt = 0;
    private due: ReturnType<typeof setTimeout> | undefined;
    private cameAt = 0;
    private status: Status | undefined;

    /// turned   the picture has other axes
    constructor(private readonly send: Send, private readonly say: (text: string) => void, private readonly turned: (axes: Axes) => void) {
        for (const [name, primary, secondary] of kPresets) {
            const button = document.createElement("button");
            button.type = "button";
            button.textContent = name;
            button.addEventListener("click", () => this.turnTo(primary, secondary));
            element("presets").append(button);
        }
        for (const input of [this.primary, this.secondary, this.zoom])
            input.addEventListener("input", () => this.move({ primary: Number(this.primary.value), secondary: Number(this.secondary.value), zoom: Number(this.zoom.value) }));
        element("inject").addEventListener("click", () => this.inject());
        element("subtract").addEventListener("click", () => this.show("subtraction"));
        element("roadmap").addEventListener("click", () => this.show("roadmap"));
        element("mask").addEventListener("click", () => this.send({ type: "mask" }));
        this.drag();
        addEventListener("resize", () => this.fit());
    }

    toggle(on: boolean): void {
        this.shown = on;
        this.screen.hidden = element("film").hidden = element("carm").hidden = !on;
        this.send({ type: "xray", on });
        if (!on) return;
        this.fit();
        if (this.latest) this.draw(this.latest);
        this.turned(this.axes);
    }
    /// After a connection is made anew.
    begin(): void {
        if (this.shown) this.send({ type: "xray", on: true });
    }

    get axes(): Axes { return axesOfArm(this.latest?.primary ?? 0, this.latest?.secondary ?? 0); }

    // The arm.
    turn(primary: number, secondary: number): void { this.move({ ...this.wanted, primary: this.wanted.primary + primary, secondary: this.wanted.secondary + secondary }); }
    approach(times: number): void { this.move({ ...this.wanted, zoom: this.wanted.zoom / times }); }
    turnTo(primary: number, secondary: number): void { this.move({ ...this.wanted, primary, secondary }); }
    /// From a side of the patient, as far as the arm gets there.
    lookFrom([x, y, z]: Direction): void {
        if (Math.abs(z) > 0.5) return this.turnTo(0, Math.sign(z) * kMostSecondary);
        this.turnTo(y < 0 ? 180 : Math.sign(-x) * 90, 0);
    }
    whole(): void {
        this.atTip = false;
        this.move({ primary: 0, secondary: 0, zoom: 1 });
    }
    /// The table is moved so that the tip is in the middle of the picture; it does not follow it.
    toTip(on: boolean): void {
        this.atTip = on;
        this.move({ ...this.wanted, zoom: on ? Math.max(this.wanted.zoom, 3) : 1 });
    }

    private move(to: { primary: number; secondary: number; zoom: number }): void {
        const clamp = (value: number, least: number, most: number) => Math.min(most, Math.max(least, value));
        const far = Math.abs(to.primary) === 180; // only from the cube: the sliders end where mechanics do
        this.wanted = {
            primary: far ? to.primary : clamp(to.primary, -kMostPrimary, kMostPrimary), secondary: clamp(to.secondary, -kMostSecondary, kMostSecondary),
            zoom: clamp(to.zoom, 1, kMostZoom),
        };
        this.movedAt = performance.now();
        this.film.review(undefined);
        this.showWanted();
        this.sendLater();
    }
    private showWanted(): void {
        const { primary, secondary, zoom } = this.wanted;
        [this.primary.value, this.secondary.value, this.zoom.value] = [String(primary), String(secondary), String(zoom)];
        element("primary-text").textContent = primary === 0 ? "0°" : `${primary > 0 ? "LAO" : "RAO"} ${Math.abs(primary).toFixed(0)}°`;
        element("secondary-text").textContent = secondary === 0 ? "0°" : `${secondary > 0 ? "CRA" : "CAU"} ${Math.abs(secondary).toFixed(0)}°`;
        element("zoom-text").textContent = `${zoom.toFixed(1)}×`;
    }
    /// As often as pictures can follow.
    private sendLater(): void {
        if (this.due !== undefined) return;
        const wait = Math.max(0, this.sentAt + kSendEvery - performance.now());
        this.due = setTimeout(() => {
            this.due = undefined;
            this.sendArm();
        }, wait);
    }
    private sendArm(): void {
        this.sentAt = performance.now();
        const { primary, secondary, zoom } = this.wanted;
        this.send({ type: "carm", primary: primary * kDegree, secondary: secondary * kDegree, zoom, at_tip: this.atTip, pixels: 512, display: this.display });
    }

    /// Dragged, the picture turns the arm: to the right is what shows more of the patient's right side.
    private drag(): void {
        let last: { x: number; y: number } | undefined;
        this.screen.addEventListener("pointerdown", (event) => {
            if (event.target !== this.canvas) return;
            this.canvas.setPointerCapture(event.pointerId);
            last = { x: event.clientX, y: event.clientY };
        });
        this.screen.addEventListener("pointermove", (event) => {
            if (last === undefined) return;
            this.turn(kDrag * (last.x - event.clientX), kDrag * (event.clientY - last.y));
            last = { x: event.clientX, y: event.clientY };
        });
        for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const) this.screen.addEventListener(end, () => { last = undefined; });
        this.screen.addEventListener("wheel", (event) => {
            event.preventDefault();
            this.approach(event.deltaY > 0 ? 1.1 : 1 / 1.1);
        }, { passive: false });
    }

    // Contrast and what the monitor shows.
    inject(): void {
        if (this.status?.injection === null) return this.say("This scene has no contrast: the effect \"contrast\" gives it some.");
        if (this.send({ type: "inject" })) this.say("Contrast is injected.");
    }
    /// Pressed again: the plain picture. Subtraction begins with a mask of what is there now.
    show(display: Display): void {
        this.display = this.display === display ? "log" : display;
        this.showDisplay();
        this.sendArm();
        if (this.display === "subtraction") this.send({ type: "mask" });
    }
    private showDisplay(): void {
        element("subtract").setAttribute("aria-pressed", String(this.display === "subtraction"));
        element("roadmap").setAttribute("aria-pressed", String(this.display === "roadmap"));
    }
    setStatus(status: Status): void {
        this.status = status;
        const { injection } = status;
        const runs = injection !== null && status.time_s >= injection.start_s && status.time_s < injection.start_s + injection.duration_s;
        element<HTMLButtonElement>("inject").disabled = injection === null || runs;
        element("inject").title = injection === null ? "this scene has no effect \"contrast\"" : "contrast agent at the instrument's tip, as the scene's effect says, from now on";
        element("iodine").textContent = injection === null ? "none in this scene"
            : `${injection.in_vessels_mg.toFixed(0)} of ${injection.injected_mg.toFixed(0)} mg`;
    }

    // Pictures.
    receive(picture: XrayPicture): void {
        const now = performance.now();
        if (now - this.cameAt < 1000) this.perSecond += 0.1 * (1000 / Math.max(now - this.cameAt, 1) - this.perSecond);
        this.cameAt = now;
        const turned = this.latest === undefined || this.latest.primary !== picture.primary || this.latest.secondary !== picture.secondary;
        this.latest = picture;
        ++this.pictures;
        this.film.add(picture);
        if (now - this.movedAt > 500) { // another viewer's wishes, too
            this.wanted = { primary: picture.primary / kDegree, secondary: picture.secondary / kDegree, zoom: picture.zoom };
            this.display = kDisplays[picture.display - 1] ?? "log";
            this.showWanted();
            this.showDisplay();
        }
        if (!this.shown) return;
        if (turned) this.turned(this.axes);
        if (this.film.reviewed === undefined) this.draw(picture);
        this.film.show(now);
        if (picture.sourceInside) this.say("The X-ray source stands inside a body here: what is behind it is missing.");
    }

    private draw(picture: XrayPicture): void {
        const { columns, rows } = picture;
        if (this.canvas.width !== columns || this.canvas.height !== rows) {
            [this.canvas.width, this.canvas.height] = [columns, rows];
            this.fit();
        }
        this.pen.putImageData(imageOf(picture), 0, 0);
        const axes = axesOfArm(picture.primary, picture.secondary);
        const minus = (v: Direction): Direction => [-v[0], -v[1], -v[2]];
        const edges: [string, Direction][] = [["edge-w", minus(axes.right)], ["edge-e", axes.right], ["edge-n", axes.up], ["edge-s", minus(axes.up)]];
        for (const [id, way] of edges) element(id).textContent = lettersOf(way);
        const kind = { log: "", subtraction: " · subtraction", roadmap: " · roadmap" }[kDisplays[picture.display - 1] ?? "log"];
        const ago = this.film.reviewed === undefined ? "" : ` · ${(this.latest!.time - picture.time).toFixed(1)} s ago`;
        element("xray-words").textContent = `${angleWords(picture.primary, picture.secondary)}${kind} · ${picture.time.toFixed(2)} s${ago}`;
    }

    /// As large as the window has room for, in its own shape.
    private fit(): void {
        const { clientWidth, clientHeight } = this.screen;
        const below = parseFloat(getComputedStyle(this.screen).paddingBottom); // the film strip's and the bar's
        const scale = Math.min(clientWidth / this.canvas.width, (clientHeight - below) / this.canvas.height);
        const box = element("xray-frame");
        box.style.width = `${Math.floor(scale * this.canvas.width)}px`;
        box.style.height = `${Math.floor(scale * this.canvas.height)}px`;
    }

    /// The picture that is shown, with the letters of its edges, the cube and the arm's angles.
    save(name: string): void {
        const picture = this.film.reviewed ?? this.latest;
        if (picture === undefined) return;
        const copy = document.createElement("canvas");
        [copy.width, copy.height] = [picture.columns, picture.rows];
        const pen = copy.getContext("2d")!;
        pen.putImageData(imageOf(picture), 0, 0);
        const size = Math.max(12, Math.round(picture.rows / 26)), [w, h] = [copy.width, copy.height];
        pen.font = `600 ${size}px system-ui, sans-serif`;
        pen.textAlign = "center";
        pen.textBaseline = "middle";
        pen.lineWidth = size / 5;
        const write = (text: string, x: number, y: number) => {
            pen.strokeStyle = "#000";
            pen.strokeText(text, x, y);
            pen.fillStyle = "#ffe9a8";
            pen.fillText(text, x, y);
        };
        write(element("edge-w").textContent!, size, h / 2);
        write(element("edge-e").textContent!, w - size, h / 2);
        write(element("edge-n").textContent!, w / 2, size);
        write(element("edge-s").textContent!, w / 2, h - size);
        pen.textAlign = "left";
        write(element("xray-words").textContent!, size / 2, size);
        drawOrientation(pen, axesOfArm(picture.primary, picture.secondary), 3 * size, h - 3 * size, size / 16);
        copy.toBlob((blob) => {
            if (blob) saveAs(blob, `${name}-xray-${picture.time.toFixed(2)}s.png`);
        }, "image/png");
    }
}

export function saveAs(blob: Blob, name: string): void {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
