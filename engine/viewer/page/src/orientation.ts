// Which side of the patient is where: a small cross of the six letters, that turns with the camera. A letter looks from that side.
// World: RAS, as docs/fluoroscopy.md draws it.
import * as THREE from "three";

const kSides: [string, string, [number, number, number]][] = [
    ["R", "the patient's right", [1, 0, 0]], ["L", "the patient's left", [-1, 0, 0]],
    ["A", "the front (anterior)", [0, 1, 0]], ["P", "the back (posterior)", [0, -1, 0]],
    ["H", "the head", [0, 0, 1]], ["F", "the feet", [0, 0, -1]],
];
const kReach = 30; // pixels

export class Orientation {
    private readonly letters: { button: HTMLButtonElement; side: THREE.Vector3 }[];
    private readonly cross = document.createElement("div");

    constructor(look: (from: THREE.Vector3) => void) {
        this.cross.id = "orientation";
        this.cross.setAttribute("role", "group");
        this.cross.setAttribute("aria-label", "Sides of the patient");
        this.letters = kSides.map(([letter, name, way]) => {
            const side = new THREE.Vector3(...way);
            const button = document.createElement("button");
            button.type = "button";
            button.textContent = letter;
            button.title = `look from ${name}`;
            button.addEventListener("click", () => look(side));
            this.cross.append(button);
            return { button, side };
        });
        document.body.append(this.cross);
    }

    update(camera: THREE.Camera): void {
        const turn = new THREE.Quaternion();
        camera.getWorldQuaternion(turn).invert();
        for (const { button, side } of this.letters) {
            const seen = side.clone().applyQuaternion(turn); // x right, y up, z towards the eye
            button.style.transform = `translate(${(kReach * seen.x).toFixed(1)}px, ${(-kReach * seen.y).toFixed(1)}px)`;
            button.style.opacity = (0.55 + 0.45 * seen.z).toFixed(2);
            button.style.zIndex = seen.z > 0 ? "1" : "0";
        }
    }
}
