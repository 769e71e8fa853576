// Tissue pulled with the mouse: Shift and drag, or the button first. The point moves in the plane of the screen.
import * as THREE from "three";
import type { Picked, Stage } from "./stage";

export class Puller {
    private held: Picked | undefined;
    private readonly plane = new THREE.Plane();
    private target = new THREE.Vector3();
    private armed = false;
    private due = false;

    constructor(private readonly stage: Stage, private readonly canvas: HTMLElement,
                private readonly send: (message: Record<string, unknown>) => boolean, private readonly tell: (text: string) => void) {
        canvas.addEventListener("pointerdown", (event) => this.begin(event), { capture: true });
        canvas.addEventListener("pointermove", (event) => this.move(event));
        for (const end of ["pointerup", "pointercancel"] as const) canvas.addEventListener(end, () => this.end());
        addEventListener("trocar-arm", (event) => {
            this.armed = (event as CustomEvent<boolean>).detail;
            canvas.classList.toggle("pulling", this.armed);
        });
    }

    forget(): void {
        this.held = undefined;
        this.stage.showPull(undefined);
        this.stage.controls.enabled = true;
    }

    private begin(event: PointerEvent): void {
        if (event.button !== 0 || !(event.shiftKey || this.armed)) return;
        this.held = this.stage.pick(event.clientX, event.clientY);
        if (this.held === undefined) {
            this.tell("There is no tissue under the pointer that could be pulled.");
            return;
        }
        this.stage.controls.enabled = false;
        this.canvas.setPointerCapture(event.pointerId);
        this.plane.setFromNormalAndCoplanarPoint(this.stage.camera.getWorldDirection(new THREE.Vector3()), this.held.point);
        this.target.copy(this.held.point);
        this.due = true;
    }

    private move(event: PointerEvent): void {
        if (this.held === undefined) return;
        if (this.stage.rayAt(event.clientX, event.clientY).ray.intersectPlane(this.plane, this.target)) this.due = true;
    }

    private end(): void {
        if (this.held === undefined) return;
        this.send({ type: "let_go" });
        this.forget();
    }

    /// While no frames come: what the pointer asks for is sent nevertheless.
    followPointer(): void { if (this.due) this.follow(); }

    /// With every frame: the line, and the target where it has moved.
    follow(): void {
        if (this.held === undefined) return;
        this.stage.showPull(this.stage.vertex(this.held.body, this.held.vertex), this.target);
        if (!this.due) return;
        this.due = false;
        if (!this.send({ type: "grab", body: this.held.body, vertex: this.held.vertex, target: this.target.toArray() })) this.forget();
    }
}
