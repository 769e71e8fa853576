// Everything but the picture: budget, readings, effects, views, the run.
import type { Connection } from "./connection";
import { formatMs, type Plot } from "./plot";
import type { Budget, SceneMessage, Status } from "./protocol";
import type { Stage } from "./stage";
import { States } from "./states";
import { saveAs, type XrayScreen } from "./xray";

type Send = (message: Record<string, unknown>) => boolean;

const kNumbersEvery = 80; // ms
const kTurn = 0.08, kApproach = 0.9; // rad, times: of the camera by a key
const kArmTurn = 5; // degrees, of the arm by a key
const kMessageTime = 6000; // ms
const kNarrow = "(max-width: 820px), (max-height: 480px)"; // as style.css has it

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

export class Panel {
    private scene: SceneMessage | undefined;
    private status: Status | undefined;
    private readonly budget = element<HTMLInputElement>("budget");
    private wall = { mode: "wall", ms: 33 } as Budget & { mode: "wall" };
    private work: (Budget & { mode: "work" }) | undefined; // that the scene or a person chose
    private dragging = 0; // ms: until then the slider is the user's

    constructor(private readonly stage: Stage, private readonly xray: XrayScreen, private readonly plot: Plot, private readonly send: Send, help: () => void,
                connection: Connection) {
        this.budget.addEventListener("input", () => {
            this.dragging = performance.now() + 400;
            this.sendBudget(this.budgetAt(Number(this.budget.value)));
        });
        for (const button of document.querySelectorAll<HTMLButtonElement>("[data-mode]"))
            button.addEventListener("click", () => this.setMode(button.dataset.mode as Budget["mode"]));
        document.querySelector("[role=radiogroup]")!.addEventListener("keydown", (event) => this.chooseMode(event as KeyboardEvent));
        const click = (id: string, act: () => void) => element(id).addEventListener("click", act);
        click("pause", () => this.togglePause());
        click("step", () => this.singleStep());
        click("script", () => this.toggleScript());
        click("grab", () => this.toggleGrab());
        click("restart", () => this.restart());
        click("record", () => this.record());
        click("picture", () => this.savePicture());
        click("help", help);
        this.help = help;
        const check = (id: string, act: (on: boolean) => void) =>
            element<HTMLInputElement>(id).addEventListener("change", (event) => act((event.target as HTMLInputElement).checked));
        check("xray", (on) => this.setXray(on));
        check("follow", (on) => this.setFollow(on));
        check("contacts", (on) => this.setContacts(on));
        check("spheres", (on) => this.setSpheres(on));
        element("opacity").addEventListener("input", (event) => stage.setOrganOpacity(Number((event.target as HTMLInputElement).value) / 100));
        element("pace-wanted").addEventListener("input", (event) => {
            const factor = Number((event.target as HTMLInputElement).value) / 100;
            send({ type: "pace", factor });
        });
        this.states = new States(send, (text) => this.say("notice", text), connection.token);
        const fold = (folded: boolean) => {
            element("panel").classList.toggle("folded", folded);
            element("fold").setAttribute("aria-expanded", String(!folded));
        };
        click("fold", () => fold(!element("panel").classList.contains("folded")));
        fold(matchMedia(kNarrow).matches); // a small screen begins with the picture
        element("download").addEventListener("click", (event) => {
            if (connection.open) return;
            event.preventDefault();
            this.say("error", "The path lies with trocar, and the connection is lost: it can be downloaded when that is back.");
        });
        element<HTMLAnchorElement>("download").href = `/recording.csv?token=${encodeURIComponent(connection.token)}`;
    }
    private readonly help: () => void;
    private readonly states: States;

    setScene(scene: SceneMessage): void {
        this.scene = scene;
        this.states.setScene(scene);
        element("scene-name").textContent = scene.name;
        element("scope").textContent = scene.scope === "step" ? "(all of it)" : "(its collision part)";
        if (scene.budget.mode === "wall") this.wall = { ...scene.budget };
        if (scene.budget.mode === "work") this.work = { ...scene.budget };
        const box = element("effects");
        box.replaceChildren();
        for (const { name, label: words } of scene.effects) {
            const label = document.createElement("label"), input = document.createElement("input");
            input.type = "checkbox";
            input.id = `effect-${name}`;
            input.addEventListener("change", () => this.send({ type: "effect", name, on: input.checked }));
            label.append(input, ` ${words}`);
            box.append(label);
        }
        if (scene.effects.length === 0) box.textContent = "none that can be switched";
        element("script").hidden = !scene.has_script;
        element("grab").hidden = !scene.parts.some((part) => part.pullable);
        for (const id of ["hand", "record", "download", "histories"]) element(id).hidden = !scene.has_instrument;
        element("welcome-title").textContent = scene.has_instrument ? "Drive the catheter" : "Watch, and change what is simulated";
        element("welcome-text").textContent = scene.has_instrument
            ? "You drive a catheter from the patient's groin, or from wherever this scene's port is. Press a key to begin."
            : "This scene has no instrument: nothing can be driven. Press a key to begin.";
        const levels = element("levels");
        levels.replaceChildren(...Array.from({ length: scene.leaf_level + 1 }, () => document.createElement("i")));
    }

    /// Numbers are for reading: a few times a second. Where there is no card every change of the page takes as long as a picture: there
    /// they wait for the next one (refresh()).
    setStatus(status: Status): void {
        const before = this.status;
        const turned = before === undefined || status.paused !== before.paused || status.driver !== before.driver || status.failure !== before.failure;
        this.status = status;
        if (turned) this.show();
        else this.late = true;
    }
    /// Writes what has waited.
    refresh(): void {
        if (this.late && performance.now() - this.shownAt > kNumbersEvery) this.show();
    }
    private shownAt = -1e9;
    private late = false;

    private show(): void {
        this.late = false;
        this.shownAt = performance.now();
        const status = this.status;
        if (status === undefined) return;
        const text = (id: string, value: string, kind = "") => {
            const node = element(id);
            if (node.textContent !== value) node.textContent = value;
            if (node.className !== kind) node.className = kind;
        };
        this.showRun(status);
        this.showBudget(status.budget);
        this.showAnswer(status, text);
        this.warnOfWork(status);
        this.xray.setStatus(status);
        this.states.setStatus(status);
        const percent = (share: number) => `${(100 * share).toFixed(0)} %`;
        text("kept", `kept ${percent(this.plot.kept)}, real time ${percent(this.plot.realTimeKept(1e3 * (this.scene?.step_s ?? 1)))}`);
        for (const [name, on] of Object.entries(status.effects)) {
            const input = document.getElementById(`effect-${name}`) as HTMLInputElement | null;
            if (input && document.activeElement !== input) input.checked = on;
        }
        text("insertion", `${(1e3 * status.insertion_m).toFixed(1)} mm`);
        text("rotation", `${((180 / Math.PI) * status.rotation_rad).toFixed(0)}°`);
        text("target", status.target_m >= 0 ? `${(1e3 * status.target_m).toFixed(1)} mm` : "–");
    }

    /// The basis of the last step's contacts: nothing is called tested that was switched off, or before a step was taken.
    private showAnswer(status: Status, text: (id: string, value: string, kind?: string) => void): void {
        const { coarse_contact: spheres, exact_contact: exact } = status.effects;
        const began = status.stepped, looked = began && spheres, open = looked && status.pairs_open > 0;
        const leaf = this.scene?.leaf_level ?? 0;
        if (!looked) text("level", spheres ? "–" : "sphere trees off", spheres ? "" : "warn");
        else if (!open && status.pairs_tested === 0) text("level", `${status.level} of ${leaf}, nothing near`); // nothing was tested: never green
        else text("level", `${status.level} of ${leaf}${open ? "" : ", all tested"}`, open ? "warn" : "good");
        text("assumed", looked ? `${status.assumed} of ${status.pairs_tested + status.pairs_open}` : "–", looked && status.assumed > 0 ? "warn" : "");
        if (status.exact_ran) text("error", "0, exact");
        else if (!spheres) text("error", exact ? "unknown" : "nothing is tested", "bad");
        else if (open) text("error", `up to ${(1e3 * status.error_m).toFixed(2)} mm`, "warn");
        else text("error", began ? "leaf spheres" : "–");
        if (status.exact_ran) text("exact", `${status.exact_contacts} met, ${status.pressing_contacts} press${status.exact_insisted ? ", had to run" : ""}`);
        else if (exact) text("exact", began ? "did not run" : "–", began ? "warn" : "");
        else text("exact", spheres ? "not asked for" : "off", spheres ? "" : "warn");
        text("force", spheres || exact ? `${status.force_n.toFixed(2)} N` : "–");
        text("exits", `${status.lumen_exits}`, status.lumen_exits > 0 ? "bad" : "");
        const levels = element("levels");
        levels.classList.toggle("cut", open);
        [...levels.children].forEach((bar, k) => bar.classList.toggle("on", looked && status.pairs_tested + status.pairs_open > 0 && k <= Math.min(status.level, leaf)));
    }

    /// A work budget is never exceeded by time: the exact stage may never fit into it.
    private warnOfWork(status: Status): void {
        const { budget } = status;
        const short = budget.mode === "work" && status.stepped && status.effects.exact_contact && !status.exact_ran && this.scene?.has_instrument;
        if (short === this.workIsShort) return;
        this.workIsShort = short;
        if (!short || budget.mode !== "work") return this.unsay("work");
        this.say("notice", `Exact contacts do not run: ${shortNumber(budget.units)} tests a step are too few for them, ${shortNumber(Math.max(status.work_enough, budget.units))} would do.`, "work");
    }
    private workIsShort: boolean | undefined = false;

    private showRun(status: Status): void {
        const pill = (id: string, value: string, kind: string) => {
            const node = element(id);
            node.textContent = value;
            node.className = `pill ${kind}`;
        };
        const slow = status.pace < 0.95;
        if (status.failure) pill("pace", "stopped", "bad");
        else if (status.paused) pill("pace", "paused", "warn");
        else pill("pace", slow ? `behind: ${status.pace.toFixed(2)} of real time` : "real time", slow ? "warn" : "good");
        pill("clock", `${status.time_s.toFixed(2)} s · step ${status.step}`, "");
        const mine = status.driver === status.you;
        pill("seat", mine ? (status.script ? "autopilot" : "you drive") : status.driver === 0 ? "nobody drives: press a key" : `viewer ${status.driver} drives`, mine ? "good" : "");
        element("pause").setAttribute("aria-pressed", String(status.paused));
        element("script").setAttribute("aria-pressed", String(status.script));
        const pace = element<HTMLInputElement>("pace-wanted");
        if (document.activeElement !== pace) pace.value = String(Math.round(100 * status.pace_wanted));
        element("pace-text").textContent = `${status.pace_wanted.toFixed(2)}×`;
        const record = element("record");
        record.classList.toggle("on", status.repeatable);
        record.textContent = status.repeatable ? `● ${status.recorded} steps` : "Record";
        element("download").title = status.repeatable ? "replays to the same bits with `trocar run --path`; its first lines say how"
            : "drive positions since the start; its first lines say why they do not repeat bit for bit";
        if (status.failure) this.say("error", `The run stopped: ${status.failure}. R starts again.`, "failure");
    }

    private showBudget(budget: Budget): void {
        for (const button of document.querySelectorAll<HTMLButtonElement>("[data-mode]"))
            button.setAttribute("aria-checked", String(button.dataset.mode === budget.mode));
        element("budget-row").style.visibility = budget.mode === "exact" ? "hidden" : "visible";
        if (budget.mode === "wall") this.wall = budget;
        element("budget-text").textContent = budget.mode === "wall" ? formatMs(budget.ms) : budget.mode === "work" ? `${shortNumber(budget.units)} tests` : "";
        if (performance.now() > this.dragging && budget.mode !== "exact") this.budget.value = String(Math.round(this.placeOf(budget)));
    }

    /// The slider is logarithmic: the same distance from 0.1 to 1 ms as from 1 to 10.
    private budgetAt(place: number): Budget {
        const share = place / 1000;
        if (this.status?.budget.mode === "work") {
            const [least, most] = this.workRange;
            return this.work = { mode: "work", units: Math.round(least * (most / least) ** share) };
        }
        const [least, most] = this.scene?.budget_ms ?? [0.1, 33];
        return { mode: "wall", ms: Math.min(most, Math.max(least, Number((least * (most / least) ** share).toPrecision(3)))) };
    }
    /// 0..1000; a budget beyond the slider's stands at its end.
    private placeOf(budget: Budget): number {
        const place = (value: number, least: number, most: number) => (1000 * Math.log(Math.min(most, Math.max(least, value)) / least)) / Math.log(most / least);
        if (budget.mode === "work") return place(budget.units, ...this.workRange);
        return budget.mode === "wall" ? place(budget.ms, ...(this.scene?.budget_ms ?? [0.1, 33])) : 0;
    }
    private get workRange(): [number, number] { return this.scene?.budget_work ?? [10, 1e8]; }
    /// In work as much as the exact stage needs, unless the user chose less.
    private get workBudget(): Budget & { mode: "work" } { return this.work ?? { mode: "work", units: this.status?.work_enough ?? this.workRange[1] }; }
    /// The arrows of a group of radio buttons.
    private chooseMode(event: KeyboardEvent): void {
        const by = event.code === "ArrowRight" || event.code === "ArrowDown" ? 1 : event.code === "ArrowLeft" || event.code === "ArrowUp" ? -1 : 0;
        if (by === 0) return;
        event.preventDefault();
        event.stopPropagation(); // no driving
        const buttons = [...document.querySelectorAll<HTMLButtonElement>("[data-mode]")];
        const next = buttons[(buttons.indexOf(event.target as HTMLButtonElement) + by + buttons.length) % buttons.length];
        next.focus();
        this.setMode(next.dataset.mode as Budget["mode"]);
    }
    private sendBudget(budget: Budget): void { this.send({ type: "budget", ...budget }); }
    private setMode(mode: Budget["mode"]): void {
        this.sendBudget(mode === "wall" ? { mode, ms: Math.min(33, Math.max(0.1, this.wall.ms)) } : mode === "work" ? this.workBudget : { mode: "exact" });
    }
    private nudgeBudget(by: number): void {
        if (this.status === undefined) return;
        if (this.status.budget.mode === "exact") return this.setMode("wall");
        // Keys may come faster than answers: they count from where the slider stands.
        const from = performance.now() < this.dragging ? Number(this.budget.value) : this.placeOf(this.status.budget);
        const place = Math.max(0, Math.min(1000, from + by));
        this.budget.value = String(place);
        this.dragging = performance.now() + 400;
        this.sendBudget(this.budgetAt(place));
    }

    togglePause(): void { this.send({ type: "pause", on: !this.status?.paused }); }
    toggleXray(): void { this.setXray(!this.xray.shown); }
    private singleStep(): void {
        if (this.status && !this.status.paused) this.send({ type: "pause", on: true });
        this.send({ type: "step" });
    }
    private toggleScript(): void { if (this.scene?.has_script) this.send({ type: "script", on: !this.status?.script }); }
    private toggleGrab(): void {
        const on = element("grab").getAttribute("aria-pressed") !== "true";
        element("grab").setAttribute("aria-pressed", String(on));
        dispatchEvent(new CustomEvent("trocar-arm", { detail: on }));
    }
    private restart(): void { this.send({ type: "restart" }); }
    /// From rest, under a budget of work: what is recorded then repeats. With as much as the exact stage needs: it runs as it did live.
    private record(): void {
        const before = this.status?.budget;
        if (before === undefined) return;
        const units = before.mode === "work" ? before.units : this.status!.work_enough;
        if (before.mode === "wall") this.sendBudget({ mode: "work", units });
        for (const { name } of this.scene?.effects ?? []) if (this.status?.effects[name] === false) this.send({ type: "effect", name, on: true });
        this.restart();
        const instead = before.mode === "wall" ? ` instead of ${formatMs(before.ms)}, enough for exact contacts` : "";
        const enough = this.status!.work_enough, short = before.mode === "work" && units < enough;
        const few = short ? `: too few for exact contacts, ${shortNumber(enough)} would do` : "";
        const budget = before.mode === "exact" ? "without a limit" : `under ${shortNumber(units)} tests a step${instead}${few}`;
        this.say("notice", `Recording from the start, ${budget}. Download path takes it away.`);
    }
    private savePicture(): void {
        const name = this.scene?.name ?? "trocar";
        if (this.xray.shown) this.xray.save(name);
        else this.stage.takePicture((picture) => saveAs(picture, `${name}-${(this.status?.time_s ?? 0).toFixed(2)}s.png`));
    }
    private setContacts(on: boolean): void {
        this.stage.showContacts = element<HTMLInputElement>("contacts").checked = on;
        this.stage.touch();
    }
    private setXray(on: boolean): void {
        this.stage.touch();
        this.stage.hidden = on;
        this.xray.toggle(on);
        element<HTMLInputElement>("xray").checked = on;
        document.body.classList.toggle("xray", on);
    }
    private setFollow(on: boolean): void {
        if (this.xray.shown) { // the table, in place of the camera
            if (on) this.xray.toTip(true);
            else this.xray.whole();
            element<HTMLInputElement>("follow").checked = on;
            return;
        }
        if (on) this.stage.frameTip();
        else this.stage.frameAll();
        element<HTMLInputElement>("follow").checked = this.stage.followTip;
    }
    private setSpheres(on: boolean): void {
        this.stage.touch();
        this.stage.showSpheres = on;
        element<HTMLInputElement>("spheres").checked = on;
        this.send({ type: "spheres", on });
    }

    private get screen(): Stage | XrayScreen { return this.xray.shown ? this.xray : this.stage; }
    /// The camera, or the arm. right, up: of the eye, +-1
    private turn(right: number, up: number): void {
        if (this.xray.shown) this.xray.turn(kArmTurn * right, kArmTurn * up);
        else this.stage.turn(kTurn * right, kTurn * up);
    }

    /// True: the key was handled.
    key(event: KeyboardEvent): boolean {
        const acts: Record<string, () => void> = {
            Space: () => this.togglePause(), KeyN: () => this.singleStep(), Period: () => this.singleStep(), KeyR: () => this.restart(),
            KeyX: () => this.toggleXray(), KeyT: () => this.setFollow(!element<HTMLInputElement>("follow").checked), KeyV: () => this.setFollow(false),
            KeyC: () => this.setContacts(!this.stage.showContacts), KeyB: () => this.setSpheres(!this.stage.showSpheres),
            KeyJ: () => this.turn(-1, 0), KeyL: () => this.turn(1, 0), KeyI: () => this.turn(0, 1), KeyK: () => this.turn(0, -1),
            KeyU: () => this.screen.approach(kApproach), KeyO: () => this.screen.approach(1 / kApproach),
            KeyQ: () => this.xray.inject(), KeyM: () => { if (this.xray.shown) this.xray.show("subtraction"); },
            KeyG: () => this.toggleGrab(), KeyP: () => this.toggleScript(), KeyH: () => this.help(),
            Minus: () => this.nudgeBudget(-40), NumpadSubtract: () => this.nudgeBudget(-40),
            Equal: () => this.nudgeBudget(40), NumpadAdd: () => this.nudgeBudget(40), BracketRight: () => this.nudgeBudget(40), Slash: () => this.nudgeBudget(-40),
        };
        const act = acts[event.code];
        if (act === undefined || (event.repeat && !/Minus|Equal|Numpad|Bracket|Slash|Key[NJLIKUO]|Period/.test(event.code))) return act !== undefined;
        act();
        return true;
    }

    setConnection(open: boolean): void {
        this.late = false; // what the pill says now stays
        this.status = undefined;
        const seat = element("seat");
        seat.textContent = open ? "connected" : "connection lost: trying again";
        seat.className = open ? "pill" : "pill bad";
        if (!open) this.say("error", "The connection to trocar is lost; the page tries again. Is the program still running?", "connection");
        else this.unsay("connection");
    }

    setFooter(frameMs: number, pixels: number, latency: number[], gamepad: string): void {
        const parts = [`${(1000 / frameMs).toFixed(0)} pictures a second`];
        if (pixels < 0.99) parts.push(`${(100 * pixels).toFixed(0)} % of the pixels, to keep up`);
        if (latency.length > 0) parts.push(`key to picture ${[...latency].sort((a, b) => a - b)[Math.floor(latency.length / 2)].toFixed(0)} ms`);
        if (this.status && this.status.not_shown > 0) parts.push(`${this.status.not_shown} steps not in the plot`);
        if (this.status && this.status.dots_left_out + this.status.spheres_left_out > 0) parts.push("more contacts or spheres than are drawn");
        if (gamepad) parts.push(`gamepad: ${gamepad.slice(0, 30)}`);
        element("footer").textContent = parts.join(" · ");
    }

    /// id  one message at a time under it, until it is taken back
    say(kind: "error" | "notice", text: string, id = ""): void {
        const box = element("messages");
        for (const line of [...box.children] as HTMLElement[]) if (line.textContent === text || (id && line.dataset.id === id)) line.remove();
        const line = document.createElement("p");
        line.className = kind;
        line.dataset.id = id;
        line.textContent = text;
        box.append(line);
        while (box.children.length > 4) box.firstElementChild!.remove();
        if (!id) setTimeout(() => line.remove(), kMessageTime);
        else if (id === "failure") setTimeout(() => line.remove(), kMessageTime);
    }
    unsay(id: string): void {
        for (const line of [...element("messages").children] as HTMLElement[]) if (line.dataset.id === id) line.remove();
    }
}

function shortNumber(n: number): string {
    return n >= 1e6 ? `${(n / 1e6).toPrecision(3)} M` : n >= 1e3 ? `${(n / 1e3).toPrecision(3)} K` : String(n);
}
