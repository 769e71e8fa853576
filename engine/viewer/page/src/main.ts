// Joins the parts: what comes from the server goes to the stage and the panel, user input goes to the server.
import { Vector3 } from "three";
import { Connection } from "./connection";
import { Hand, hasItsOwn, isDriven } from "./hand";
import { History } from "./history";
import { Panel } from "./panel";
import { Plot } from "./plot";
import type { Picks, SavedScene, SceneMessage, Status, XrayPicture } from "./protocol";
import { Orientation } from "./orientation";
import { Picker } from "./picker";
import { Puller } from "./puller";
import { Stage } from "./stage";
import { ScaleBar } from "./scale";
import { XrayScreen } from "./xray";

/// State for tests and for inspection in the console.
export interface Probe {
    pictures: number;
    frames: number;
    status: Status | undefined;
    scene: SceneMessage | undefined;
    picks: Picks | undefined;
    saved: SavedScene | undefined; // the last one
    latencyMs: number[]; // from a key to the picture that shows its effect
    frameMs: number;
    drawMs: number;
    pixels: number;
    triangles: number;   // of the last picture
    bytes: number;
    xray: { pictures: number; perSecond: number; latest: XrayPicture | undefined; shown: boolean }; // of the X-ray monitor
    mmPerPixel: number;  // in the middle of the view
    looking: [number, number, number]; // unit vector from the eye into the scene
    at(place: [number, number, number]): [number, number]; // pixels of the page where it is seen
    drop(): void;
}
declare global {
    interface Window { trocar: Probe }
}

const kNumbersEvery = 250; // ms, where the CPU draws
const kTurn = 8; // ms from one turn to the next, there
const kLongestAnswer = 80; // ms from a key to what it did; then it may come whenever it wants

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

class App {
    private readonly connection: Connection;
    private readonly stage: Stage;
    private readonly hand: Hand;
    private readonly plot = new Plot(element<HTMLCanvasElement>("plot"));
    private readonly histories = [
        new History(element<HTMLCanvasElement>("force-plot"), (step) => step[6], "N", 3, "#fb923c"),
        new History(element<HTMLCanvasElement>("insertion-plot"), (step) => step[7], "mm", 1, "#4ade80"),
    ];
    private readonly panel: Panel;
    private readonly puller: Puller;
    private readonly picker: Picker;
    private readonly xray: XrayScreen;
    private readonly welcome = element<HTMLDialogElement>("welcome");
    private status: Status | undefined;
    private scene: SceneMessage | undefined;
    private awaited: { at: number; insertion: number; rotation: number } | undefined;
    private seen: number | undefined; // moment of the key whose effect the next picture shows
    private turns = 0;
    readonly probe: Probe;

    constructor() {
        this.stage = new Stage(element<HTMLCanvasElement>("view"));
        document.body.classList.toggle("plain", this.stage.software);
        this.connection = new Connection({
            onScene: (scene) => this.setScene(scene),
            onModel: (model) => this.stage.setModel(model),
            onFrame: (frame, shapes) => {
                this.stage.setFrame(frame, shapes);
                this.puller.follow();
                ++this.probe.frames;
            },
            onXray: (picture) => {
                this.xray.receive(picture);
                if (this.xray.shown) ++this.probe.pictures;
            },
            onStatus: (status) => this.setStatus(status),
            onPicks: (picks) => {
                this.probe.picks = picks;
                this.picker.setPicks(picks);
            },
            onSavedScene: (saved) => {
                this.probe.saved = saved;
                this.picker.setSaved(saved);
            },
            onMessage: (kind, text) => {
                if (kind === "error") this.picker.refuse();
                this.panel.say(kind, text);
            },
            onConnection: (open) => this.setConnection(open),
        });
        const send = (message: Record<string, unknown>) => this.send(message);
        const orientation = new Orientation((from) => (this.xray.shown ? this.xray.lookFrom(from) : this.stage.lookFrom(from)));
        const scale = new ScaleBar(element("scale"));
        this.stage.onTurn = (axes, mmPerPixel) => {
            orientation.update(axes);
            scale.update(mmPerPixel);
        };
        this.xray = new XrayScreen(send, (text) => this.panel.say("notice", text), (axes) => orientation.update(axes));
        this.panel = new Panel(this.stage, this.xray, this.plot, send, () => this.showHelp(), this.connection);
        this.puller = new Puller(this.stage, element("view"), send, (text) => this.panel.say("notice", text));
        this.picker = new Picker(this.stage, element("view"), send, {
            say: (text, id) => this.panel.say("notice", text, id),
            unsay: (id) => this.panel.unsay(id),
        });
        this.hand = new Hand(element("pad"), element("knob"),
            (wish) => this.send({ type: "drive", ...wish }), () => this.beginDrive());
        this.hand.onGamepadButton = (button) => {
            if (button === 0) this.panel.togglePause();
            if (button === 3) this.panel.toggleXray();
        };
        this.probe = {
            pictures: 0, frames: 0, status: undefined, scene: undefined, picks: undefined, saved: undefined, latencyMs: [], frameMs: 16, drawMs: 0, pixels: 1, triangles: 0, bytes: 0, xray: this.xray, mmPerPixel: 0, looking: this.stage.looking,
            at: (place) => this.stage.project(new Vector3(...place)),
            drop: () => this.connection.drop(),
        };
        addEventListener("keydown", (event) => this.key(event));
        this.welcome.addEventListener("close", () => element("view").focus());
        element("begin").addEventListener("click", () => this.closeHelp());
        addEventListener("keydown", (event) => { // wherever the focus is
            if (!this.welcome.open || /^(Tab|Shift|Control|Alt|Meta)/.test(event.code) || event.metaKey || event.ctrlKey) return;
            this.closeHelp();
            if (isDriven(event.code)) return; // begins at once
            event.preventDefault();
            event.stopPropagation();
        }, { capture: true });
        this.showHelp();
        this.keepFocus();
        this.watchContext();
        this.connection.connect();
        this.takeTurn();
    }

    private send(message: Record<string, unknown>): boolean {
        const seat = this.status;
        // A free driver's seat is taken by the next viewer with input.
        const own = message.type === "spheres" || message.type === "xray"; // of this viewer alone
        if (seat !== undefined && seat.driver === 0 && !own) this.connection.send({ type: "take" });
        else if (seat !== undefined && seat.driver !== seat.you && !own) {
            if (message.type !== "drive") this.panel.say("notice", `Viewer ${seat.driver} drives; you watch.`);
            return false;
        }
        return this.connection.send(message);
    }

    private setScene(scene: SceneMessage): void {
        this.scene = this.probe.scene = scene;
        document.title = `Trocar: ${scene.name}`;
        this.stage.setScene(scene);
        this.panel.setScene(scene);
        this.picker.setScene(scene);
    }

    private setStatus(status: Status): void {
        if (this.status !== undefined && status.run !== this.status.run) this.plot.clear();
        this.status = this.probe.status = status;
        if (this.awaited && (Math.abs(status.insertion_m - this.awaited.insertion) > 1e-6 || Math.abs(status.rotation_rad - this.awaited.rotation) > 1e-4)) {
            this.seen = this.awaited.at;
            this.awaited = undefined;
            if (this.stage.software && this.showAwaited()) ++this.probe.pictures; // at once: the next turn may be a while away where the CPU draws
        }
        if (!this.isAwaited()) this.goOn();
        this.plot.add(status.steps);
        this.panel.setStatus(status);
    }

    private setConnection(open: boolean): void {
        this.panel.setConnection(open);
        this.status = undefined;
        this.hand.forget();
        this.hand.release();
        this.puller.forget();
        if (open) this.connection.send({ type: "spheres", on: this.stage.showSpheres });
        if (open) this.xray.begin();
    }

    private beginDrive(): void {
        if (this.welcome.open) this.closeHelp();
        if (this.status === undefined) return;
        const { driver, you } = this.status;
        if (this.scene?.has_instrument === false) this.panel.say("notice", "This scene has no instrument to drive.");
        else if (driver !== 0 && driver !== you) this.panel.say("notice", `Viewer ${driver} drives; you watch.`);
        else if (this.status.paused) this.panel.say("notice", "The run is paused: Space goes on.");
        else this.awaited ??= { at: performance.now(), insertion: this.status.insertion_m, rotation: this.status.rotation_rad };
    }

    /// The view gets the keys at once: the close event comes a frame later, and until then the hidden button would take Space.
    private closeHelp(): void {
        this.welcome.close();
        element("view").focus();
    }

    private showHelp(): void {
        if (!this.welcome.open) this.welcome.showModal();
        this.welcome.scrollTop = 0; // its button has the focus, and lies below
    }

    private key(event: KeyboardEvent): void {
        if (event.ctrlKey || event.altKey || event.metaKey) return;
        if (event.code === "Escape" && event.target instanceof HTMLElement) element("view").focus();
        if (event.code === "Escape") this.picker.disarm();
        if (!hasItsOwn(event) && this.panel.key(event)) event.preventDefault();
    }

    /// The keys are the view's again after a click: Space pauses, and does not press once more what was clicked. By keyboard Enter presses a button.
    private keepFocus(): void {
        addEventListener("click", (event) => {
            const { target, detail } = event;
            if (detail > 0 && target instanceof Element && target.closest("button, a, label, input:not([type=range], [type=text])") !== null) element("view").focus();
        });
        for (const slider of document.querySelectorAll("input[type=range]")) slider.addEventListener("pointerup", () => element("view").focus());
        addEventListener("keyup", (event) => {
            if (event.code === "Space" && event.target instanceof HTMLButtonElement) event.preventDefault();
        });
    }

    /// A frozen picture while the catheter moves would mislead.
    private watchContext(): void {
        element("view").addEventListener("webglcontextlost", (event) => {
            event.preventDefault(); // it may come back
            this.hand.blind = true;
            this.hand.poll(performance.now());
            this.panel.say("error", "The browser lost its graphics: the picture stands still, and driving stops until it is back. Reload the page if that takes long.", "graphics");
        });
        element("view").addEventListener("webglcontextrestored", () => {
            this.hand.blind = false;
            this.panel.unsay("graphics");
            this.stage.touch();
        });
    }

    /// The picture that shows what a key did, and how long after the key it stood there.
    private showAwaited(): boolean {
        const key = this.seen!;
        this.seen = undefined;
        const drawn = this.stage.render(true);
        if (this.stage.software) this.stage.waitForPicture(); // drawn, not only asked for
        this.probe.latencyMs.push(performance.now() - key);
        if (this.probe.latencyMs.length > 100) this.probe.latencyMs.shift();
        return drawn;
    }

    private draw(now: number): void {
        this.hand.poll(now);
        this.puller.followPointer();
        if (!this.isAwaited()) this.hand.showKnob();
        const drawn = this.seen !== undefined ? this.showAwaited() : !this.isAwaited() && this.stage.render();
        if (drawn) ++this.probe.pictures;
        ++this.turns;
        this.probe.frameMs = this.stage.frameMs;
        this.probe.drawMs = this.stage.drawMs;
        this.probe.pixels = this.stage.pixels;
        this.probe.triangles = this.stage.triangles;
        this.probe.bytes = this.connection.received;
        this.probe.looking = this.stage.looking;
        this.probe.mmPerPixel = this.stage.mmPerPixel;
        if (this.stage.software) this.writeWith(drawn, now);
        else this.write(this.turns % 3 === 0, this.turns % 20 === 0);
        if (this.isAwaited()) this.rest = setTimeout(() => this.goOn(), kLongestAnswer);
        else this.takeTurn();
    }

    /// Turns rest while an answer is awaited: each would put the page together anew.
    private goOn(): void {
        if (this.rest === undefined) return;
        clearTimeout(this.rest);
        this.rest = undefined;
        this.takeTurn();
    }
    /// Where the CPU draws, the page is put together for every turn that asks for a frame, though nothing has changed; a timer does not.
    private takeTurn(): void {
        if (this.stage.software) setTimeout(() => this.draw(performance.now()), kTurn);
        else requestAnimationFrame((now) => this.draw(now));
    }
    private rest: ReturnType<typeof setTimeout> | undefined;

    /// Where the CPU draws: an answer is under way, and what is drawn now would be in its way. It may never come (the wall holds the
    /// catheter back).
    private isAwaited(): boolean {
        return this.stage.software && this.awaited !== undefined && performance.now() - this.awaited.at < kLongestAnswer;
    }

    /// Where the CPU draws, each change of the page is put together with the picture anew: so they come together with one.
    private writeWith(drawn: boolean, now: number): void {
        const waited = now - this.wroteAt;
        if (waited < kNumbersEvery || (!drawn && (waited < 2 * kNumbersEvery || this.isAwaited()))) return;
        this.wroteAt = now;
        this.write(true, true);
    }
    private wroteAt = 0;

    private write(plot: boolean, footer: boolean): void {
        this.panel.refresh();
        if (plot && this.scene) this.plot.draw(1e3 * this.scene.step_s);
        if (plot && this.scene?.has_instrument) for (const history of this.histories) history.draw(this.plot.shown);
        const { shown, perSecond } = this.xray;
        if (footer) this.panel.setFooter(shown ? 1000 / Math.max(perSecond, 1) : this.stage.frameMs, shown ? 1 : this.stage.pixels, shown ? [] : this.probe.latencyMs, this.hand.gamepadName);
    }
}

function fatal(text: string): void {
    const box = element("messages");
    const line = document.createElement("p");
    line.textContent = text;
    box.append(line);
}

addEventListener("error", (event) => fatal(`The page failed: ${event.message}`));
try {
    window.trocar = new App().probe;
} catch (problem) {
    fatal(problem instanceof Error && /webgl/i.test(problem.message)
        ? "This browser gives the page no WebGL 2: allow it in its settings, or use another one. `trocar run` makes pictures without a browser."
        : `The page failed: ${problem instanceof Error ? problem.message : String(problem)}`);
}
