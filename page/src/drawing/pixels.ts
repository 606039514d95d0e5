/**
 * Small marks written into an image: tens of thousands of history dots and plots cost less than a
 * hundred paths of the canvas without a graphics processor.
 */

/** Marks of plots by sensor: rows of pixels, `#` painted. Their shape differs, as their colour does. */
const PATTERNS: readonly (readonly string[])[] = [
  ["...#...", "...#...", "...#...", "#######", "...#...", "...#...", "...#..."],
  [".......", ".#####.", ".#...#.", ".#...#.", ".#...#.", ".#####.", "......."],
  ["...#...", "..#.#..", "..#.#..", ".#...#.", ".#...#.", "#######", "......."],
  ["..###..", ".#...#.", "#.....#", "#.....#", "#.....#", ".#...#.", "..###.."],
  ["#.....#", ".#...#.", "..#.#..", "...#...", "..#.#..", ".#...#.", "#.....#"],
  ["...#...", "..#.#..", ".#...#.", "#.....#", ".#...#.", "..#.#..", "...#..."],
  [".......", "#######", ".#...#.", ".#...#.", "..#.#..", "..#.#..", "...#..."],
  ["...#...", "...#...", "...#...", "...#...", "...#...", "...#...", "...#..."],
];
const HALF = 3;

/** Offsets of the painted pixels of each mark: column, row, column, row, … */
const MARKS: readonly Int8Array[] = PATTERNS.map((rows) =>
  Int8Array.from(rows.flatMap((row, y) =>
    [...row].flatMap((one, x) => (one === "#" ? [x - HALF, y - HALF] : [])))));

/** An image of the size of the canvas. */
export class Pixels {
  private image: ImageData | null = null;
  private words = new Uint32Array(0);
  private width = 0;
  private height = 0;
  /** Device pixels per pixel, whole. */
  private scale = 1;

  /** Clear, for a canvas of this size in device pixels. */
  begin(context: CanvasRenderingContext2D, ratio: number): void {
    const { width, height } = context.canvas;
    this.scale = Math.max(1, Math.round(ratio));
    if (this.image === null || this.image.width !== width || this.image.height !== height) {
      this.image = context.createImageData(width, height);
      this.words = new Uint32Array(this.image.data.buffer);
      [this.width, this.height] = [width, height];
    } else {
      this.words.fill(0);
    }
  }

  /** Replace the content of the canvas. */
  put(context: CanvasRenderingContext2D): void {
    if (this.image !== null) context.putImageData(this.image, 0, 0);
  }

  /** A square dot of some pixels at a place in device pixels. */
  dot(x: number, y: number, size: number, colour: number): void {
    const side = size * this.scale;
    this.block(Math.round(x - side / 2), Math.round(y - side / 2), side, colour);
  }

  /** The mark of a sensor at a place in device pixels. */
  mark(sensor: number, x: number, y: number, colour: number, size = 1): void {
    const offsets = MARKS[sensor % MARKS.length];
    if (offsets === undefined) return;
    const scale = size * this.scale;
    const column = Math.round(x);
    const row = Math.round(y);
    for (let at = 0; at < offsets.length; at += 2) {
      this.block(column + (offsets[at] ?? 0) * scale, row + (offsets[at + 1] ?? 0) * scale, scale, colour);
    }
  }

  /** A form at a place in device pixels, in a colour without opacity. */
  form(form: Form, x: number, y: number, colour: number): void {
    const { words, width, height } = this;
    const left = Math.round(x) - form.half;
    const top = Math.round(y) - form.half;
    const side = 2 * form.half + 1;
    if (left < 0 || top < 0 || left + side > width || top + side > height) return;
    const { offsets, opacities } = form.on(width);
    const first = top * width + left;
    for (let at = 0; at < offsets.length; at++) {
      const word = first + (offsets[at] ?? 0);
      const opacity = opacities[at] ?? 0;
      // The edge of one form does not cut a hole into another.
      if (opacity >= (words[word] ?? 0) >>> 24) words[word] = ((opacity << 24) | colour) >>> 0;
    }
  }

  private block(left: number, top: number, side: number, colour: number): void {
    const { words, width } = this;
    if (left < 0 || top < 0 || left + side > width || top + side > this.height) return;
    for (let row = 0; row < side; row++) {
      const first = (top + row) * width + left;
      for (let column = 0; column < side; column++) words[first + column] = colour;
    }
  }
}

/** A small drawing, kept as the opacity of its pixels. */
export class Form {
  private readonly places: number[] = [];
  readonly opacities: Uint8Array;
  offsets = new Int32Array(0);
  private width = 0;

  /** Draw a form once: around the middle of an area of `half` pixels to each side, in device pixels. */
  constructor(readonly half: number, draw: (context: CanvasRenderingContext2D) => void) {
    const side = 2 * half + 1;
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = side;
    const context = canvas.getContext("2d", { willReadFrequently: true });
    if (context === null) throw new Error("this browser does not support canvas");
    context.translate(half + 0.5, half + 0.5);
    draw(context);
    const { data } = context.getImageData(0, 0, side, side);
    const found: number[] = [];
    for (let at = 0; at < side * side; at++) {
      const opacity = data[4 * at + 3] ?? 0;
      if (opacity < 8) continue;
      this.places.push(at % side, Math.floor(at / side));
      found.push(opacity);
    }
    this.opacities = Uint8Array.from(found);
  }

  /** Offsets of the painted pixels in an image of a width, and their opacity. */
  on(width: number): { offsets: Int32Array; opacities: Uint8Array } {
    if (width !== this.width) {
      this.width = width;
      this.offsets = new Int32Array(this.opacities.length);
      for (let at = 0; at < this.offsets.length; at++) {
        this.offsets[at] = (this.places[2 * at] ?? 0) + width * (this.places[2 * at + 1] ?? 0);
      }
    }
    return this;
  }
}

/** A colour `#rrggbb` with an opacity as a word of an image, whose octets are red, green, blue, opacity. */
export function word(colour: string, opacity: number): number {
  const value = parseInt(colour.slice(1), 16);
  const [red, green, blue] = [value >> 16, (value >> 8) & 255, value & 255];
  return ((Math.round(255 * opacity) << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}
