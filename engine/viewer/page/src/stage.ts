// The picture: surfaces, catheter, contacts, spheres, targets, camera.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { Backdrop } from "./backdrop";
import { axesOfCamera, drawOrientation, type Axes, type Direction } from "./orientation";
import { drawScale } from "./scale";
import { makeDots, setDots } from "./marks";
import { Places } from "./places";
import { Surface } from "./surface";
import type { Frame, Model, PartShape, Picks, SceneMessage, View } from "./protocol";

const kSphereColours = [0x4ade80, 0xf87171, 0xfbbf24].map((hex) => new THREE.Color(hex));
const kSlowDraw = 24;           // ms of drawing; slower pictures are drawn more simply, then with fewer pixels
const kQuickDraw = 10;          // quicker ones get more of them: 1.2 times a side, 1.44 times the work
const kSimpleDraw = 4;          // ms; quick enough for everything again
const kProbeEvery = 8;          // pictures; only then the page waits for the drawing to end
const kRest = 3;                // in software from one picture to the next, times of drawing one: queued ones would delay input
const kLongestRest = 60;        // ms
const kThinnestLine = 2;        // of the pixels that are drawn; a thinner one has gaps
const kTail = 0.035;            // m around the tip in the tip's view
const kMargin = 1.12;           // of the whole view, times what it shows

export interface Picked { body: number; vertex: number; point: THREE.Vector3 }
/// A point of a surface: weights of the triangle's corners.
export interface WallHit { triangle: number; weights: [number, number, number] }

export class Stage {
    readonly renderer: THREE.WebGLRenderer;
    readonly camera = new THREE.PerspectiveCamera(32, 1, 0.002, 10);
    readonly controls: OrbitControls;
    hidden = false;             // another screen is shown: nothing is drawn
    followTip = false;
    showContacts = true;
    showSpheres = false;
    frameMs = 16;               // time between pictures, smoothed
    readonly software: boolean; // drawn on the CPU
    drawMs = 10;                // smoothed
    triangles = 0;              // of the last picture
    private pixelShare = 1;
    private readonly fixed: boolean;
    private simple = false;     // near sides of shells alone
    private stale = true;       // what is on the screen is not what would be drawn now
    private readonly seen = new THREE.Matrix4();
    private readonly scene = new THREE.Scene();
    private readonly backdrop = new Backdrop();
    onTurn: (axes: Axes, mmPerPixel: number) => void = () => {};
    private surfaces: Surface[] = [];
    private readonly rod: Line2;
    private readonly rodMaterial = new LineMaterial({ linewidth: 3, depthTest: false, transparent: true, opacity: 0.9 });
    private readonly dots: THREE.Points;
    private readonly spheres: THREE.InstancedMesh;
    private readonly places = new Places();
    private readonly grabLine: THREE.Line;
    private readonly tip = new THREE.Vector3();
    private hasTip = false;
    private framed = false;
    private shapes: PartShape[] = [];
    private readonly reduced = matchMedia("(prefers-reduced-motion: reduce)").matches;

    constructor(private readonly canvas: HTMLCanvasElement) {
        this.software = drawsOnTheCpu();
        const pixels = Number(new URLSearchParams(location.search).get("pixels")); // &pixels=1: never fewer, for pictures
        this.fixed = pixels > 0 && pixels <= 1;
        // Where the CPU draws, a picture need not wait for the rest of the page.
        const context = this.software ? canvas.getContext("webgl2", { alpha: false, antialias: false, desynchronized: true }) : null;
        this.renderer = new THREE.WebGLRenderer({ canvas, context: context ?? undefined, antialias: !this.software, powerPreference: "high-performance" });
        if (this.fixed) this.pixelShare = pixels;
        else if (this.software) {
            this.pixelShare = 0.6;
            this.simple = true;
        }
        this.renderer.autoClear = false;
        this.camera.up.set(0, 0, 1);
        this.camera.position.set(0, 1, 0.2);
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.enableDamping = !this.reduced;
        this.controls.dampingFactor = 0.12;
        this.rod = new Line2(new LineGeometry(), this.rodMaterial);
        this.rod.renderOrder = 60;
        this.rod.frustumCulled = false;
        this.rod.visible = false;
        this.dots = makeDots();
        this.spheres = new THREE.InstancedMesh(
            new THREE.IcosahedronGeometry(1, 2),
            new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.3, depthWrite: false }), 6000);
        this.spheres.renderOrder = 55;
        this.spheres.frustumCulled = false;
        this.spheres.count = 0;
        this.grabLine = new THREE.Line(
            new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(new Float32Array(6), 3)),
            new THREE.LineBasicMaterial({ color: 0xfff3b0, depthTest: false, transparent: true }));
        this.grabLine.renderOrder = 80;
        this.grabLine.frustumCulled = false;
        this.grabLine.visible = false;
        this.scene.add(this.rod, this.dots, this.spheres, this.grabLine, this.places.group);
        addEventListener("resize", () => this.resize());
        this.resize();
    }

    get pixels(): number { return this.pixelShare; }

    setScene(message: SceneMessage): void {
        for (const surface of this.surfaces) {
            this.scene.remove(surface.shaded);
            surface.dispose();
        }
        this.surfaces = message.parts.map((part, k) => new Surface(part, k));
        this.frame = undefined; // of another scene
        this.shapes = [];
        // Organs hold vessels: their far sides come before those of the vessels, their near sides after.
        for (const surface of this.surfaces) this.scene.add(surface.shaded);
        this.places.setScene(message);
        this.rodRadius = message.radius ?? 5e-4;
        this.view = message.view;
        this.camera.up.set(...message.view.up);
        for (const surface of this.surfaces) surface.setSimple(this.simple);
        this.framed = false;
    }

    private rodRadius = 5e-4;   // m
    private view: View = { front: [0, -1, 0], antero_posterior: [0, -1, 0], up: [0, 0, 1] }; // the scene's comes before the first frame

    setModel(model: Model): void { this.surfaces[model.part]?.setCorners(model.corners, model.far); }

    /// More frames come than are drawn where the CPU draws: most of the work waits for the picture.
    setFrame(frame: Frame, shapes: PartShape[]): void {
        this.shapes = shapes;
        this.stale = true;
        shapes.forEach((shape, k) => {
            if (shape.changed) this.surfaces[k]?.setPositions(shape.position);
        });
        this.frame = frame;
        this.hasTip = frame.rod.length >= 3;
        if (this.hasTip) this.tip.fromArray(frame.rod, frame.rod.length - 3);
        if (!this.framed) {
            this.framed = true;
            this.frameAll();
        }
    }
    private frame: Frame | undefined; // the last one, until it is drawn

    private takeFrame(): void {
        const frame = this.frame;
        if (frame === undefined) return;
        this.frame = undefined;
        this.setRod(frame.rod);
        setDots(this.dots.geometry, frame.dots);
        this.setSpheres(frame);
        this.places.follow(this.shapes);
    }

    private setRod(points: Float32Array): void {
        this.rod.visible = points.length >= 6;
        if (!this.rod.visible) return;
        this.rod.geometry.dispose();
        this.rod.geometry = new LineGeometry();
        this.rod.geometry.setPositions(points as unknown as number[]);
    }

    private setSpheres(frame: Frame): void {
        const count = Math.min(frame.spheres.length / 4, 6000);
        const matrix = new THREE.Matrix4();
        for (let k = 0; k < count; ++k) {
            const radius = frame.spheres[4 * k + 3];
            matrix.makeScale(radius, radius, radius);
            matrix.setPosition(frame.spheres[4 * k], frame.spheres[4 * k + 1], frame.spheres[4 * k + 2]);
            this.spheres.setMatrixAt(k, matrix);
            this.spheres.setColorAt(k, kSphereColours[frame.sphereKinds[k]] ?? kSphereColours[0]);
        }
        this.spheres.count = count;
        this.spheres.instanceMatrix.needsUpdate = true;
        if (this.spheres.instanceColor) this.spheres.instanceColor.needsUpdate = true;
    }

    private boundsOfAll(): THREE.Box3 {
        const box = new THREE.Box3();
        const organs = this.surfaces.filter((surface) => surface.part.kind !== "instrument" && surface.part.kind !== "space");
        for (const surface of organs.length > 0 ? organs : this.surfaces) {
            if (surface.whole.getAttribute("position") === undefined) continue;
            surface.whole.computeBoundingBox();
            box.union(surface.whole.boundingBox!);
        }
        return box;
    }

    /// The standard view of the report's pictures, of all that is there: from the patient's front, slightly from above.
    frameAll(): void {
        const box = this.boundsOfAll();
        if (box.isEmpty()) return;
        this.followTip = false;
        const centre = box.getCenter(new THREE.Vector3());
        const ahead = new THREE.Vector3(...this.view.front);
        const right = new THREE.Vector3().crossVectors(ahead, this.camera.up).normalize();
        const above = new THREE.Vector3().crossVectors(right, ahead);
        const half = Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2));
        const distance = Math.max(...cornersOf(box).map((corner) => {
            const way = corner.sub(centre);
            return kMargin * Math.max(Math.abs(way.dot(above)), Math.abs(way.dot(right)) / this.camera.aspect) / half - way.dot(ahead);
        }));
        this.camera.position.copy(centre).addScaledVector(ahead, -distance);
        this.controls.target.copy(centre);
        this.controls.minDistance = 0.01;
        this.controls.maxDistance = 6 * distance;
    }

    /// From a side of the patient, as far away as now.
    lookFrom(side: Direction): void {
        const distance = this.camera.position.distanceTo(this.controls.target);
        const way = new THREE.Vector3(...side);
        if (Math.abs(way.dot(this.camera.up)) > 0.99) way.addScaledVector(new THREE.Vector3(...this.view.antero_posterior), -0.02); // the front stays down
        this.camera.position.copy(this.controls.target).addScaledVector(way.normalize(), distance);
        this.touch();
    }

    /// Unit vector from the eye to what it looks at.
    get looking(): [number, number, number] {
        return this.controls.target.clone().sub(this.camera.position).normalize().toArray();
    }

    /// Close to the tip, and with it from now on.
    frameTip(): void {
        if (!this.hasTip) return;
        const direction = this.camera.position.clone().sub(this.controls.target).normalize();
        const half = Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2));
        this.controls.target.copy(this.tip);
        this.camera.position.copy(this.tip).addScaledVector(direction, kTail / half);
        this.followTip = true;
    }

    /// By the keys: to the right and up, rad.
    turn(right: number, up: number): void {
        const way = this.camera.position.clone().sub(this.controls.target);
        way.applyAxisAngle(this.camera.up, right);
        const polar = way.angleTo(this.camera.up), to = THREE.MathUtils.clamp(polar - up, 0.05, Math.PI - 0.05);
        way.applyAxisAngle(new THREE.Vector3().crossVectors(this.camera.up, way).normalize(), to - polar);
        this.camera.position.copy(this.controls.target).add(way);
    }
    /// times  the distance
    approach(times: number): void {
        const way = this.camera.position.clone().sub(this.controls.target);
        way.setLength(THREE.MathUtils.clamp(times * way.length(), this.controls.minDistance, this.controls.maxDistance));
        this.camera.position.copy(this.controls.target).add(way);
    }

    setOrganOpacity(share: number): void {
        this.touch();
        for (const surface of this.surfaces) if (surface.part.kind === "organ") surface.setOpacity(share);
    }

    pick(clientX: number, clientY: number): Picked | undefined {
        const ray = this.rayAt(clientX, clientY);
        let best: { distance: number; picked: Picked } | undefined;
        this.surfaces.forEach((surface, body) => {
            if (!surface.part.pullable || surface.whole.index === null) return;
            const [hit] = ray.intersectObject(surface.pick, false);
            if (!hit?.face || (best && hit.distance >= best.distance)) return;
            const position = this.shapes[body].position;
            const corners = [hit.face.a, hit.face.b, hit.face.c];
            const gaps = corners.map((v) => new THREE.Vector3().fromArray(position, 3 * v).distanceToSquared(hit.point));
            best = { distance: hit.distance, picked: { body, vertex: corners[gaps.indexOf(Math.min(...gaps))], point: hit.point.clone() } };
        });
        return best?.picked;
    }

    /// The nearest side of one part; undefined: it is not there.
    pickWall(clientX: number, clientY: number, part: number): WallHit | undefined {
        const surface = this.surfaces[part];
        if (this.hidden || surface === undefined || surface.whole.index === null) return undefined;
        const [hit] = this.rayAt(clientX, clientY).intersectObject(surface.pick, false);
        return hit?.faceIndex == null || hit.barycoord == null ? undefined : { triangle: hit.faceIndex, weights: hit.barycoord.toArray() };
    }

    /// Pixels of the page where a place is seen.
    project(place: THREE.Vector3): [number, number] {
        const box = this.canvas.getBoundingClientRect(), seen = place.clone().project(this.camera);
        return [box.left + (0.5 + 0.5 * seen.x) * box.width, box.top + (0.5 - 0.5 * seen.y) * box.height];
    }
    nameAt(x: number, y: number): string | undefined { return this.hidden ? undefined : this.places.nameAt(x, y, (place) => this.project(place)); }
    setPicks(picks: Picks): void {
        this.places.setPicks(picks);
        this.touch();
    }
    showCentreline(on: boolean): void {
        this.places.showCentreline(on);
        this.touch();
    }
    showMarks(on: boolean): void {
        this.places.showMarks(on);
        this.touch();
    }

    rayAt(clientX: number, clientY: number): THREE.Raycaster {
        const box = this.canvas.getBoundingClientRect();
        const ray = new THREE.Raycaster();
        const at = new THREE.Vector2((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height);
        this.camera.updateMatrixWorld();
        ray.setFromCamera(at, this.camera);
        return ray;
    }

    vertex(body: number, vertex: number): THREE.Vector3 { return new THREE.Vector3().fromArray(this.shapes[body].position, 3 * vertex); }

    showPull(from: THREE.Vector3 | undefined, to?: THREE.Vector3): void {
        this.stale = true;
        this.grabLine.visible = from !== undefined;
        if (from === undefined || to === undefined) return;
        const position = this.grabLine.geometry.getAttribute("position") as THREE.BufferAttribute;
        position.setXYZ(0, from.x, from.y, from.z);
        position.setXYZ(1, to.x, to.y, to.z);
        position.needsUpdate = true;
    }

    resize(): void {
        const ratio = Math.min(devicePixelRatio, 2) * this.pixelShare;
        const { clientWidth, clientHeight } = this.canvas.parentElement ?? this.canvas;
        this.renderer.setPixelRatio(ratio);
        this.renderer.setSize(clientWidth, clientHeight, false);
        this.camera.aspect = clientWidth / Math.max(clientHeight, 1);
        this.camera.updateProjectionMatrix();
        (this.dots.material as THREE.ShaderMaterial).uniforms.ratio.value = ratio;
        this.rodMaterial.resolution.set(clientWidth * ratio, clientHeight * ratio);
        this.touch();
        this.restUntil = 0;
    }

    /// Of the page, where the middle of what is looked at lies.
    get mmPerPixel(): number {
        const distance = this.camera.position.distanceTo(this.controls.target);
        return (2e3 * distance * Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2))) / Math.max(this.canvas.clientHeight, 1);
    }

    /// Something else than a frame has changed.
    touch(): void { this.stale = true; }

    /// Draws where there is something new to see. False: there was nothing, or the CPU that draws is left some time for the rest; not when
    /// input waits for this picture.
    /// The next picture that is drawn, as PNG.
    takePicture(take: (picture: Blob) => void): void { this.pictureWanted = take; this.stale = true; }
    private pictureWanted: ((picture: Blob) => void) | undefined;

    render(awaited = false): boolean {
        if (this.hidden) return false;
        if (this.followTip && this.hasTip) {
            const way = this.tip.clone().sub(this.controls.target).multiplyScalar(this.reduced ? 1 : 0.25);
            this.controls.target.add(way);
            this.camera.position.add(way);
        }
        this.controls.update();
        this.camera.updateMatrixWorld();
        if (!this.stale && this.seen.equals(this.camera.matrixWorld)) return false;
        const start = performance.now();
        if (this.software && !awaited && start < this.restUntil) return false;
        if (start - this.drawnAt < 1000) this.frameMs += 0.1 * (start - this.drawnAt - this.frameMs);
        this.drawnAt = start;
        this.stale = false;
        this.seen.copy(this.camera.matrixWorld);
        this.draw();
        this.restUntil = start + Math.min(kRest * this.drawMs, kLongestRest);
        if (++this.drawn % kProbeEvery === 0) {
            this.waitForPicture();
            this.adapt(performance.now() - start);
        }
        return true;
    }
    private restUntil = 0; // ms
    private drawnAt = -1e9;

    /// Reads one pixel: or the time would be spent later, unseen.
    waitForPicture(): void {
        const gl = this.renderer.getContext();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, this.onePixel);
    }
    private drawn = 0;
    private readonly onePixel = new Uint8Array(4);

    private draw(): void {
        this.takeFrame();
        this.onTurn(axesOfCamera(this.camera), this.mmPerPixel);
        for (const surface of this.surfaces) surface.follow();
        this.dots.visible = this.showContacts;
        this.spheres.visible = this.showSpheres;
        const thin = this.styleRod();
        const lined = thin && this.simple ? this.surfaces.find((surface) => surface.part.kind === "instrument") : undefined; // the line is the first one's
        for (const surface of this.surfaces) surface.shaded.visible = surface !== lined;
        this.renderer.setClearColor(0x000000, 1);
        this.renderer.clear();
        this.backdrop.render(this.renderer);
        this.renderer.render(this.scene, this.camera);
        if (this.pictureWanted) { // before the browser takes the drawing away
            const take = this.pictureWanted;
            this.pictureWanted = undefined;
            this.withMarks().toBlob((picture) => { if (picture) take(picture); }, "image/png");
        }
        this.triangles = this.renderer.info.render.triangles;
    }

    /// A copy of the picture with the cube of the patient's sides and the scale bar.
    private withMarks(): HTMLCanvasElement {
        const copy = document.createElement("canvas"), { width, height } = this.canvas;
        [copy.width, copy.height] = [width, height];
        const pen = copy.getContext("2d")!, scale = Math.max(1, height / 620);
        pen.drawImage(this.canvas, 0, 0);
        drawOrientation(pen, axesOfCamera(this.camera), 60 * scale, height - 60 * scale, scale);
        drawScale(pen, (this.mmPerPixel * this.canvas.clientHeight) / (height / scale), 120 * scale, height - 24 * scale, scale);
        return copy;
    }

    /// The line keeps a thin catheter visible from afar, through walls; where its own skin is wide enough, the line fades.
    /// True where the line hides all of the skin.
    private styleRod(): boolean {
        const distance = this.camera.position.distanceTo(this.controls.target);
        const half = Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2));
        const pixels = (this.rodRadius / (distance * half)) * this.canvas.clientHeight;
        const far = THREE.MathUtils.clamp((5 - pixels) / 3, 0, 1);
        this.rodMaterial.color.set(0x7fd4ff);
        this.rodMaterial.opacity = 0.18 + 0.67 * far;
        this.rodMaterial.linewidth = Math.max(3, 0.9 * pixels) * Math.min(devicePixelRatio, 2) * this.pixelShare;
        this.rodMaterial.linewidth = Math.max(kThinnestLine, this.rodMaterial.linewidth);
        return pixels < 2;
    }

    /// Where drawing is slow, as without a graphics card: simpler shells, then fewer pixels, until it is quick enough.
    private adapt(drawMs: number): void {
        if (this.fixed) return;
        this.drawMs += 0.4 * (drawMs - this.drawMs);
        const before = this.pixelShare;
        if (this.drawMs > kSlowDraw && !this.simple) this.simple = true;
        else if (this.drawMs > kSlowDraw) this.pixelShare = Math.max(0.5, 0.8 * this.pixelShare);
        else if (this.drawMs < kQuickDraw && this.pixelShare < 1) this.pixelShare = Math.min(1, 1.2 * this.pixelShare);
        else if (this.drawMs < kSimpleDraw && !this.software) this.simple = false;
        for (const surface of this.surfaces) surface.setSimple(this.simple);
        if (Math.abs(before - this.pixelShare) < 0.01) return;
        this.resize(); // which wipes the picture
        this.draw();
        this.stale = false;
    }
}

function cornersOf({ min, max }: THREE.Box3): THREE.Vector3[] {
    return [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => new THREE.Vector3(x, y, z))));
}

/// A renderer without a graphics card names itself.
function drawsOnTheCpu(): boolean {
    const gl = document.createElement("canvas").getContext("webgl2");
    if (gl === null) return false;
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    gl.getExtension("WEBGL_lose_context")?.loseContext();
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}
