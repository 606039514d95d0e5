/** Places labels so that none covers another; a label keeps its place as long as it is free. */

export interface Wanted {
  id: number;
  /** The symbol, in pixels. */
  x: number;
  y: number;
  width: number;
  height: number;
  /** The greater, the earlier it is placed. */
  priority: number;
}

export interface Placed {
  id: number;
  x: number;
  y: number;
  leader: boolean;
}

const GAP = 10;
const FAR = 34;
const CELL = 32;

/** Offsets of the lower left corner of a label from its symbol, the preferred first. */
function candidates(width: number, height: number): [number, number, boolean][] {
  const near: [number, number, boolean][] = [
    [GAP, -GAP, false],
    [GAP, height + GAP, false],
    [-width - GAP, -GAP, false],
    [-width - GAP, height + GAP, false],
  ];
  const far: [number, number, boolean][] = [
    [FAR, -FAR, true],
    [FAR, height + FAR, true],
    [-width - FAR, -FAR, true],
    [-width - FAR, height + FAR, true],
    [-width / 2, -FAR, true],
    [-width / 2, height + FAR, true],
  ];
  return [...near, ...far];
}

export class Labels {
  private readonly last = new Map<number, number>();

  /** Place at most `budget` labels within a canvas. */
  place(wanted: Wanted[], budget: number, width: number, height: number): Placed[] {
    const taken = new Grid();
    const placed: Placed[] = [];
    const ordered = [...wanted].sort((a, b) => b.priority - a.priority || a.id - b.id);
    for (const one of ordered) taken.mark(one.x - 5, one.y - 5, 10, 10);
    for (const one of ordered) {
      if (placed.length >= budget) break;
      const offsets = candidates(one.width, one.height);
      const kept = this.last.get(one.id) ?? 0;
      const order = [kept, ...offsets.keys()].filter((value, index) => index === 0 || value !== kept);
      for (const choice of order) {
        const [dx, dy, leader] = offsets[choice] ?? [0, 0, false];
        const x = one.x + dx;
        const y = one.y + dy;
        const inside = x >= 0 && y - one.height >= 0 && x + one.width <= width && y <= height;
        if (!inside || !taken.isFree(x, y - one.height, one.width, one.height)) continue;
        taken.mark(x, y - one.height, one.width, one.height);
        this.last.set(one.id, choice);
        placed.push({ id: one.id, x, y, leader });
        break;
      }
    }
    return placed;
  }
}

type Box = [number, number, number, number];

class Grid {
  private readonly cells = new Map<number, Box[]>();

  isFree(x: number, y: number, width: number, height: number): boolean {
    for (const key of this.keys(x, y, width, height)) {
      for (const [left, top, w, h] of this.cells.get(key) ?? []) {
        if (x < left + w && left < x + width && y < top + h && top < y + height) return false;
      }
    }
    return true;
  }

  mark(x: number, y: number, width: number, height: number): void {
    for (const key of this.keys(x, y, width, height)) {
      const cell = this.cells.get(key);
      if (cell === undefined) this.cells.set(key, [[x, y, width, height]]);
      else cell.push([x, y, width, height]);
    }
  }

  private *keys(x: number, y: number, width: number, height: number): Generator<number> {
    for (let column = Math.floor(x / CELL); column <= Math.floor((x + width) / CELL); column++) {
      for (let row = Math.floor(y / CELL); row <= Math.floor((y + height) / CELL); row++) {
        yield column * 65_536 + row;
      }
    }
  }
}
