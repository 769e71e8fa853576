// Which side of the patient is where: a cube with a letter on each face, and the letters of its sides around it. A letter looks from that side.
// World: RAS, as docs/fluoroscopy.md draws it.
import * as THREE from "three";

export type Direction = [number, number, number];
/// Unit vectors of a picture, in the world.
export interface Axes { right: Direction; up: Direction; toward: Direction } // toward: from what is seen to the eye

interface Side { letter: string; name: string; way: Direction; up: Direction } // up: of the letter on its face
const kSides: Side[] = [
    { letter: "R", name: "the patient's right", way: [1, 0, 0], up: [0, 0, 1] },
    { letter: "L", name: "the patient's left", way: [-1, 0, 0], up: [0, 0, 1] },
    { letter: "A", name: "the front (anterior)", way: [0, 1, 0], up: [0, 0, 1] },
    { letter: "P", name: "the back (posterior)", way: [0, -1, 0], up: [0, 0, 1] },
    { letter: "H", name: "the head", way: [0, 0, 1], up: [0, -1, 0] },
    { letter: "F", name: "the feet", way: [0, 0, -1], up: [0, 1, 0] },
];
const kHalf = 17;        // pixels, of the cube's edge
const kReach = 38;       // pixels, of the letters around it
const kFacing = 0.3;     // letters of sides that face the eye, or away from it, more than that are the cube's alone
const kSecondLetter = 0.35; // least share of a direction that gets a second letter

const dot = (a: Direction, b: Direction): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Direction, b: Direction): Direction => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

export function axesOfCamera(camera: THREE.Camera): Axes {
    const of = (column: number): Direction => new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, column).normalize().toArray();
    return { right: of(0), up: of(1), toward: of(2) };
}

/// Of a C-arm's picture (engine/fluoroscopy/cone_beam.cpp); rad.
export function axesOfArm(primary: number, secondary: number): Axes {
    const [sp, cp, ss, cs] = [Math.sin(primary), Math.cos(primary), Math.sin(secondary), Math.cos(secondary)];
    return { right: [-cp, -sp, 0], up: [ss * sp, -ss * cp, cs], toward: [-cs * sp, cs * cp, ss] };
}

/// The letters of a direction, as DICOM names a picture's edges: the nearest side, then a second one where the direction leans to it.
export function lettersOf(way: Direction): string {
    const shares = kSides.map((side) => ({ letter: side.letter, share: dot(side.way, way) })).sort((a, b) => (Math.abs(b.share - a.share) < 1e-4 ? 0 : b.share - a.share));
    return shares.filter(({ share }, k) => k === 0 || (k === 1 && share > kSecondLetter)).map(({ letter }) => letter).join("");
}

/// A face as it is seen: the six numbers of a two-dimensional transformation, and how much it faces the eye.
function faceOf(side: Side, axes: Axes, half: number): { matrix: [number, number, number, number, number, number]; facing: number } {
    const across = cross(side.up, side.way), down = side.up.map((x) => -x) as Direction;
    const x = (v: Direction) => dot(axes.right, v), y = (v: Direction) => -dot(axes.up, v);
    return { matrix: [x(across), y(across), x(down), y(down), half * x(side.way), half * y(side.way)], facing: dot(axes.toward, side.way) };
}

const shadeOf = (facing: number): string => `hsl(207 34% ${(20 + 26 * facing).toFixed(0)}%)`;

/// The same for a picture that is saved. x, y: of the cube's middle; scale: of the size on the page
export function drawOrientation(pen: CanvasRenderingContext2D, axes: Axes, x: number, y: number, scale: number): void {
    pen.save();
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    for (const side of kSides) {
        const { matrix, facing } = faceOf(side, axes, kHalf);
        if (facing > 0.02) {
            pen.setTransform(scale, 0, 0, scale, x, y);
            pen.transform(...matrix);
            pen.fillStyle = shadeOf(facing);
            pen.strokeStyle = "#e8eef7";
            pen.lineWidth = 1;
            pen.fillRect(-kHalf, -kHalf, 2 * kHalf, 2 * kHalf);
            pen.strokeRect(-kHalf, -kHalf, 2 * kHalf, 2 * kHalf);
            pen.fillStyle = "#ffffff";
            pen.font = "650 20px system-ui, sans-serif";
            pen.fillText(side.letter, 0, 1);
        }
        if (Math.abs(facing) > kFacing) continue;
        pen.setTransform(scale, 0, 0, scale, x, y);
        pen.fillStyle = "#e8eef7";
        pen.font = "650 13px system-ui, sans-serif";
        pen.strokeStyle = "#10161f";
        pen.lineWidth = 3;
        const [at, down] = [kReach * dot(axes.right, side.way), -kReach * dot(axes.up, side.way)];
        pen.strokeText(side.letter, at, down);
        pen.fillText(side.letter, at, down);
    }
    pen.restore();
}

export class Orientation {
    private readonly buttons: { side: Side; face: HTMLButtonElement; letter: HTMLButtonElement }[];
    private readonly box = document.createElement("div");
    private seen = "";

    constructor(look: (from: Direction) => void) {
        this.box.id = "orientation";
        this.box.setAttribute("role", "group");
        this.box.setAttribute("aria-label", "Sides of the patient");
        this.buttons = kSides.map((side) => {
            const make = (kind: string) => {
                const button = document.createElement("button");
                button.type = "button";
                button.className = kind;
                button.textContent = side.letter;
                button.title = `look from ${side.name}`;
                button.addEventListener("click", () => look(side.way));
                this.box.append(button);
                return button;
            };
            return { side, face: make("face"), letter: make("letter") };
        });
        document.body.append(this.box);
    }

    update(axes: Axes): void {
        const seen = [axes.right, axes.up].flat().map((x) => x.toFixed(3)).join();
        if (seen === this.seen) return;
        this.seen = seen;
        for (const { side, face, letter } of this.buttons) {
            const { matrix, facing } = faceOf(side, axes, kHalf);
            face.hidden = facing <= 0.02;
            face.style.transform = `matrix(${matrix.map((x) => x.toFixed(4)).join()})`;
            face.style.background = shadeOf(facing);
            letter.hidden = Math.abs(facing) > kFacing;
            letter.style.transform = `translate(${(kReach * dot(axes.right, side.way)).toFixed(1)}px, ${(-kReach * dot(axes.up, side.way)).toFixed(1)}px)`;
            letter.style.opacity = (0.6 + 0.4 * facing).toFixed(2);
        }
    }
}
