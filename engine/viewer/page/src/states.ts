// States that were saved under a name: a list to go back to one, to take it away as a file, and to forget it.
import type { SavedMark, SceneMessage, Status } from "./protocol";

type Send = (message: Record<string, unknown>) => boolean;
const kLongestName = 48; // bytes, of the server

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

export class States {
    private readonly name = element<HTMLInputElement>("state-name");
    private readonly list = element("states");
    private shown = "";
    private status: Status | undefined;
    private scene: SceneMessage | undefined;

    constructor(private readonly send: Send, private readonly say: (text: string) => void, private readonly token: string) {
        element("state-save").addEventListener("click", () => this.save());
        this.name.addEventListener("keydown", (event) => {
            if (event.code === "Enter" || event.code === "NumpadEnter") this.save();
        });
    }

    setScene(scene: SceneMessage): void { this.scene = scene; }

    setStatus(status: Status): void {
        this.status = status;
        const now = JSON.stringify(status.saved);
        if (now === this.shown) return;
        this.shown = now;
        this.list.replaceChildren(...status.saved.map((mark) => this.row(mark)));
    }

    private row(mark: SavedMark): HTMLElement {
        const row = document.createElement("li"), words = document.createElement("span"), file = document.createElement("a");
        words.textContent = mark.name;
        words.title = `${mark.name}: ${mark.time_s.toFixed(2)} s, step ${mark.step}`;
        const button = (text: string, title: string, act: () => void) => {
            const made = document.createElement("button");
            made.type = "button";
            made.textContent = text;
            made.title = title;
            made.addEventListener("click", act);
            return made;
        };
        file.className = "button";
        file.textContent = "File";
        file.title = "take it away: `trocar run SCENE --resume FILE` goes on from it";
        file.href = `/state.bin?token=${encodeURIComponent(this.token)}&saved=${mark.id}`;
        file.download = "";
        row.append(words, button("Restore", `go back to ${mark.time_s.toFixed(2)} s`, () => {
            if (this.send({ type: "restore", saved: mark.id })) this.say(`Back at “${mark.name}”, ${mark.time_s.toFixed(2)} s.`);
        }), file, button("×", `forget “${mark.name}”`, () => this.send({ type: "forget", saved: mark.id })));
        return row;
    }

    /// Without a name: under the simulated time.
    private save(): void {
        if (this.status === undefined) return;
        const most = this.scene?.most_saved ?? 0, name = fitting(this.name.value.trim() || `${this.status.time_s.toFixed(2)} s`);
        if (this.status.failure) return this.say("The run has stopped: there is nothing to save.");
        if (this.status.saved.length >= most && !this.status.saved.some((mark) => mark.name === name))
            return this.say(`${most} states are kept, and no more: forget one first.`);
        if (this.send({ type: "save", name })) this.name.value = "";
    }
}

function fitting(name: string): string {
    const letters = [...name];
    while (new TextEncoder().encode(letters.join("")).length > kLongestName) letters.pop();
    return letters.join("");
}
