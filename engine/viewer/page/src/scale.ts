// The scale bar: a length of 1, 2 or 5 times a power of ten that takes at most so many pixels where the picture's middle lies.
const kLongest = 130; // pixels

export interface Scale { mm: number; pixels: number }

/// mmPerPixel  at the depth of the view's centre: what is nearer looks larger
export function scaleOf(mmPerPixel: number): Scale {
    const most = kLongest * mmPerPixel, ten = 10 ** Math.floor(Math.log10(most));
    const mm = [5, 2, 1].find((times) => times * ten <= most)! * ten;
    return { mm, pixels: mm / mmPerPixel };
}

export const scaleText = ({ mm }: Scale): string => `${Number(mm.toPrecision(1))} mm`;

export class ScaleBar {
    private readonly bar: HTMLElement;
    private readonly text: HTMLElement;
    private shown = "";

    constructor(private readonly box: HTMLElement) {
        this.bar = box.querySelector("i")!;
        this.text = box.querySelector("span")!;
    }

    update(mmPerPixel: number): void {
        if (!(mmPerPixel > 0) || !Number.isFinite(mmPerPixel)) return;
        const scale = scaleOf(mmPerPixel), width = `${scale.pixels.toFixed(1)}px`, text = scaleText(scale);
        if (this.shown === width + text) return;
        this.shown = width + text;
        this.bar.style.width = width;
        this.text.textContent = text;
        this.box.setAttribute("aria-label", `The bar is ${text} long in the middle of the view`);
    }
}

/// The same for a picture that is saved. x, y: of the bar's left end; zoom: of the size on the page
export function drawScale(pen: CanvasRenderingContext2D, mmPerPixel: number, x: number, y: number, zoom: number): void {
    const scale = scaleOf(mmPerPixel);
    pen.save();
    pen.setTransform(zoom, 0, 0, zoom, x, y);
    for (const [colour, width] of [["#10161f", 4], ["#e8eef7", 2]] as const) {
        pen.strokeStyle = colour;
        pen.lineWidth = width;
        pen.beginPath();
        pen.moveTo(0, -5);
        pen.lineTo(0, 0);
        pen.lineTo(scale.pixels, 0);
        pen.lineTo(scale.pixels, -5);
        pen.stroke();
    }
    pen.font = "600 12px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.lineWidth = 3;
    pen.strokeStyle = "#10161f";
    pen.fillStyle = "#e8eef7";
    pen.strokeText(scaleText(scale), scale.pixels / 2, -7);
    pen.fillText(scaleText(scale), scale.pixels / 2, -7);
    pen.restore();
}
