// A reading over the last steps: one line, its axis from 0 to the largest value shown, in its unit.
import { kSteps } from "./plot";
import type { PlotStep } from "./protocol";

export class History {
    private readonly pen: CanvasRenderingContext2D;

    /// unit, digits  of the numbers that are written
    constructor(private readonly canvas: HTMLCanvasElement, private readonly value: (step: PlotStep) => number, private readonly unit: string,
                private readonly digits: number, private readonly colour: string) {
        this.pen = canvas.getContext("2d")!;
    }

    draw(steps: readonly PlotStep[]): void {
        const { canvas, pen } = this, ratio = Math.min(devicePixelRatio, 2);
        const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
        if (width === 0) return;
        if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
        pen.clearRect(0, 0, width, height);
        const values = steps.map(this.value), highest = Math.max(...values, 0.5 * 10 ** -this.digits), top = 1.1 * highest;
        const x = (k: number) => ((kSteps - steps.length + k + 0.5) * width) / kSteps, y = (value: number) => height - (height * value) / top;
        pen.strokeStyle = this.colour;
        pen.lineWidth = 1.5 * ratio;
        pen.beginPath();
        values.forEach((value, k) => (k === 0 ? pen.moveTo(x(k), y(value)) : pen.lineTo(x(k), y(value))));
        pen.stroke();
        pen.font = `${11 * ratio}px system-ui, sans-serif`;
        pen.fillStyle = "rgba(226, 232, 240, 0.85)";
        pen.fillText(steps.length === 0 ? "" : `${Math.max(...values).toFixed(this.digits)} ${this.unit}`, 4 * ratio, 12 * ratio);
        pen.fillText(`0 ${this.unit}`, 4 * ratio, height - 4 * ratio);
        canvas.dataset.last = steps.length === 0 ? "" : `${values[values.length - 1]}`;
    }
}
