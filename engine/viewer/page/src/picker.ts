// Places that are picked by a click on the vessel's wall, and the scene that is saved with them.
import type { Picks, SavedScene, SceneMessage } from "./protocol";
import type { Stage } from "./stage";

/// id  one message at a time under it, until it is taken back
export interface Teller { say(text: string, id?: string): void; unsay(id: string): void }
type Send = (message: Record<string, unknown>) => boolean;
type What = "target" | "entry";

const kStill = 4; // pixels that a click may move; more is a drag

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

export class Picker {
    private what: What | undefined; // that the next click picks
    private pressed: { x: number; y: number } | undefined;
    private scene: SceneMessage | undefined;
    private picks: Picks | undefined;

    constructor(private readonly stage: Stage, canvas: HTMLElement, private readonly send: Send, private readonly teller: Teller) {
        for (const what of ["target", "entry"] as const) element(`pick-${what}`).addEventListener("click", () => this.arm(this.what === what ? undefined : what));
        element("unpick").addEventListener("click", () => this.send({ type: "unpick" }));
        element("scene-save").addEventListener("click", () => this.save());
        for (const id of ["picked-name", "scene-file"])
            element(id).addEventListener("keydown", (event) => {
                if (/Enter$/.test(event.code)) this.save();
            });
        canvas.addEventListener("pointerdown", ({ button, clientX: x, clientY: y }) => { this.pressed = button === 0 ? { x, y } : undefined; });
        canvas.addEventListener("pointerup", (event) => this.click(event));
        const check = (id: string, act: (on: boolean) => void) => element<HTMLInputElement>(id).addEventListener("change", (event) => act((event.target as HTMLInputElement).checked));
        check("centreline", (on) => this.stage.showCentreline(on));
        check("marks", (on) => this.stage.showMarks(on));
        const name = element("mark-name");
        canvas.addEventListener("pointermove", ({ clientX, clientY, buttons }) => {
            const text = buttons === 0 ? this.stage.nameAt(clientX, clientY) : undefined;
            name.hidden = text === undefined;
            if (text === undefined) return;
            name.textContent = text;
            name.style.transform = `translate(${clientX + 14}px, ${clientY + 10}px)`;
        });
        canvas.addEventListener("pointerleave", () => { name.hidden = true; });
    }

    setScene(scene: SceneMessage): void {
        this.scene = scene;
        element("picking").hidden = scene.vessel === null;
        this.arm(undefined);
    }

    setPicks(picks: Picks): void {
        this.picks = picks;
        const radius = (mark: { radius: number } | null) => (mark === null ? "–" : `radius ${(1e3 * mark.radius).toFixed(2)} mm`);
        element("picked-target").textContent = radius(picks.target);
        element("picked-entry").textContent = radius(picks.entry);
        this.stage.setPicks(picks);
    }

    setSaved(saved: SavedScene): void {
        element("saved-scene").hidden = false;
        element("saved-command").textContent = saved.command;
        this.teller.unsay("save");
        for (const text of [`Saved ${saved.file}.`, ...saved.notices]) this.teller.say(text);
    }

    /// What was asked for was refused.
    refuse(): void { this.teller.unsay("save"); }

    /// No click picks any more.
    disarm(): void { this.arm(undefined); }

    private arm(what: What | undefined): void {
        this.what = what;
        for (const each of ["target", "entry"] as const) element(`pick-${each}`).setAttribute("aria-pressed", String(each === what));
        element("view").classList.toggle("picking", what !== undefined);
        if (what === undefined) return this.teller.unsay("pick");
        this.teller.say(what === "target" ? "Click on the vessel where the tip is to go." : "Click on the vessel where the instrument is to enter, as at an open end.", "pick");
    }

    private click(event: PointerEvent): void {
        const { what, pressed, scene } = this;
        this.pressed = undefined;
        if (what === undefined || pressed === undefined || scene?.vessel == null || event.shiftKey) return;
        if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > kStill) return;
        const hit = this.stage.pickWall(event.clientX, event.clientY, scene.vessel.part);
        if (hit === undefined) return this.teller.say(`There is no vessel under the pointer: a click on ${scene.parts[scene.vessel.part].name} picks.`);
        this.send({ type: "pick", what, body: scene.vessel.part, ...hit });
    }

    private save(): void {
        if (!this.picks?.target && !this.picks?.entry) return this.teller.say("Nothing is picked yet: there is nothing to save.");
        const target = element<HTMLInputElement>("picked-name").value.trim() || "picked", name = element<HTMLInputElement>("scene-file").value.trim();
        const asked = name === "" ? { type: "save_scene", target } : { type: "save_scene_as", target, name };
        if (this.send(asked)) this.teller.say("The scene with the picks is checked and its way planned; then it is saved.", "save");
    }
}
