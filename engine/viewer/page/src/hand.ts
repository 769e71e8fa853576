// User input as drive commands: keys, the pad for mouse and touch, a gamepad. The largest one wins.
export interface Wish { insertion: number; rotation: number }

const kKeys: Record<string, Wish> = {
    ArrowUp: { insertion: 1, rotation: 0 }, KeyW: { insertion: 1, rotation: 0 },
    ArrowDown: { insertion: -1, rotation: 0 }, KeyS: { insertion: -1, rotation: 0 },
    ArrowLeft: { insertion: 0, rotation: -1 }, KeyA: { insertion: 0, rotation: -1 },
    ArrowRight: { insertion: 0, rotation: 1 }, KeyD: { insertion: 0, rotation: 1 },
};
const kSlow = 0.25;      // with Shift
const kDeadZone = 0.15;  // of a gamepad's stick
const kHeartbeat = 150;  // ms: the server ends a drive command that is not repeated

export class Hand {
    private readonly held = new Set<string>();
    private slow = false;
    private padWish: Wish = { insertion: 0, rotation: 0 };
    private sent: Wish = { insertion: 0, rotation: 0 };
    private sentAt = 0;
    gamepadName = "";
    onGamepadButton: (button: number) => void = () => {};
    private buttons = 0;
    private place = ""; // of the knob
    private wish: Wish = { insertion: 0, rotation: 0 };
    blind = false; // the user sees no picture: drive commands stop

    constructor(private readonly pad: HTMLElement, private readonly knob: HTMLElement, private readonly send: (wish: Wish) => boolean,
                private readonly onStart: () => void) {
        addEventListener("keydown", (event) => this.key(event, true));
        addEventListener("keyup", (event) => this.key(event, false));
        addEventListener("blur", () => this.release());
        document.addEventListener("visibilitychange", () => this.release());
        setInterval(() => this.poll(performance.now()), kHeartbeat / 2); // pictures may be slow, or rest
        const move = (event: PointerEvent) => {
            const box = pad.getBoundingClientRect();
            const clamp = (value: number) => Math.max(-1, Math.min(1, value));
            this.padWish = {
                insertion: clamp((box.top + box.height / 2 - event.clientY) / (0.4 * box.height)),
                rotation: clamp((event.clientX - box.left - box.width / 2) / (0.4 * box.width)),
            };
            for (const axis of ["insertion", "rotation"] as const) if (Math.abs(this.padWish[axis]) < kDeadZone) this.padWish[axis] = 0;
        };
        pad.addEventListener("pointerdown", (event) => {
            pad.setPointerCapture(event.pointerId);
            move(event);
            this.onStart();
            event.preventDefault();
        });
        pad.addEventListener("pointermove", (event) => { if (pad.hasPointerCapture(event.pointerId)) move(event); });
        for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const)
            pad.addEventListener(end, () => {
                this.padWish = { insertion: 0, rotation: 0 };
                this.poll(performance.now());
            });
    }

    release(): void {
        this.held.clear();
        this.padWish = { insertion: 0, rotation: 0 };
        this.poll(performance.now());
    }

    private key(event: KeyboardEvent, down: boolean): void {
        this.slow = event.shiftKey;
        if (!(event.code in kKeys)) return;
        if (!down) {
            this.held.delete(event.code);
            this.poll(performance.now());
            return;
        }
        if (event.ctrlKey || event.altKey || event.metaKey || hasItsOwn(event)) return;
        event.preventDefault();
        if (!event.repeat) {
            this.held.add(event.code);
            this.onStart();
            this.poll(performance.now()); // at once, not with the next picture
        }
    }

    private gamepad(): Wish {
        const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected);
        this.gamepadName = pad?.id ?? "";
        if (!pad) return { insertion: 0, rotation: 0 };
        const axis = (k: number) => { const value = pad.axes[k] ?? 0; return Math.abs(value) < kDeadZone ? 0 : value; };
        pad.buttons.forEach((button, k) => {
            const bit = 1 << k;
            if (button.pressed && (this.buttons & bit) === 0) this.onGamepadButton(k);
            this.buttons = button.pressed ? this.buttons | bit : this.buttons & ~bit;
        });
        const up = (pad.buttons[12]?.pressed ? 1 : 0) - (pad.buttons[13]?.pressed ? 1 : 0);
        const right = (pad.buttons[15]?.pressed ? 1 : 0) - (pad.buttons[14]?.pressed ? 1 : 0);
        const wish = { insertion: up || -axis(1), rotation: right || axis(2) || axis(0) };
        if ((wish.insertion !== 0 || wish.rotation !== 0) && this.sent.insertion === 0 && this.sent.rotation === 0) this.onStart();
        return wish;
    }

    /// Sends changes, and repeats a held input now and then, so that the server does not end it.
    poll(now: number): void {
        const wish = { insertion: 0, rotation: 0 };
        const add = (part: Wish, share: number) => {
            wish.insertion += share * part.insertion;
            wish.rotation += share * part.rotation;
        };
        for (const code of this.held) add(kKeys[code], this.slow ? kSlow : 1);
        add(this.padWish, 1);
        add(this.gamepad(), 1);
        if (this.blind) wish.insertion = wish.rotation = 0;
        wish.insertion = Math.round(100 * Math.max(-1, Math.min(1, wish.insertion))) / 100;
        wish.rotation = Math.round(100 * Math.max(-1, Math.min(1, wish.rotation))) / 100;
        const changed = wish.insertion !== this.sent.insertion || wish.rotation !== this.sent.rotation;
        const moving = wish.insertion !== 0 || wish.rotation !== 0;
        if ((changed || (moving && now - this.sentAt > kHeartbeat)) && this.send(wish)) {
            this.sent = wish;
            this.sentAt = now;
        }
        this.wish = wish;
    }
    /// Shows the knob at the current input: a change of the page, for its next update.
    showKnob(): void {
        const way = this.pad.clientWidth / 4;
        const place = `translate(${this.wish.rotation * way}px, ${-this.wish.insertion * way}px)`;
        if (this.place !== place) this.knob.style.transform = this.place = place;
    }
    forget(): void { this.sent = { insertion: 0, rotation: 0 }; }
}

export const isDriven = (code: string): boolean => code in kKeys;

/// The key belongs to what has the focus: a slider's arrows, a box's Space, all of a field for text. Everything else drives.
export function hasItsOwn({ target, code }: KeyboardEvent): boolean {
    if (target instanceof HTMLInputElement && target.type === "range") return /^(Arrow|Home|End|Page)/.test(code);
    if (target instanceof HTMLInputElement && target.type === "checkbox") return code === "Space";
    if (target instanceof HTMLButtonElement) return code === "Enter";
    return target instanceof HTMLInputElement || target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement;
}
