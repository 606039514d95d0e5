/** Encounters: a line between both tracks, their positions of closest approach, and distance, time and probability. */

import { FONT } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import { HORIZON_S, probabilityOf, type Encounters } from "../service/encounters";
import { mercatorX, mercatorY } from "../drawing/mercator";
import type { Track } from "../sky/store";
import { touches } from "./sites";
import { isShown } from "../view/shown";
import { distance } from "../view/units";

const DASH = [4, 3];
const LETTER_PX = 6.7;
/** The text is moved by so much where it would cover another. */
const STEPS_PX = [0, -14, 14, -28, 28, -42, 42] as const;

export class EncountersLayer implements Layer {
  readonly plane = "moving";
  /** Encounters on the canvas, for tests. */
  texts: string[] = [];

  constructor(private readonly encounters: Encounters) {}

  draw(scene: Scene): void {
    const { context, palette, store, view, timeS } = scene;
    this.texts.length = 0;
    scene.reservedMoving.length = 0;
    if (!view.shown.encounters || !view.shown.tracks) return;
    context.strokeStyle = palette.warning;
    context.font = `11px ${FONT}`;
    context.lineWidth = 1;
    for (const one of this.encounters.found) {
      const [first, second] = [store.track(one.first_track_id), store.track(one.second_track_id)];
      const left = one.closest_time_s - timeS;
      // The picture may be behind the answer: in a fast replay, or when the service is busy.
      if (first === undefined || second === undefined || left < 0 || left > HORIZON_S) continue;
      if (!isShown(first, view) && !isShown(second, view)) continue;
      const [ax, ay] = here(scene, first);
      const [bx, by] = here(scene, second);
      if (!scene.isInside(ax, ay, 0) && !scene.isInside(bx, by, 0)) continue;
      const cx = scene.px(mercatorX(one.first_longitude_deg));
      const cy = scene.py(mercatorY(one.first_latitude_deg));
      const dx = scene.px(mercatorX(one.second_longitude_deg));
      const dy = scene.py(mercatorY(one.second_latitude_deg));
      // To the positions of closest approach, and between them.
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
      for (const [x, y] of [[cx, cy], [dx, dy]] as const) {
        context.moveTo(x - 3, y - 3);
        context.lineTo(x + 3, y + 3);
        context.moveTo(x + 3, y - 3);
        context.lineTo(x - 3, y + 3);
      }
      context.stroke();
      const probability = probabilityOf(one);
      const heights = one.vertical_separation_m === null ? ", height unknown" : "";
      const text = `${distance(one.distance_m, view.units)} in ${Math.round(left)} s, ${percent(probability)}${heights}`;
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
}

function percent(probability: number): string {
  if (probability < 0.01) return "< 1 %";
  return probability > 0.99 ? "> 99 %" : `${Math.round(100 * probability)} %`;
}

function here(scene: Scene, track: Track): [number, number] {
  const [x, y] = scene.store.placeOf(track, scene.timeS);
  return [scene.px(x), scene.py(y)];
}
