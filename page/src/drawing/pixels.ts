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
  mark(sensor: number, x: number, y: number, colour: number): void {
    const { scale } = this;
    const [column, row] = [Math.round(x), Math.round(y)];
    const offsets = MARKS[sensor % MARKS.length];
    if (offsets === undefined) return;
    for (let at = 0; at < offsets.length; at += 2) {
      this.block(column + (offsets[at] ?? 0) * scale, row + (offsets[at + 1] ?? 0) * scale, scale, colour);
    }
  }

  private block(left: number, top: number, side: number, colour: number): void {
    if (left < 0 || top < 0 || left + side > this.width || top + side > this.height) return;
    for (let row = top; row < top + side; row++) {
      this.words.fill(colour, row * this.width + left, row * this.width + left + side);
    }
  }
}

/** A colour `#rrggbb` with an opacity as a word of an image, whose octets are red, green, blue, opacity. */
export function word(colour: string, opacity: number): number {
  const value = parseInt(colour.slice(1), 16);
  const [red, green, blue] = [value >> 16, (value >> 8) & 255, value & 255];
  return ((Math.round(255 * opacity) << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}
