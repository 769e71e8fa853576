// Places of the vessel: its centreline, marks with names at entry, targets and picks. They go with the vessel's surface.
import * as THREE from "three";
import type { Centreline, EntryMark, Mark, PartShape, Picks, SceneMessage } from "./protocol";

const kColours = { target: "#ffb020", entry: "#4ade80", pickedTarget: "#f0abfc", pickedEntry: "#67e8f9" };
const kArrow = 0.012;   // m, of the arrow at an entry
const kNear = 16;       // pixels from a mark: its name is shown

const ringTextures = new Map<string, THREE.Texture>(); // by colour

function ringTexture(colour: string): THREE.Texture {
    const known = ringTextures.get(colour);
    if (known !== undefined) return known;
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 64;
    const pen = canvas.getContext("2d")!;
    pen.lineWidth = 5;
    pen.strokeStyle = pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(32, 32, 20, 0, 2 * Math.PI);
    pen.stroke();
    pen.beginPath();
    pen.arc(32, 32, 5, 0, 2 * Math.PI);
    pen.fill();
    const texture = new THREE.CanvasTexture(canvas);
    ringTextures.set(colour, texture);
    return texture;
}

/// A ring round a place, as large however far away it is.
function makeRing(colour: string): THREE.Sprite {
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: ringTexture(colour), depthTest: false, sizeAttenuation: false }));
    sprite.scale.setScalar(0.03);
    sprite.renderOrder = 65;
    return sprite;
}

function makeArrow(direction: THREE.Vector3, colour: string): THREE.ArrowHelper {
    const arrow = new THREE.ArrowHelper(direction, new THREE.Vector3(), kArrow, colour, 0.35 * kArrow, 0.2 * kArrow);
    for (const part of [arrow.line, arrow.cone]) {
        (part.material as THREE.Material).depthTest = false;
        part.renderOrder = 65;
        part.frustumCulled = false;
    }
    return arrow;
}

class Marked {
    readonly group = new THREE.Group();
    constructor(readonly mark: Mark, readonly name: string, colour: string, direction?: [number, number, number]) {
        this.group.add(makeRing(colour));
        if (direction !== undefined) this.group.add(makeArrow(new THREE.Vector3(...direction), colour));
        this.group.position.set(...mark.position);
    }
    follow(shapes: PartShape[]): void {
        const { part, vertex, offset } = this.mark, shape = part === null ? undefined : shapes[part];
        if (shape === undefined || vertex === undefined || offset === undefined) return;
        this.group.position.fromArray(shape.position, 3 * vertex).add(new THREE.Vector3(...offset));
    }
}

/// A line from each point of the centreline to the one that it follows.
class CentrelineLines {
    readonly lines: THREE.LineSegments;
    private readonly position: Float32Array;

    constructor(private readonly centreline: Centreline, private readonly part: number) {
        this.position = Float32Array.from(centreline.points);
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.BufferAttribute(this.position, 3));
        geometry.setIndex(centreline.parents.flatMap((parent, k) => (parent < 0 ? [] : [parent, k])));
        this.lines = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0xd9f99d, depthTest: false, transparent: true, opacity: 0.75 }));
        this.lines.renderOrder = 58;
        this.lines.frustumCulled = false;
    }
    follow(shapes: PartShape[]): void {
        const { vertices, offsets } = this.centreline, shape = shapes[this.part];
        if (vertices === null || offsets === null || shape === undefined) return; // it stands still
        vertices.forEach((vertex, k) => {
            for (let axis = 0; axis < 3; ++axis) this.position[3 * k + axis] = shape.position[3 * vertex + axis] + offsets[3 * k + axis];
        });
        this.lines.geometry.getAttribute("position").needsUpdate = true;
    }
}

export class Places {
    readonly group = new THREE.Group();
    private readonly marks = new THREE.Group();
    private scene: Marked[] = [];
    private picked: Marked[] = [];
    private centreline: CentrelineLines | undefined;
    private shapes: PartShape[] = [];
    private showsCentreline = true;

    constructor() { this.group.add(this.marks); }

    setScene(message: SceneMessage): void {
        if (this.centreline !== undefined) this.group.remove(this.centreline.lines);
        const vessel = message.vessel;
        this.centreline = vessel === null ? undefined : new CentrelineLines(vessel.centreline, vessel.part);
        if (this.centreline !== undefined) this.group.add(this.centreline.lines);
        this.showCentreline(this.showsCentreline);
        this.scene = message.targets.map((target) => new Marked(target, target.name, kColours.target));
        if (vessel !== null) this.scene.push(entryMark(vessel.entry, vessel.entry.name, kColours.entry));
        this.setPicks({ target: null, entry: null });
    }

    setPicks({ target, entry }: Pick<Picks, "target" | "entry">): void {
        this.picked = [];
        if (target !== null) this.picked.push(new Marked(target, target.name, kColours.pickedTarget));
        if (entry !== null) this.picked.push(entryMark(entry, entry.name, kColours.pickedEntry));
        this.marks.clear();
        for (const marked of [...this.scene, ...this.picked]) this.marks.add(marked.group);
        this.follow(this.shapes);
    }

    /// Where the vessel is in a frame.
    follow(shapes: PartShape[]): void {
        this.shapes = shapes;
        for (const marked of [...this.scene, ...this.picked]) marked.follow(shapes);
        if (this.showsCentreline) this.centreline?.follow(shapes);
    }

    showCentreline(on: boolean): void {
        this.showsCentreline = on;
        if (this.centreline !== undefined) this.centreline.lines.visible = on;
        if (on) this.centreline?.follow(this.shapes);
    }
    showMarks(on: boolean): void { this.marks.visible = on; }

    /// Name of the mark at a place of the page; undefined: there is none.
    nameAt(x: number, y: number, project: (place: THREE.Vector3) => [number, number]): string | undefined {
        if (!this.marks.visible) return undefined;
        let near = kNear, name: string | undefined;
        for (const marked of [...this.scene, ...this.picked]) {
            const [u, v] = project(marked.group.position), away = Math.hypot(u - x, v - y);
            if (away <= near) [near, name] = [away, marked.name];
        }
        return name;
    }
}

function entryMark(entry: EntryMark, name: string, colour: string): Marked { return new Marked(entry, name, colour, entry.direction); }
