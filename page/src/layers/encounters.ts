/** Encounters: a line between both tracks, their positions of closest approach, and distance, time and probability. */

import { FONT } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import { DISTANCE_M, HORIZON_S, probabilityOf, type Encounter, type Encounters } from "../service/encounters";
import { mercatorX, mercatorY, nearestX } from "../drawing/mercator";
import type { Track } from "../sky/store";
import { touches } from "./sites";
import { isShown } from "../view/shown";
import { distance } from "../view/units";

const DASH = [4, 3];
const LETTER_PX = 6.7;
/** Distance of the count from the lower right corner. */
const CORNER_PX = 14;
/** A pair at its closest point is drawn with its present distance as long as the answer is no older, s. */
const FRESH_S = 30;
/** The text is moved by so much where it would cover another. */
const STEPS_PX = [0, -14, 14, -28, 28, -42, 42] as const;

export class EncountersLayer implements Layer {
  readonly plane = "moving";
  /** Encounters on the canvas, for tests. */
  texts: string[] = [];

  constructor(private readonly encounters: Encounters) {}

  draw(scene: Scene): void {
    const { context, palette, store, view } = scene;
    this.texts.length = 0;
    scene.reservedMoving.length = 0;
    if (!view.shown.encounters || !view.shown.tracks) return;
    context.strokeStyle = palette.warning;
    context.font = `11px ${FONT}`;
    context.lineWidth = 1;
    this.count(scene);
    for (const one of this.encounters.found) {
      const [first, second] = [store.track(one.first_track_id), store.track(one.second_track_id)];
      if (first === undefined || second === undefined || (!isShown(first, view) && !isShown(second, view))) continue;
      const [left, distanceM] = whenOf(scene, one, first, second);
      if (left === null) continue;
      const [ax, ay] = here(scene, first);
      const [bx, by] = here(scene, second);
      if (!scene.isInside(ax, ay, 0) && !scene.isInside(bx, by, 0)) continue;
      const isNow = left === 0;
      const cx = isNow ? ax : scene.px(mercatorX(one.first_longitude_deg));
      const cy = isNow ? ay : scene.py(mercatorY(one.first_latitude_deg));
      const dx = isNow ? bx : scene.px(mercatorX(one.second_longitude_deg));
      const dy = isNow ? by : scene.py(mercatorY(one.second_latitude_deg));
      // To the positions of closest approach, and between them; one that is present stands out.
      context.lineWidth = isNow ? 2 : 1;
      context.setLineDash(DASH);
      context.globalAlpha = 0.75;
      context.beginPath();
      context.moveTo(ax, ay);
      context.lineTo(cx, cy);
      context.moveTo(bx, by);
      context.lineTo(dx, dy);
      context.stroke();
      context.setLineDash([]);
      context.globalAlpha = 1;
      context.beginPath();
      context.moveTo(cx, cy);
      context.lineTo(dx, dy);
      for (const [x, y] of isNow ? [] : [[cx, cy], [dx, dy]] as const) {
        context.moveTo(x - 3, y - 3);
        context.lineTo(x + 3, y + 3);
        context.moveTo(x + 3, y - 3);
        context.lineTo(x - 3, y + 3);
      }
      context.stroke();
      const apart = distance(distanceM, view.units);
      const when = isNow ? `now ${apart}` : `${apart} in ${left} s`;
      const text = `${when}, ${certainty(one, first, second)}`;
      // Whole within the map, as long as its place is.
      const most = Math.max(2, scene.width - LETTER_PX * text.length - 4);
      const beside = Math.round((cx + dx) / 2) + 8;
      const x = beside <= scene.width ? Math.min(beside, most) : beside;
      const middle = Math.round((cy + dy) / 2) + 4;
      const width = LETTER_PX * text.length + 4;
      // Beside the names of sites and the texts of other pairs, and on no symbol, if there is room near by.
      const isFree = (bottom: number): boolean => ![scene.reserved, scene.reservedMoving].some((one) => touches(one, x - 2, bottom - 10, width, 13));
      const free = STEPS_PX.map((step) => middle + step).filter(isFree);
      const y = free.find((bottom) => !scene.seen.touches(x - 2, bottom - 10, width, 13)) ?? free[0];
      if (y === undefined) continue;
      context.fillStyle = palette.background;
      context.globalAlpha = 0.8;
      context.fillRect(x - 2, y - 10, width, 13);
      context.globalAlpha = 1;
      context.fillStyle = palette.warning;
      context.fillText(text, x, y);
      scene.reservedMoving.push(x - 2, y - 10, width, 13);
      this.texts.push(text);
    }
  }

  /** In the corner, how many of the encounters are drawn, if not all. */
  private count(scene: Scene): void {
    const text = this.encounters.drawn;
    if (text === "") return;
    const width = LETTER_PX * text.length + 4;
    const [left, bottom] = [scene.width - CORNER_PX - width, scene.height - CORNER_PX];
    scene.context.fillStyle = scene.palette.warning;
    scene.context.fillText(text, left + 2, bottom);
    scene.reservedMoving.push(left, bottom - 10, width, 13);
  }
}

/**
 * Seconds to the closest approach, 0: now, and the distance then, m. Null: nothing is drawn, as of a picture that is
 * behind the answer, in a fast replay or when the service is busy.
 */
function whenOf(scene: Scene, one: Encounter, first: Track, second: Track): [number | null, number] {
  const left = Math.round(one.closest_time_s - scene.timeS);
  if (one.time_to_closest_s > 0 && left > 0) return [left <= HORIZON_S ? left : null, one.distance_m];
  const [ax, ay] = scene.store.placeOf(first, scene.timeS);
  const [bx, by] = scene.store.placeOf(second, scene.timeS);
  const apartM = Math.hypot(nearestX(bx, ax) - ax, by - ay) / first.scale;
  return [apartM <= DISTANCE_M && Math.abs(scene.timeS - one.time_s) <= FRESH_S ? 0 : null, apartM];
}

/** How sure it is, in words: two tracks with one Mode S address are rather a duplicate than a conflict. */
function certainty(one: Encounter, first: Track, second: Track): string {
  if (first.address !== null && first.address === second.address) return `both have address ${first.address}: duplicate track?`;
  return `${percent(probabilityOf(one))}${one.vertical_separation_m === null ? ", height unknown" : ""}`;
}

function percent(probability: number): string {
  if (probability < 0.01) return "< 1 %";
  return probability > 0.99 ? "> 99 %" : `${Math.round(100 * probability)} %`;
}

function here(scene: Scene, track: Track): [number, number] {
  const [x, y] = scene.store.placeOf(track, scene.timeS);
  return [scene.px(x), scene.py(y)];
}
