/** What a layer draws with: the canvas, the place of the map on it, and what is shown. */

import type { Feed } from "../service/feed";
import type { Selection } from "../service/selection";
import type { Store, Track } from "../sky/store";
import type { ViewState } from "../view/view";
import { SYMBOL } from "./label_places";
import { nearestX } from "./mercator";
import { PALETTES, type Palette } from "./palette";
import type { Pixels } from "./pixels";

/**
 * A plane of the map, each an own canvas. `ground` is drawn again when data or view change,
 * `sweep` and `moving` while something on them moves.
 */
export type Plane = "ground" | "sweep" | "moving";

export interface Layer {
  readonly plane: Plane;
  draw(scene: Scene): void;
}

/** A layer of many small marks, below all others of its plane. */
export interface PixelLayer {
  readonly plane: Plane;
  paint(scene: Scene, pixels: Pixels): void;
}

/** One object for all drawings: nothing is allocated for a frame. */
export class Scene {
  /** Pixels from map units: x = a X + e, y = d Y + f; size in pixels of the page, and device pixels of each. */
  a = 1;
  d = -1;
  e = 0;
  f = 0;
  /** The middle of the map, in its units. */
  middleX = 0;
  width = 0;
  height = 0;
  ratio = 1;
  /** Right and lower end of the buttons in the upper left corner. */
  controlX = 0;
  controlY = 0;
  context!: CanvasRenderingContext2D;
  palette: Palette = PALETTES.dark;
  /** Data time of the drawing. */
  timeS = 0;
  /** Time by which it is older than it says, s: no data come. */
  unheardS = 0;
  /** Time for which no sensor has delivered, s; null where it is not known. */
  silentS: number | null = 0;
  /** 0: plots as measured, 1: without biases; between them while they move. */
  corrected = 1;
  /** Boxes that labels leave free: left, top, width, height, … */
  readonly reserved: number[] = [];
  /** Counts how often they were written. */
  reservations = 0;
  /** The same of texts that move. */
  readonly reservedMoving: number[] = [];
  /** Tracks on the canvas, filled by the layer of symbols, with their pixels. */
  readonly seen = new Seen();
  /** The same of the second run, filled by its layer. */
  readonly seenSecond = new Seen();

  constructor(
    readonly view: ViewState,
    readonly store: Store,
    readonly feed: Feed,
    readonly selection: Selection,
  ) {}

  /** Of the copies of a point, that nearest to the middle of the map. */
  px(x: number): number {
    return this.a * nearestX(x, this.middleX) + this.e;
  }

  py(y: number): number {
    return this.d * y + this.f;
  }

  isInside(x: number, y: number, margin: number): boolean {
    return x >= -margin && y >= -margin && x <= this.width + margin && y <= this.height + margin;
  }
}

/** Tracks on the canvas and their pixels, in arrays that grow and are used again. */
export class Seen {
  length = 0;
  tracks: Track[] = [];
  x = new Float64Array(256);
  y = new Float64Array(256);

  clear(): void {
    this.length = 0;
  }

  add(track: Track, x: number, y: number): void {
    if (this.length === this.x.length) {
      this.x = grown(this.x);
      this.y = grown(this.y);
    }
    this.tracks[this.length] = track;
    this.x[this.length] = x;
    this.y[this.length] = y;
    this.length += 1;
  }

  /** Whether a symbol touches a box. */
  touches(left: number, top: number, width: number, height: number): boolean {
    for (let at = 0; at < this.length; at++) {
      const [x, y] = [this.x[at] ?? 0, this.y[at] ?? 0];
      if (x > left - SYMBOL && x < left + width + SYMBOL && y > top - SYMBOL && y < top + height + SYMBOL) return true;
    }
    return false;
  }
}

function grown(values: Float64Array): Float64Array<ArrayBuffer> {
  const twice = new Float64Array(2 * values.length);
  twice.set(values);
  return twice;
}
