/**
 * Places labels so that none covers another, and none for long the symbol of another aircraft,
 * whose label it would seem to be. A label keeps its slot until that collides, or has covered a
 * symbol for some time; labels that have one come before others of the same rank.
 */

/** A label that wants a place. Size and rank are set before, slot and place by `place`. */
export interface Wanted {
  /** The symbol, in pixels. */
  x: number;
  y: number;
  width: number;
  height: number;
  /** 0 is placed first. */
  rank: number;
  /** The slot that it has, -1 for none. */
  slot: number;
  /** Upper left corner. */
  left: number;
  top: number;
  /** Whether it leaves a slot with a leader line for one beside the symbol: the user moved the map. */
  home: boolean;
  /** Whether a symbol lies under it, and since when, ms. */
  covers: boolean;
  coveredMs: number;
}

export const RANKS = 6;
/** Up to this rank a label is drawn also where it covers symbols, but those of other ranks only. */
const FIRST_RANK = 1;
const NEAR = 9;
/** Distances of the slots with a leader line, pixels. */
const RINGS = [30, 56, 84] as const;
/** From the symbol: direction east and south of each slot of a ring; upper right first. */
const DIRECTIONS: readonly (readonly [number, number])[] = [
  [1, -1], [1, 1], [-1, -1], [-1, 1], [1, 0], [-1, 0], [0, -1], [0, 1],
];
const EAST = DIRECTIONS.map(([east]) => east);
const SOUTH = DIRECTIONS.map(([, south]) => south);
/** Distance of each slot to the east or west and to the north or south; less on diagonals. */
const FAR = [NEAR, ...RINGS].flatMap((far, ring) =>
  DIRECTIONS.map(([east, south]) => (ring > 0 && east !== 0 && south !== 0 ? 0.75 * far : far)));
export const SLOTS = DIRECTIONS.length * (1 + RINGS.length);
/** Kept free around a label, so that labels do not touch until they are placed again, pixels. */
export const MARGIN = 1.5;
/** Half the size of a symbol. */
export const SYMBOL = 5;
/** A label that covers a symbol looks for another slot so often, ms: most aircraft only pass under it. */
const COVERED_MS = 2000;
/** After so many labels without a place the canvas is full. */
const FAILED_MAX = 2000;

/** Whether a label at a slot has a leader line. */
export function hasLeader(slot: number): boolean {
  return slot >= DIRECTIONS.length;
}

export class LabelPlaces {
  private readonly labels = new Boxes();
  private readonly symbols = new Boxes();
  /** Those of the first ranks. */
  private readonly first = new Boxes();
  private order = new Int32Array(0);
  private nowMs = 0;

  /** Place at most `budget` of the first `count` within a canvas; those without a place get slot -1. */
  place(
    wanted: readonly Wanted[], count: number, budget: number, width: number, height: number, nowMs: number,
    reserved: readonly (readonly number[])[] = [],
  ): void {
    this.nowMs = nowMs;
    this.labels.clear(width, height);
    for (const boxes of reserved) {
      for (let at = 0; at + 3 < boxes.length; at += 4) {
        this.labels.add(boxes[at] ?? 0, boxes[at + 1] ?? 0, boxes[at + 2] ?? 0, boxes[at + 3] ?? 0);
      }
    }
    this.symbols.clear(width, height);
    this.first.clear(width, height);
    for (let at = 0; at < count; at++) {
      const one = wanted[at];
      if (one === undefined) continue;
      this.symbols.add(one.x - SYMBOL, one.y - SYMBOL, 2 * SYMBOL, 2 * SYMBOL);
      if (one.rank <= FIRST_RANK) this.first.add(one.x - SYMBOL, one.y - SYMBOL, 2 * SYMBOL, 2 * SYMBOL);
    }
    this.sort(wanted, count);
    let placed = 0;
    let failed = 0;
    for (let at = 0; at < count; at++) {
      const one = wanted[this.order[at] ?? 0];
      if (one === undefined) continue;
      if (placed < budget && (failed < FAILED_MAX || one.slot >= 0) && this.find(one, width, height)) {
        placed += 1;
      } else {
        failed += 1;
        one.slot = -1;
      }
    }
  }

  private find(one: Wanted, width: number, height: number): boolean {
    const kept = one.slot;
    if (one.home && hasLeader(kept)) {
      const near = this.firstFit(one, DIRECTIONS.length, width, height, false);
      if (near !== null) return this.take(one, near);
    }
    // A slot that is kept may cover a symbol for a moment: labels do not jump when aircraft pass under them.
    const keeps = kept >= 0 && this.fits(one, kept, width, height, true);
    if (keeps && !(one.covers && this.nowMs - one.coveredMs >= COVERED_MS)) return this.take(one, kept);
    const free = this.firstFit(one, SLOTS, width, height, false);
    if (free !== null) return this.take(one, free);
    if (one.rank > FIRST_RANK) return false;
    if (keeps) {
      // The search is repeated later.
      one.coveredMs = this.nowMs;
      return this.take(one, kept);
    }
    const over = this.firstFit(one, SLOTS, width, height, true);
    return over !== null && this.take(one, over);
  }

  /** The first of so many slots with room for a label. */
  private firstFit(one: Wanted, slots: number, width: number, height: number, overSymbols: boolean): number | null {
    for (let slot = 0; slot < slots; slot++) {
      if (this.fits(one, slot, width, height, overSymbols)) return slot;
    }
    return null;
  }

  private fits(one: Wanted, slot: number, width: number, height: number, overSymbols: boolean): boolean {
    const left = leftOf(one, slot);
    const top = topOf(one, slot);
    if (left < 0 || top < 0 || left + one.width > width || top + one.height > height) return false;
    if (!this.labels.isFree(left - MARGIN, top - MARGIN, one.width + 2 * MARGIN, one.height + 2 * MARGIN)) return false;
    return (overSymbols ? this.first : this.symbols).isFree(left, top, one.width, one.height);
  }

  private take(one: Wanted, slot: number): boolean {
    one.slot = slot;
    one.left = leftOf(one, slot);
    one.top = topOf(one, slot);
    const covers = !this.symbols.isFree(one.left, one.top, one.width, one.height);
    if (covers && !one.covers) one.coveredMs = this.nowMs;
    one.covers = covers;
    this.labels.add(one.left - MARGIN, one.top - MARGIN, one.width + 2 * MARGIN, one.height + 2 * MARGIN);
    return true;
  }

  /** By rank, those with a slot first, then as given. */
  private sort(wanted: readonly Wanted[], count: number): void {
    if (this.order.length < count) this.order = new Int32Array(2 * count);
    let next = 0;
    for (let group = 0; group < 2 * RANKS; group++) {
      for (let at = 0; at < count; at++) {
        const one = wanted[at];
        if (one !== undefined && 2 * one.rank + (one.slot >= 0 ? 0 : 1) === group) this.order[next++] = at;
      }
    }
  }
}

export function leftOf(one: Wanted, slot: number): number {
  const east = EAST[slot % EAST.length] ?? 1;
  const far = FAR[slot] ?? NEAR;
  if (east > 0) return one.x + far;
  return east < 0 ? one.x - far - one.width : one.x - one.width / 2;
}

export function topOf(one: Wanted, slot: number): number {
  const south = SOUTH[slot % SOUTH.length] ?? -1;
  // Beside the symbol the near slots are only a little higher or lower.
  const near = slot < DIRECTIONS.length && EAST[slot] !== 0;
  const far = near ? 0.4 * NEAR : (FAR[slot] ?? NEAR);
  if (south > 0) return one.y + far;
  return south < 0 ? one.y - far - one.height : one.y - one.height / 2;
}

/** Boxes in a grid of cells; arrays are used again. */
class Boxes {
  private columns = 0;
  private rows = 0;
  /** The last entry of each cell; entries are chained. */
  private heads = new Int32Array(0);
  private chain = new Int32Array(1024);
  private box = new Int32Array(1024);
  private entries = 0;
  private corners = new Float32Array(4 * 256);
  private count = 0;

  clear(width: number, height: number): void {
    this.columns = Math.ceil(width / CELL) + 1;
    this.rows = Math.ceil(height / CELL) + 1;
    if (this.heads.length < this.columns * this.rows) this.heads = new Int32Array(this.columns * this.rows);
    this.heads.fill(-1);
    this.entries = 0;
    this.count = 0;
  }

  add(left: number, top: number, width: number, height: number): void {
    if (4 * this.count + 4 > this.corners.length) {
      const corners = new Float32Array(2 * this.corners.length);
      corners.set(this.corners);
      this.corners = corners;
    }
    this.corners[4 * this.count] = left;
    this.corners[4 * this.count + 1] = top;
    this.corners[4 * this.count + 2] = left + width;
    this.corners[4 * this.count + 3] = top + height;
    const [firstColumn, lastColumn] = [this.column(left), this.column(left + width)];
    const [firstRow, lastRow] = [this.row(top), this.row(top + height)];
    for (let row = firstRow; row <= lastRow; row++) {
      for (let column = firstColumn; column <= lastColumn; column++) this.enter(row * this.columns + column);
    }
    this.count += 1;
  }

  isFree(left: number, top: number, width: number, height: number): boolean {
    const { corners, heads, chain, box } = this;
    const right = left + width;
    const bottom = top + height;
    const firstColumn = this.column(left);
    const lastColumn = this.column(right);
    const firstRow = this.row(top);
    const lastRow = this.row(bottom);
    for (let row = firstRow; row <= lastRow; row++) {
      for (let column = firstColumn; column <= lastColumn; column++) {
        let entry = heads[row * this.columns + column] ?? -1;
        while (entry >= 0) {
          const at = 4 * (box[entry] ?? 0);
          if (left < (corners[at + 2] ?? 0) && (corners[at] ?? 0) < right
            && top < (corners[at + 3] ?? 0) && (corners[at + 1] ?? 0) < bottom) return false;
          entry = chain[entry] ?? -1;
        }
      }
    }
    return true;
  }

  private enter(cell: number): void {
    if (this.entries === this.chain.length) {
      const [chain, box] = [new Int32Array(2 * this.chain.length), new Int32Array(2 * this.chain.length)];
      chain.set(this.chain);
      box.set(this.box);
      [this.chain, this.box] = [chain, box];
    }
    this.chain[this.entries] = this.heads[cell] ?? -1;
    this.box[this.entries] = this.count;
    this.heads[cell] = this.entries;
    this.entries += 1;
  }

  private column(x: number): number {
    return Math.max(0, Math.min(this.columns - 1, Math.floor(x / CELL)));
  }

  private row(y: number): number {
    return Math.max(0, Math.min(this.rows - 1, Math.floor(y / CELL)));
  }
}

const CELL = 40;
