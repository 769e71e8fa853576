// Step time against budget: one bar a step, the whole step faint, what the budget pays for bright, misses red.
import type { PlotStep } from "./protocol";

export const kSteps = 240;

export class Plot {
    private steps: PlotStep[] = [];
    private readonly pen: CanvasRenderingContext2D;
    private top = 1; // ms

    constructor(private readonly canvas: HTMLCanvasElement) {
        this.pen = canvas.getContext("2d")!;
    }

    add(steps: PlotStep[]): void {
        if (steps.length > 0 && this.steps.length > 0 && steps[0][0] < this.steps[this.steps.length - 1][0]) this.steps = []; // another run
        this.steps.push(...steps);
        if (this.steps.length > kSteps) this.steps.splice(0, this.steps.length - kSteps);
    }
    clear(): void { this.steps = []; }
    get shown(): readonly PlotStep[] { return this.steps; }
    /// Shares of the steps shown: budgeted parts within their budget, whole steps that took no longer than the `stepMs` they simulate.
    get kept(): number { return this.share((step) => step[5] === 1); }
    realTimeKept(stepMs: number): number { return this.share((step) => step[1] <= stepMs); }
    private share(holds: (step: PlotStep) => boolean): number {
        return this.steps.length === 0 ? 1 : this.steps.filter(holds).length / this.steps.length;
    }

    draw(stepMs: number): void {
        const { canvas, pen } = this;
        const ratio = Math.min(devicePixelRatio, 2);
        const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
        if (width === 0) return;
        if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
        const limit = this.steps.length > 0 ? this.steps[this.steps.length - 1][3] : 0;
        const highest = Math.max(stepMs, ...this.steps.map((step) => Math.max(step[1], Math.min(step[3], 3 * step[1]))));
        this.top += 0.15 * (1.15 * highest - this.top);
        const y = (ms: number) => height - (height * ms) / this.top;
        const bar = width / kSteps;
        pen.clearRect(0, 0, width, height);
        const start = kSteps - this.steps.length;
        this.steps.forEach(([, total, charged, , , kept], k) => {
            const x = (start + k) * bar, wide = Math.max(bar - ratio * 0.4, 1);
            pen.fillStyle = "rgba(148, 163, 184, 0.38)";
            pen.fillRect(x, y(total), wide, height - y(total));
            pen.fillStyle = kept === 1 ? "#38bdf8" : "#f43f5e";
            pen.fillRect(x, y(charged), wide, height - y(charged));
        });
        pen.font = `${11 * ratio}px system-ui, sans-serif`;
        const line = (ms: number, colour: string, text: string, dash: number[], side: "left" | "right") => {
            if (ms > this.top) return;
            pen.strokeStyle = pen.fillStyle = colour;
            pen.setLineDash(dash.map((d) => d * ratio));
            pen.lineWidth = 1.4 * ratio;
            pen.beginPath();
            pen.moveTo(0, y(ms));
            pen.lineTo(width, y(ms));
            pen.stroke();
            pen.textAlign = side; // each its own: the two may be the same
            pen.fillText(text, side === "left" ? 4 * ratio : width - 4 * ratio, Math.max(y(ms) - 4 * ratio, 11 * ratio));
        };
        line(stepMs, "rgba(226, 232, 240, 0.75)", `real time ${stepMs.toFixed(0)} ms`, [2, 4], "left");
        if (limit > 0) line(limit, "#fbbf24", `budget ${formatMs(limit)}`, [], "right");
        pen.setLineDash([]);
    }
}

export function formatMs(ms: number): string {
    return ms < 1 ? `${ms.toFixed(2)} ms` : ms < 10 ? `${ms.toFixed(1)} ms` : `${ms.toFixed(0)} ms`;
}
