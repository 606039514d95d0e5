/** The selected track: its past ten minutes and its forecast. */

import { FONT } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import { scaleAt } from "../drawing/mercator";
import { touches } from "./sites";

/** Distance of the sentence from the lower left corner. */
const CORNER_PX = 14;
const LETTER_PX = 6.7;
/** Regions that are larger, relative to the smaller side of the map, hide what they are about. */
const REGION_MAX = 0.4;
/** Regions are drawn so far apart, s: more would hide each other. */
const REGIONS_S = 60;

interface Place {
  x: number;
  y: number;
}

/** The path, with a mark and its age at each minute. */
export class PastLayer implements Layer {
  readonly plane = "ground";

  draw(scene: Scene): void {
    const { context, palette, selection } = scene;
    if (selection.past.length === 0) return;
    context.strokeStyle = palette.selected;
    context.fillStyle = palette.selected;
    context.font = `11px ${FONT}`;
    context.lineWidth = 1;
    context.globalAlpha = 0.8;
    context.beginPath();
    for (const point of selection.past) context.lineTo(scene.px(point.x), scene.py(point.y));
    this.join(scene);
    context.stroke();
    let minute = Infinity;
    let before = selection.past[0];
    for (const point of selection.past) {
      const age = Math.floor((scene.timeS - point.timeS) / 60);
      // The picture may be a little behind the past of the track: there is no minute 0.
      if (age < minute && minute !== Infinity && age >= 0) {
        const [x, y] = [Math.round(scene.px(point.x)), Math.round(scene.py(point.y))];
        context.fillRect(x - 2, y - 2, 5, 5);
        // Far out the minutes are closer than their names.
        const width = 6 * LETTER_PX + 4;
        const [left, top] = isAcross(before, point) ? [x - Math.round(width / 2), y - 18] : [x + 4, y - 7];
        if (!touches(scene.reserved, left, top, width, 14)) {
          context.fillText(`−${age + 1} min`, left + 2, top + 11);
          scene.reserved.push(left, top, width, 14);
        }
        scene.reserved.push(x - 2, y - 2, 5, 5);
      }
      [minute, before] = [age, point];
    }
    context.globalAlpha = 1;
  }

  /** The past is read every few seconds: what the frames brought since then leads to the symbol. */
  private join(scene: Scene): void {
    const track = scene.store.track(scene.view.selected);
    const endS = scene.selection.past.at(-1)?.timeS ?? Infinity;
    if (track === undefined || !(track.timeS > endS)) return;
    for (const slot of track.trail.after(endS)) {
      scene.context.lineTo(scene.px(track.trail.x[slot] ?? NaN), scene.py(track.trail.y[slot] ?? NaN));
    }
    scene.context.lineTo(scene.px(track.x), scene.py(track.y));
  }
}

/** Whether the path runs more to the east or west, so that what stands beside a point would be on it. */
function isAcross(from: Place | undefined, to: Place): boolean {
  return from !== undefined && Math.abs(to.x - from.x) > Math.abs(to.y - from.y);
}

/** The predicted path, with the region and the name of each minute. */
export class ForecastLayer implements Layer {
  readonly plane = "ground";
  /** The sentence on the canvas, for tests. */
  text = "";
  /** Names of the regions on the canvas, and how many are too large, for tests. */
  names: string[] = [];
  large = 0;

  draw(scene: Scene): void {
    const { context, palette, selection } = scene;
    context.strokeStyle = palette.selected;
    context.fillStyle = palette.selected;
    context.font = `11px ${FONT}`;
    context.lineWidth = 1;
    context.globalAlpha = 0.6;
    [this.names, this.large] = [[], 0];
    const most = REGION_MAX * Math.min(scene.width, scene.height);
    const [first] = selection.forecast;
    context.beginPath();
    for (const point of selection.forecast) context.lineTo(scene.px(point.x), scene.py(point.y));
    context.stroke();
    for (const point of selection.forecast) {
      const ahead = Math.round(point.timeS - (first?.timeS ?? 0));
      if (ahead === 0 || ahead % REGIONS_S !== 0) continue;
      const perMetre = scaleAt(point.latitude) * scene.a;
      const [x, y] = [scene.px(point.x), scene.py(point.y)];
      const [major, minor, turned] = [point.majorM * perMetre, point.minorM * perMetre, ((point.azimuthDeg - 90) * Math.PI) / 180];
      if (major > most) {
        this.large += 1;
        continue;
      }
      context.beginPath();
      context.ellipse(x, y, major, minor, turned, 0, 2 * Math.PI);
      context.stroke();
      const name = `+${ahead / 60} min`;
      this.names.push(name);
      // Above its region.
      const top = Math.round(y - Math.hypot(major * Math.sin(turned), minor * Math.cos(turned))) - 3;
      const box = [x - (LETTER_PX * name.length) / 2 - 2, top - 10, LETTER_PX * name.length + 4, 13] as const;
      if (touches(scene.reserved, ...box)) continue;
      context.fillText(name, Math.round(x - (LETTER_PX * name.length) / 2), top);
      scene.reserved.push(...box);
    }
    context.globalAlpha = 1;
    this.text = selection.forecast.length === 0 ? "" : heldText(scene.feed.statusShown);
    if (this.text === "") return;
    const whole = `Forecast regions: ${this.text}${this.large === 0 ? "" : `; ${this.names.length === 0 ? "" : "the last one "}too large for this zoom`}`;
    context.fillText(whole, CORNER_PX, scene.height - CORNER_PX);
    scene.reserved.push(CORNER_PX - 2, scene.height - CORNER_PX - 11, LETTER_PX * whole.length + 4, 15);
  }
}

/** What the regions promise and what they held, as the service counts it. */
export function heldText(status: Record<string, unknown>): string {
  const number = (name: string): number => Number(status[name] ?? 0);
  const [counted, held] = [number("forecasts_counted"), number("forecasts_held")];
  const nominal = `nominal ${Math.round(100 * number("forecast_probability"))} %`;
  if (counted === 0) return `${nominal}, not calibrated yet`;
  return `containment ${((100 * held) / counted).toFixed(1)} % (${nominal})`;
}
