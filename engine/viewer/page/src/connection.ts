// The WebSocket, which comes back by itself when it is lost.
import { readFrame, readModel, readXray, type XrayPicture, type Frame, type Model, type PartShape, type Picks, type SavedScene, type SceneMessage, type Status, type TextMessage } from "./protocol";

export interface Listener {
    onScene(scene: SceneMessage): void;
    onModel(model: Model): void;
    onFrame(frame: Frame, shapes: PartShape[]): void;
    onXray(picture: XrayPicture): void;
    onStatus(status: Status): void;
    onPicks(picks: Picks): void;
    onSavedScene(saved: SavedScene): void;
    onMessage(kind: "error" | "notice", text: string): void;
    onConnection(open: boolean): void;
}

const kFirstWait = 300; // ms until the first new try; twice as long each time
const kLongestWait = 4000;

export class Connection {
    private socket: WebSocket | undefined;
    private shapes: PartShape[] = [];
    private lastId = 0;
    private wait = kFirstWait;
    received = 0; // bytes

    constructor(private readonly listener: Listener) {}

    get token(): string { return new URLSearchParams(location.search).get("token") ?? ""; }
    get open(): boolean { return this.socket?.readyState === WebSocket.OPEN; }

    connect(): void {
        const scheme = location.protocol === "https:" ? "wss" : "ws";
        const socket = new WebSocket(`${scheme}://${location.host}/ws?token=${encodeURIComponent(this.token)}`);
        socket.binaryType = "arraybuffer";
        this.socket = socket;
        this.shapes = [];
        this.lastId = 0;
        socket.onopen = () => {
            this.wait = kFirstWait;
            this.listener.onConnection(true);
        };
        socket.onmessage = (event) => this.receive(event.data);
        let met = false;
        socket.addEventListener("open", () => { met = true; });
        socket.onclose = () => {
            if (this.socket !== socket) return;
            this.listener.onConnection(false);
            if (!met) void this.askWhy();
            setTimeout(() => this.connect(), this.wait);
            this.wait = Math.min(2 * this.wait, kLongestWait);
        };
    }

    /// A WebSocket that is refused does not say why.
    private async askWhy(): Promise<void> {
        const answer = await fetch(`/?token=${encodeURIComponent(this.token)}`, { method: "HEAD" }).catch(() => undefined);
        if (answer?.status === 403)
            this.listener.onMessage("error", "trocar was started anew: open the address that it has printed now.");
        else if (answer?.ok) this.listener.onMessage("error", "trocar has as many viewers as it takes: the page tries again.");
    }

    send(message: Record<string, unknown>): boolean {
        if (!this.open) return false;
        this.socket!.send(JSON.stringify(message));
        return true;
    }

    /// Simulates a lost connection, for tests.
    drop(): void { this.socket?.close(); }

    private receive(data: string | ArrayBuffer): void {
        try {
            if (typeof data === "string") this.text(JSON.parse(data) as TextMessage);
            else this.binary(data);
        } catch (problem) {
            this.listener.onMessage("error", problem instanceof Error ? problem.message : String(problem));
            this.socket?.close();
        }
    }

    private text(message: TextMessage): void {
        if (message.type === "scene") this.listener.onScene(message);
        else if (message.type === "status") this.listener.onStatus(message);
        else if (message.type === "picks") this.listener.onPicks(message);
        else if (message.type === "saved_scene") this.listener.onSavedScene(message);
        else if (message.type === "error" || message.type === "notice") this.listener.onMessage(message.type, message.text);
    }

    private binary(data: ArrayBuffer): void {
        this.received += data.byteLength;
        const kind = new Uint8Array(data, 0, 1)[0];
        if (kind === 2) {
            this.listener.onModel(readModel(data));
        } else if (kind === 1) {
            const frame = readFrame(data, this.shapes, this.lastId);
            this.lastId = frame.id;
            this.listener.onFrame(frame, this.shapes);
        } else if (kind === 3) this.listener.onXray(readXray(data));
    }
}
