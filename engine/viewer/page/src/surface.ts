// Dense surfaces: geometry that follows the frames, and how it looks.
import * as THREE from "three";
import type { Part } from "./protocol";

export interface Look {
    colour: number;
    opacity: number;      // seen face-on; edges are denser, as those of a thin shell
}
export const kLooks: Record<Part["kind"], Look> = {
    vessel: { colour: 0xe2483d, opacity: 0.3 },
    organ: { colour: 0xc9806a, opacity: 0.2 },
    rigid: { colour: 0xaab4c4, opacity: 1.0 },
    space: { colour: 0x000000, opacity: 0.0 }, // it has no triangles
    instrument: { colour: 0x63c7ff, opacity: 1.0 },
};

const kVertex = /* glsl */ `
    varying vec3 vNormal;
    varying vec3 vView;
    void main() {
        vec4 view = modelViewMatrix * vec4(position, 1.0);
        vNormal = normalMatrix * normal;
        vView = -view.xyz;
        gl_Position = projectionMatrix * view;
    }`;
const kFragment = /* glsl */ `
    uniform vec3 colour;
    uniform float opacity;
    varying vec3 vNormal;
    varying vec3 vView;
    void main() {
        vec3 n = normalize(vNormal);
        vec3 v = normalize(vView);
        float facing = abs(dot(n, v));
        if (dot(n, v) < 0.0) n = -n;
        float key = 0.5 + 0.5 * dot(n, normalize(vec3(0.35, 0.75, 0.6)));
        float fill = max(dot(n, normalize(vec3(-0.7, -0.1, 0.5))), 0.0);
        float gloss = pow(max(dot(n, normalize(v + normalize(vec3(0.3, 0.7, 0.7)))), 0.0), 42.0);
        float rim = pow(1.0 - facing, 3.0);
        vec3 shaded = colour * (0.24 + 0.78 * key + 0.16 * fill) + vec3(0.30) * gloss + colour * 0.55 * rim;
        float alpha = opacity >= 1.0 ? 1.0 : 1.0 - pow(1.0 - opacity, 1.0 / max(facing, 0.16));
        gl_FragColor = vec4(shaded, min(alpha + 0.25 * gloss * step(opacity, 0.99), 1.0));
        #include <colorspace_fragment>
    }`;
function shadedMaterial(look: Look, side: THREE.Side): THREE.ShaderMaterial {
    return new THREE.ShaderMaterial({
        vertexShader: kVertex, fragmentShader: kFragment, side, transparent: look.opacity < 1, depthWrite: look.opacity >= 1,
        uniforms: { colour: { value: new THREE.Color(look.colour) }, opacity: { value: look.opacity } },
    });
}

/// Smooth normals, each corner weighted by its triangle's area.
function updateNormals(position: Float32Array, corners: Uint32Array, normal: Float32Array): void {
    normal.fill(0);
    for (let t = 0; t < corners.length; t += 3) {
        const a = 3 * corners[t], b = 3 * corners[t + 1], c = 3 * corners[t + 2];
        const ux = position[b] - position[a], uy = position[b + 1] - position[a + 1], uz = position[b + 2] - position[a + 2];
        const vx = position[c] - position[a], vy = position[c + 1] - position[a + 1], vz = position[c + 2] - position[a + 2];
        const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        normal[a] += nx; normal[a + 1] += ny; normal[a + 2] += nz;
        normal[b] += nx; normal[b + 1] += ny; normal[b + 2] += nz;
        normal[c] += nx; normal[c + 1] += ny; normal[c + 2] += nz;
    }
}

/// Fewer triangles on some of a surface's vertices, those numbered anew.
class FarSide {
    readonly vertices: Uint32Array; // of the whole surface
    readonly corners: Uint32Array;
    constructor(far: Uint32Array) {
        this.vertices = Uint32Array.from(new Set(far)).sort();
        const number = new Map(Array.from(this.vertices, (vertex, k) => [vertex, k]));
        this.corners = far.map((vertex) => number.get(vertex)!);
    }
    gather(from: Float32Array, to: Float32Array): void {
        this.vertices.forEach((vertex, k) => {
            to[3 * k] = from[3 * vertex]; to[3 * k + 1] = from[3 * vertex + 1]; to[3 * k + 2] = from[3 * vertex + 2];
        });
    }
}

function setAttribute(geometry: THREE.BufferGeometry, name: string, values: Float32Array): void {
    const attribute = geometry.getAttribute(name) as THREE.BufferAttribute | undefined;
    if (attribute?.array.length !== values.length) {
        geometry.setAttribute(name, new THREE.BufferAttribute(values, 3).setUsage(THREE.DynamicDrawUsage));
        return;
    }
    attribute.array = values;
    attribute.needsUpdate = true;
}

export class Surface {
    readonly whole = new THREE.BufferGeometry(); // every triangle; not on the card where it is drawn from afar
    private afar: { side: FarSide; geometry: THREE.BufferGeometry; position: Float32Array; normal: Float32Array } | undefined;
    private simple = false;
    private position: Float32Array | undefined;
    private moved = false; // since it was last followed
    private normal = new Float32Array(0);
    readonly shaded = new THREE.Group();
    readonly pick: THREE.Mesh; // for rays alone
    private readonly materials: THREE.ShaderMaterial[] = [];
    private corners: Uint32Array | undefined;

    constructor(readonly part: Part, order: number) {
        const look = kLooks[part.kind];
        // Of a transparent shell first the far side, then the near one; inner shells before outer ones.
        const sides: THREE.Side[] = look.opacity < 1 ? [THREE.BackSide, THREE.FrontSide] : [THREE.DoubleSide];
        sides.forEach((side, k) => {
            const material = shadedMaterial(look, side);
            const mesh = new THREE.Mesh(this.whole, material);
            mesh.renderOrder = look.opacity < 1 ? 10 + 2 * order + (side === THREE.FrontSide ? 20 : 0) + k : 0;
            mesh.frustumCulled = false;
            this.materials.push(material);
            this.shaded.add(mesh);
        });
        this.pick = new THREE.Mesh(this.whole, new THREE.MeshBasicMaterial({ side: THREE.DoubleSide }));
    }

    setCorners(corners: Uint32Array, far: Uint32Array): void {
        this.corners = corners;
        this.whole.setIndex(new THREE.BufferAttribute(corners, 1));
        this.afar?.geometry.dispose();
        this.afar = undefined;
        if (far.length > 0) {
            const side = new FarSide(far), size = 3 * side.vertices.length, geometry = new THREE.BufferGeometry();
            geometry.setIndex(new THREE.BufferAttribute(side.corners, 1));
            this.afar = { side, geometry, position: new Float32Array(size), normal: new Float32Array(size) };
        }
        this.choose();
    }

    /// Which triangles are drawn.
    private choose(): void {
        const geometry = this.simple && this.afar !== undefined ? this.afar.geometry : this.whole;
        for (const mesh of this.shaded.children) (mesh as THREE.Mesh).geometry = geometry;
        this.moved = true;
    }

    setPositions(position: Float32Array): void {
        this.position = position;
        setAttribute(this.whole, "position", position);
        this.whole.boundingSphere = null;
        this.moved = true;
    }

    /// What is drawn goes where the surface is.
    follow(): void {
        if (!this.moved || this.corners === undefined || this.position === undefined) return;
        this.moved = false;
        if (this.simple && this.afar !== undefined) {
            const { side, geometry, position, normal } = this.afar;
            side.gather(this.position, position);
            updateNormals(position, side.corners, normal);
            setAttribute(geometry, "position", position);
            setAttribute(geometry, "normal", normal);
            return;
        }
        if (this.normal.length !== this.position.length) this.normal = new Float32Array(this.position.length);
        updateNormals(this.position, this.corners, this.normal);
        setAttribute(this.whole, "normal", this.normal);
    }

    /// share  of the usual opacity, up to opaque
    setOpacity(share: number): void {
        for (const material of this.materials) material.uniforms.opacity.value = Math.min(kLooks[this.part.kind].opacity * share, 0.97);
    }
    /// Simple: the near side of a shell alone, and fewer triangles where there are such.
    setSimple(simple: boolean): void {
        this.shaded.children.forEach((mesh, k) => { mesh.visible = !simple || k === this.shaded.children.length - 1; });
        if (simple === this.simple) return;
        this.simple = simple;
        this.choose();
    }

    dispose(): void {
        this.whole.dispose();
        this.afar?.geometry.dispose();
        for (const material of this.materials) material.dispose();
    }
}
