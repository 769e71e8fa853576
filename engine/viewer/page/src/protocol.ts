// Messages of the server, as engine/viewer/frame.hpp and messages.hpp describe them.

export interface Part {
    name: string;
    kind: "vessel" | "organ" | "rigid" | "space" | "instrument"; // space: around solids, nothing of it is drawn
    moves: boolean;
    pullable: boolean;
    vertices: number;
    triangles: number;
}
/// A place that goes with a vertex of a part, as place_messages.hpp describes it.
export interface Mark {
    name: string;
    position: [number, number, number]; // m, at rest
    part: number | null;
    vertex?: number;
    offset?: [number, number, number];
}
export interface EntryMark extends Mark { direction: [number, number, number] }
export interface Centreline {
    points: number[];          // x, y, z of each, m, at rest
    parents: number[];         // -1: the first
    vertices: number[] | null; // null: the vessel stands still
    offsets: number[] | null;
}
/// That the first instrument moves in.
export interface Vessel { part: number; instrument: string; entry: EntryMark; centreline: Centreline }
export type Budget = { mode: "wall"; ms: number } | { mode: "work"; units: number } | { mode: "exact" };
/// Unit vectors from the eye into the scene, as the report's pictures have them, and what is above.
export interface View {
    front: [number, number, number];
    antero_posterior: [number, number, number];
    up: [number, number, number];
}
export interface SceneMessage {
    type: "scene";
    name: string;
    file: string;
    step_s: number;
    parts: Part[];
    targets: Mark[];
    vessel: Vessel | null;     // null: no instrument moves in one
    effects: { name: string; label: string }[]; // that can be switched
    scope: "collision" | "step";
    budget: Budget;
    budget_ms: [number, number];
    budget_work: [number, number];
    most_saved: number; // states that are kept at the same time
    leaf_level: number;
    view: View;
    has_instrument: boolean;
    has_script: boolean;
    limits?: { speed: number; rotation: number };
    radius?: number;
}
/// step, whole step ms, charged ms, limit ms (0: none), level, kept, force on the wall N, insertion mm
export type PlotStep = [number, number, number, number, number, number, number, number];
/// A state that can be gone back to.
export interface SavedMark { id: number; name: string; step: number; time_s: number }
export interface Status {
    type: "status";
    frame: number;
    you: number;
    driver: number;
    viewers: number;
    run: number;
    step: number;
    time_s: number;
    paused: boolean;
    script: boolean;
    grabbed: boolean;
    stepped: boolean; // the numbers are of a step: not of a state that the run began with, or went back to
    pace: number;
    pace_wanted: number;
    drive: [number, number];
    budget: Budget;
    effects: Record<string, boolean>;
    total_ms: number;
    charged_ms: number;
    kept: boolean;
    stages_ms: number[];
    level: number;
    pairs_tested: number;
    pairs_open: number;
    assumed: number;
    error_m: number;
    exact_ran: boolean;
    exact_insisted: boolean;
    exact_contacts: number;
    pressing_contacts: number;
    unproven: number;
    dropped: number;
    force_n: number;
    max_force_n: number;
    pull_n: number;
    safe_fraction: number;
    hand_stops: number;
    lumen_exits: number;
    insertion_m: number;
    rotation_rad: number;
    tip: [number, number, number];
    target_m: number;
    substeps: number;
    failure: string;
    dots_left_out: number;
    spheres_left_out: number;
    recorded: number;
    repeatable: boolean;
    injection: { start_s: number; duration_s: number; injected_mg: number; in_vessels_mg: number; washed_out_mg: number } | null; // null: no contrast
    work_enough: number; // tests a step, with which the exact stage runs as it does without a limit
    not_shown: number;
    saved: SavedMark[]; // the oldest first
    steps: PlotStep[];
}
/// What is picked; radius: of the vessel there, m.
export interface Picks {
    type: "picks";
    target: (Mark & { radius: number }) | null;
    entry: (EntryMark & { radius: number }) | null;
}
export interface SavedScene { type: "saved_scene"; file: string; command: string; notices: string[] }
export type TextMessage =
    | SceneMessage
    | Status
    | Picks
    | SavedScene
    | { type: "error" | "notice"; text: string }
    | { type: "pong"; number: number };

export interface PartShape {
    numbers: Uint16Array;    // 3 a vertex, as they came
    position: Float32Array;  // m
    changed: boolean;        // by the last frame
}
export interface Frame {
    id: number;
    time: number;
    dots: Float32Array;      // x, y, z, depth
    rod: Float32Array;       // x, y, z
    spheres: Float32Array;   // x, y, z, radius
    sphereKinds: Uint8Array; // 0 free, 1 contact, 2 assumed
    bytes: number;
}

/// Of the X-ray monitor, as engine/viewer/xray_monitor.hpp describes it.
export interface XrayPicture {
    number: number;
    columns: number;
    rows: number;
    display: number;         // 1 log, 2 subtraction, 3 roadmap
    time: number;            // s
    primary: number;         // rad
    secondary: number;
    tip: [number, number];   // pixels; NaN: there is none
    zoom: number;
    ms: number;              // that the server took
    hasContrast: boolean;
    sourceInside: boolean;   // the source stands inside a body
    newMask: boolean;        // subtraction begins with this one
    grey: Uint8Array;
}

const kVersion = 2;
const kBlock = 512;

/// Reads on at multiples of four bytes.
class Reader {
    private at = 0;
    private readonly view: DataView;
    constructor(private readonly buffer: ArrayBuffer) {
        this.view = new DataView(buffer);
    }
    u8(): number { return this.view.getUint8(this.at++); }
    u16(): number { this.at += 2; return this.view.getUint16(this.at - 2, true); }
    u32(): number { this.at += 4; return this.view.getUint32(this.at - 4, true); }
    f32(): number { this.at += 4; return this.view.getFloat32(this.at - 4, true); }
    f64(): number { this.at += 8; return this.view.getFloat64(this.at - 8, true); }
    pad(): void { this.at += (4 - (this.at % 4)) % 4; }
    floats(n: number): Float32Array { this.at += 4 * n; return new Float32Array(this.buffer, this.at - 4 * n, n); }
    words(n: number): Uint32Array { this.at += 4 * n; return new Uint32Array(this.buffer, this.at - 4 * n, n); }
    shorts(n: number): Uint16Array { const from = this.at; this.at += 2 * n; this.pad(); return new Uint16Array(this.buffer, from, n); }
    bytes(n: number): Uint8Array { const from = this.at; this.at += n; this.pad(); return new Uint8Array(this.buffer, from, n); }
    signed(n: number): Int8Array { const from = this.at; this.at += n; this.pad(); return new Int8Array(this.buffer, from, n); }
}

/// far  fewer triangles on some of the same vertices; empty: there are none
export interface Model { part: number; corners: Uint32Array; far: Uint32Array }

export function readModel(buffer: ArrayBuffer): Model {
    const reader = new Reader(buffer);
    reader.u8();
    if (reader.u8() !== kVersion) throw new Error("the server speaks another version of this page's language: reload the page");
    const part = reader.u16();
    const corners = reader.words(3 * reader.u32()).slice();
    return { part, corners, far: reader.words(3 * reader.u32()).slice() };
}

export function readXray(buffer: ArrayBuffer): XrayPicture {
    const reader = new Reader(buffer);
    reader.u8();
    if (reader.u8() !== kVersion) throw new Error("the server speaks another version of this page's language: reload the page");
    const flags = reader.u16(), number = reader.u32(), columns = reader.u16(), rows = reader.u16(), display = reader.u32(), time = reader.f64();
    const [primary, secondary, u, v, zoom, ms] = reader.floats(6);
    return {
        number, columns, rows, display, time, primary, secondary, tip: [u, v], zoom, ms,
        hasContrast: (flags & 1) !== 0, sourceInside: (flags & 2) !== 0, newMask: (flags & 4) !== 0, grey: reader.bytes(columns * rows),
    };
}

function readPart(reader: Reader, shape: PartShape | undefined): PartShape {
    const low = [reader.f32(), reader.f32(), reader.f32()];
    const unit = [reader.f32(), reader.f32(), reader.f32()];
    const total = 3 * reader.u32();
    if (shape === undefined || shape.numbers.length !== total)
        shape = { numbers: new Uint16Array(total), position: new Float32Array(total), changed: true };
    shape.changed = false;
    const codings = reader.bytes(Math.ceil(total / (3 * kBlock)));
    const { numbers, position } = shape;
    codings.forEach((coding, block) => {
        const begin = 3 * kBlock * block;
        const count = Math.min(3 * kBlock, total - begin);
        if (coding === 1) numbers.set(reader.shorts(count), begin);
        else if (coding === 2) {
            const differences = reader.signed(count);
            for (let k = 0; k < count; ++k) numbers[begin + k] += differences[k];
        } else return;
        shape!.changed = true;
        for (let k = begin; k < begin + count; k += 3) {
            position[k] = low[0] + unit[0] * numbers[k];
            position[k + 1] = low[1] + unit[1] * numbers[k + 1];
            position[k + 2] = low[2] + unit[2] * numbers[k + 2];
        }
    });
    return shape;
}

/// Moves `shapes` on to this frame. Throws when the frame continues one that is not there.
export function readFrame(buffer: ArrayBuffer, shapes: PartShape[], lastId: number): Frame {
    const reader = new Reader(buffer);
    reader.u8();
    if (reader.u8() !== kVersion) throw new Error("the server speaks another version of this page's language: reload the page");
    const parts = reader.u16();
    const id = reader.u32();
    const base = reader.u32();
    if (base !== 0 && base !== lastId) throw new Error(`frame ${id} continues frame ${base}, but this page has ${lastId}`);
    const dots = reader.u32();
    const time = reader.f64();
    const spheres = reader.u32();
    const rod = reader.u32();
    for (let k = 0; k < parts; ++k) shapes[k] = readPart(reader, shapes[k]);
    return {
        id, time, dots: reader.floats(4 * dots), rod: reader.floats(3 * rod), spheres: reader.floats(4 * spheres),
        sphereKinds: reader.bytes(spheres), bytes: buffer.byteLength,
    };
}
