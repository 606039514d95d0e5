/** The moving part of the map: sites, plots, tracks and labels on a canvas. */

import type { Sensor } from "./feed";
import type { Labels, Wanted } from "./labels";
import { destination, mercatorX, mercatorY, scaleAt } from "./mercator";
import type { ForecastPoint, Selection } from "./selection";
import { nameOf, PLOTS_KEPT_S, type Store, type Track } from "./store";
import { level, speed, trend, NAUTICAL_MILE_M } from "./units";
import type { ViewState } from "./view";

const LABELS_MAX = 400;
const VECTOR_S = 60;
const RING_NM = 50;
const UNCERTAINTY_SIGMAS = 3;
/** Colours of radars that also differ in hue for the colour-blind (Okabe and Ito, 2008). */
const SENSOR_COLOURS = ["#e69f00", "#56b4e9", "#cc79a7", "#009e73", "#f0e442", "#d55e00", "#0072b2", "#999999"];

interface Palette {
  background: string;
  land: string;
  border: string;
  track: string;
  faint: string;
  selected: string;
  label: string;
  uncertainty: string;
}

export const PALETTES: Record<ViewState["theme"], Palette> = {
  dark: {
    background: "#0b1418", land: "#16242a", border: "#3b525b", track: "#c9f2dc", faint: "#7f9aa3",
    selected: "#ffd24a", label: "#e6f3f4", uncertainty: "rgba(120, 200, 255, 0.16)",
  },
  light: {
    background: "#dfe9ee", land: "#fbfaf6", border: "#9fb0b8", track: "#0a5136", faint: "#61757d",
    selected: "#a84300", label: "#14262c", uncertainty: "rgba(0, 90, 170, 0.16)",
  },
};

/** The colour of a sensor, the same everywhere on the page. */
export function sensorColour(number: number): string {
  return SENSOR_COLOURS[number % SENSOR_COLOURS.length] ?? "#999999";
}

/** From map units to pixels: x = a X + e, y = d Y + f; and the size of the canvas. */
interface Place {
  a: number;
  d: number;
  e: number;
  f: number;
  width: number;
  height: number;
}

export interface SitePlace {
  x: number;
  y: number;
  sensor: Sensor;
  number: number;
}

/** One drawing of the canvas. */
export class Drawing {
  private readonly timeS: number;

  constructor(
    private readonly context: CanvasRenderingContext2D,
    private readonly place: Place,
    private readonly palette: Palette,
    private readonly view: ViewState,
    private readonly store: Store,
  ) {
    this.timeS = store.timeAt(performance.now());
  }

  all(
    sites: SitePlace[],
    labels: Labels,
    seen: { id: number; x: number; y: number }[],
    selection: Selection,
    corrected: number,
  ): void {
    const { shown } = this.view;
    if (shown.sites) for (const site of sites) this.site(site);
    this.past(selection);
    this.forecast(selection.forecast);
    if (shown.plots) this.plots(corrected);
    seen.length = 0;
    const wanted: Wanted[] = [];
    this.context.font = "12px ui-monospace, monospace";
    for (const track of this.store.tracks) {
      if (!isShown(track, this.view)) continue;
      const ahead = this.store.ahead(track, this.timeS);
      const x = this.px(track.x + track.vx * ahead);
      const y = this.py(track.y + track.vy * ahead);
      if (x < -50 || y < -50 || x > this.place.width + 50 || y > this.place.height + 50) continue;
      seen.push({ id: track.id, x, y });
      this.track(track, x, y);
      if (shown.labels) wanted.push(this.wanted(track, x, y));
    }
    const at = new Map(seen.map((one) => [one.id, one]));
    for (const one of labels.place(wanted, LABELS_MAX, this.place.width, this.place.height)) {
      const [track, symbol] = [this.store.track(one.id), at.get(one.id)];
      if (track !== undefined && symbol !== undefined) this.label(track, one.x, one.y, symbol, one.leader);
    }
  }

  private px(x: number): number {
    return this.place.a * x + this.place.e;
  }

  private py(y: number): number {
    return this.place.d * y + this.place.f;
  }

  private site(site: SitePlace): void {
    const { context } = this;
    const { latitude_deg: latitude, longitude_deg: longitude, range_max_m: end } = site.sensor;
    const colour = sensorColour(site.number);
    context.strokeStyle = colour;
    context.fillStyle = colour;
    const [x, y] = [this.px(site.x), this.py(site.y)];
    context.globalAlpha = 0.28;
    context.lineWidth = 1;
    if (latitude !== null && longitude !== null) {
      for (let ring = 1; ring * RING_NM * NAUTICAL_MILE_M <= (end ?? 250_000); ring++) {
        context.beginPath();
        for (let azimuth = 0; azimuth <= 360; azimuth += 5) {
          const point = destination(latitude, longitude, azimuth, ring * RING_NM * NAUTICAL_MILE_M);
          context.lineTo(this.px(mercatorX(point[0])), this.py(mercatorY(point[1])));
        }
        context.stroke();
      }
    }
    context.globalAlpha = 1;
    context.beginPath();
    context.moveTo(x, y - 7);
    context.lineTo(x + 6, y + 5);
    context.lineTo(x - 6, y + 5);
    context.closePath();
    context.fill();
    context.fillStyle = this.palette.label;
    context.font = "11px ui-monospace, monospace";
    context.fillText(site.sensor.id, x + 9, y + 6);
  }

  private plots(corrected: number): void {
    const { context } = this;
    for (const plot of this.store.plots) {
      const px = this.px(plot.x + corrected * (plot.correctedX - plot.x));
      const py = this.py(plot.y + corrected * (plot.correctedY - plot.y));
      if (px < 0 || py < 0 || px > this.place.width || py > this.place.height) continue;
      const age = (this.timeS - plot.timeS) / PLOTS_KEPT_S;
      context.globalAlpha = Math.max(0.35, 1 - age);
      context.strokeStyle = sensorColour(plot.sensor);
      context.lineWidth = 1.6;
      mark(context, plot.sensor, px, py, plot.track === this.view.selected ? 1.6 : 1);
    }
    context.globalAlpha = 1;
  }

  /** The path of the selected track, with a mark and its age at each minute. */
  private past(selection: Selection): void {
    const { context, palette } = this;
    if (selection.past.length === 0) return;
    context.strokeStyle = palette.selected;
    context.fillStyle = palette.selected;
    context.font = "11px ui-monospace, monospace";
    context.lineWidth = 1.2;
    context.globalAlpha = 0.75;
    context.beginPath();
    for (const point of selection.past) context.lineTo(this.px(point.x), this.py(point.y));
    context.stroke();
    let minute = Infinity;
    for (const point of selection.past) {
      const age = Math.floor((this.timeS - point.timeS) / 60);
      if (age < minute && minute !== Infinity) {
        const [x, y] = [this.px(point.x), this.py(point.y)];
        context.fillRect(x - 2.5, y - 2.5, 5, 5);
        context.fillText(`−${age + 1} min`, x + 6, y + 4);
      }
      minute = age;
    }
    context.globalAlpha = 1;
  }

  /** The forecast of the selected track with its regions. */
  private forecast(points: ForecastPoint[]): void {
    const { context, palette } = this;
    context.strokeStyle = palette.selected;
    context.lineWidth = 1;
    context.globalAlpha = 0.6;
    for (const point of points) {
      const perMetre = scaleAt(point.latitude) * this.place.a;
      context.beginPath();
      context.ellipse(
        this.px(point.x), this.py(point.y), point.majorM * perMetre, point.minorM * perMetre,
        ((point.azimuthDeg - 90) * Math.PI) / 180, 0, 2 * Math.PI,
      );
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  private track(track: Track, x: number, y: number): void {
    const { context, palette, view } = this;
    const selected = track.id === view.selected;
    const colour = selected ? palette.selected : track.state === "confirmed" ? palette.track : palette.faint;
    if (view.shown.uncertainty && Number.isFinite(track.sigmaM)) {
      const radius = UNCERTAINTY_SIGMAS * track.sigmaM * track.scale * this.place.a;
      if (radius > 3) {
        context.fillStyle = palette.uncertainty;
        context.beginPath();
        context.arc(x, y, radius, 0, 2 * Math.PI);
        context.fill();
      }
    }
    if (view.shown.trails) {
      context.fillStyle = palette.faint;
      for (const point of track.trail) {
        context.fillRect(this.px(point.x) - 1, this.py(point.y) - 1, 2, 2);
      }
    }
    context.strokeStyle = colour;
    context.fillStyle = colour;
    context.lineWidth = selected ? 2 : 1.2;
    if (view.shown.vectors && (track.vx !== 0 || track.vy !== 0)) {
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + this.place.a * track.vx * VECTOR_S, y + this.place.d * track.vy * VECTOR_S);
      context.stroke();
    }
    symbol(context, track, x, y);
    if (selected) {
      context.beginPath();
      context.arc(x, y, 11, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  private wanted(track: Track, x: number, y: number): Wanted {
    const lines = labelLines(track, this.view);
    const width = 7.3 * Math.max(...lines.map((line) => line.length));
    const selected = track.id === this.view.selected ? 1e6 : 0;
    const state = track.state === "confirmed" ? 1000 : track.state === "coasting" ? 500 : 0;
    return { id: track.id, x, y, width, height: 13 * lines.length, priority: selected + state + Math.min(track.speedMps || 0, 400) };
  }

  private label(track: Track, x: number, y: number, symbol: { x: number; y: number }, leader: boolean): void {
    const { context, palette } = this;
    const lines = labelLines(track, this.view);
    context.fillStyle = track.id === this.view.selected ? palette.selected : palette.label;
    context.globalAlpha = track.state === "tentative" ? 0.7 : 1;
    lines.forEach((line, number) => context.fillText(line, x, y - 13 * (lines.length - 1 - number) - 3));
    if (leader) {
      context.strokeStyle = palette.faint;
      context.lineWidth = 0.7;
      context.beginPath();
      context.moveTo(symbol.x, symbol.y);
      context.lineTo(x > symbol.x ? x - 2 : x + 7.3 * Math.max(...lines.map((line) => line.length)), y - 6);
      context.stroke();
    }
    context.globalAlpha = 1;
  }
}

/** Whether the switches and the filter show a track. */
export function isShown(track: Track, view: ViewState): boolean {
  if (track.state === "tentative" && !view.shown.tentative) return false;
  if (track.onGround && !view.shown.ground) return false;
  return matches(track, view.filter);
}

export function matches(track: Track, filter: string): boolean {
  const wanted = filter.trim().toUpperCase();
  if (wanted === "") return true;
  return [track.callsign, track.code, track.address, String(track.id)].some(
    (text) => text !== null && text.toUpperCase().includes(wanted),
  );
}

function labelLines(track: Track, view: ViewState): string[] {
  return [nameOf(track), `${track.onGround ? "GND" : level(track.heightM, view.units)}${trend(track.climbMps)} ${speed(track.speedMps, view.units)}`];
}

/** Confirmed: filled; tentative: open; coasting: a cross; on the ground: a square. */
function symbol(context: CanvasRenderingContext2D, track: Track, x: number, y: number): void {
  context.beginPath();
  if (track.state === "coasting") {
    context.moveTo(x - 5, y - 5);
    context.lineTo(x + 5, y + 5);
    context.moveTo(x + 5, y - 5);
    context.lineTo(x - 5, y + 5);
    context.stroke();
    return;
  }
  if (track.onGround) context.rect(x - 4, y - 4, 8, 8);
  else context.arc(x, y, 4, 0, 2 * Math.PI);
  if (track.state === "confirmed") context.fill();
  else context.stroke();
}

/** The mark of a sensor's plots: its shape differs, as its colour does. */
function mark(context: CanvasRenderingContext2D, sensor: number, x: number, y: number, size: number): void {
  const [small, large] = [2.6 * size, 3.5 * size];
  context.beginPath();
  switch (sensor % 4) {
    case 0:
      context.moveTo(x - large, y);
      context.lineTo(x + large, y);
      context.moveTo(x, y - large);
      context.lineTo(x, y + large);
      break;
    case 1:
      context.rect(x - small, y - small, 2 * small, 2 * small);
      break;
    case 2:
      context.moveTo(x, y - large);
      context.lineTo(x + large, y + small);
      context.lineTo(x - large, y + small);
      context.closePath();
      break;
    default:
      context.arc(x, y, 2.8 * size, 0, 2 * Math.PI);
  }
  context.stroke();
}
