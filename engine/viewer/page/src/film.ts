// The film strip under the X-ray monitor: pictures of the last seconds, to look at again.
import type { XrayPicture } from "./protocol";

const kSeconds = 8, kMost = 150; // pictures
const kThumbnails = 8, kThumbnailEvery = 400; // ms

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

export class FilmStrip {
    reviewed: XrayPicture | undefined; // none: live
    private pictures: XrayPicture[] = []; // the oldest first
    private readonly at = element<HTMLInputElement>("film-at");
    private readonly thumbnails: { canvas: HTMLCanvasElement; shown: XrayPicture | undefined }[] = [];
    private shownAt = 0;

    /// changed   another picture is reviewed, or none
    constructor(private readonly changed: () => void) {
        element("film-live").addEventListener("click", () => this.review(undefined));
        this.at.addEventListener("input", () => this.review(this.pictures[Number(this.at.value)]));
        for (let k = 0; k < kThumbnails; ++k) {
            const canvas = document.createElement("canvas");
            canvas.width = canvas.height = 56;
            canvas.addEventListener("click", () => this.review(this.thumbnails[k].shown));
            element("film-frames").append(canvas);
            this.thumbnails.push({ canvas, shown: undefined });
        }
    }

    add(picture: XrayPicture): void {
        const { pictures } = this;
        if (pictures.length > 0 && picture.time < pictures[pictures.length - 1].time - 1e-9) pictures.length = 0; // another run
        pictures.push(picture);
        while (pictures.length > kMost || (pictures.length > 1 && pictures[0].time < picture.time - kSeconds)) pictures.shift();
    }

    review(picture: XrayPicture | undefined): void {
        this.reviewed = picture;
        element("film-live").setAttribute("aria-pressed", String(picture === undefined));
        if (picture === undefined) this.at.value = this.at.max;
        this.changed();
    }

    /// Thumbnails, a few times a second.
    show(now: number): void {
        if (now - this.shownAt < kThumbnailEvery) return;
        this.shownAt = now;
        const { pictures, reviewed } = this, last = pictures.length - 1;
        this.at.max = String(last);
        if (reviewed === undefined) this.at.value = this.at.max;
        else if (pictures.includes(reviewed)) this.at.value = String(pictures.indexOf(reviewed));
        this.thumbnails.forEach((thumbnail, k) => {
            const picture = pictures[Math.round(((k + 1) / kThumbnails) * last)];
            if (picture === undefined || picture === thumbnail.shown) return;
            thumbnail.shown = picture;
            thumbnail.canvas.getContext("2d")!.putImageData(smallImageOf(picture, thumbnail.canvas.width, thumbnail.canvas.height), 0, 0);
        });
    }
}

export function imageOf({ columns, rows, grey }: XrayPicture): ImageData {
    const pixels = new Uint32Array(columns * rows);
    for (let k = 0; k < pixels.length; ++k) pixels[k] = 0xff000000 | (grey[k] * 0x010101);
    return new ImageData(new Uint8ClampedArray(pixels.buffer), columns, rows);
}

function smallImageOf({ columns, rows, grey }: XrayPicture, width: number, height: number): ImageData {
    const pixels = new Uint32Array(width * height);
    for (let y = 0; y < height; ++y)
        for (let x = 0; x < width; ++x)
            pixels[y * width + x] = 0xff000000 | (grey[Math.floor(((y + 0.5) * rows) / height) * columns + Math.floor(((x + 0.5) * columns) / width)] * 0x010101);
    return new ImageData(new Uint8ClampedArray(pixels.buffer), width, height);
}
