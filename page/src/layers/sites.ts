/** Radars with their range rings, and direction finders. */

import { FONT, sensorColour } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import type { Sensor } from "../service/feed";
import { bySeverity, wordOf } from "../sky/severity";
import type { Store } from "../sky/store";
import { destination, mercatorX, mercatorY } from "../drawing/mercator";
import { NAUTICAL_MILE_M, type Units } from "../view/units";

const RING_NM = 50;
/** Range of a radar without a configured one, m. */
export const RANGE_ASSUMED_M = 250_000;
const STEP_DEG = 5;
/** Distances on smaller rings would crowd, pixels. */
const RING_NAMED_PX = 40;
/** Width of a letter of a name. */
const NAME_PX = 6.7;

/** A radar or direction finder on the map. */
export interface Site {
  sensor: Sensor;
  /** What is wrong with it, in a word; empty: nothing. */
  word: string;
  x: number;
  y: number;
  /** Points of its rings in map units: x, y, x, y, …; one array each. */
  rings: Float64Array[];
}

/** The distance of a ring, by its number. */
function ringName(number: number, units: Units): string {
  const miles = RING_NM * (number + 1);
  return units === "aero" ? `${miles} NM` : `${Math.round((miles * NAUTICAL_MILE_M) / 1000)} km`;
}

/** Radars and direction finders with a known site; rings are computed when the sensors change. */
export class Sites {
  private of: Sensor[] | null = null;
  private plotted = "";
  private found: Site[] = [];

  all({ feed: { sensors }, store, silentS }: Pick<Scene, "feed" | "store" | "silentS">): Site[] {
    const plotted = `${silentS === 0} ${sensors.map((one) => (store.hasPlots(one.id) ? "p" : store.hasBearings(one.id) ? "b" : "n")).join("")}`;
    if (sensors !== this.of || plotted !== this.plotted) {
      [this.of, this.plotted] = [sensors, plotted];
      this.found = bySeverity(sensors, store, { olderS: silentS, rejects: "" }).flatMap(({ sensor, severity }) => siteOf(sensor, wordOf(severity), store))
        .sort((a, b) => sensors.indexOf(a.sensor) - sensors.indexOf(b.sensor));
    }
    // A direction finder may move.
    for (const site of this.found) if (site.sensor.kind === "bearing") Object.assign(site, placeOf(site.sensor, store));
    return this.found;
  }
}

export class SitesLayer implements Layer {
  readonly plane = "ground";
  /** Distances on the canvas, for tests. */
  distances: string[] = [];
  /** Names on the canvas with what is wrong, for tests. */
  names: string[] = [];

  constructor(private readonly sites: Sites) {}

  draw(scene: Scene): void {
    const { context, palette, store, view } = scene;
    scene.reserved.length = 0;
    scene.reservations += 1;
    this.distances.length = 0;
    // The buttons of the zoom.
    scene.reserved.push(0, 0, scene.controlX, scene.controlY);
    if (!view.shown.sites) return;
    context.lineWidth = 1;
    context.font = `11px ${FONT}`;
    const named = new Map<string, { x: number; y: number; sites: Site[] }>();
    for (const site of this.sites.all(scene)) {
      if (view.hiddenSensors.has(site.sensor.id)) continue;
      const colour = sensorColour(store.sensors.indexOf(site.sensor.id), palette);
      context.strokeStyle = colour;
      context.fillStyle = colour;
      context.globalAlpha = 0.22;
      for (const ring of site.rings) {
        context.beginPath();
        for (let at = 0; at < ring.length; at += 2) context.lineTo(scene.px(ring[at] ?? 0), scene.py(ring[at + 1] ?? 0));
        context.stroke();
      }
      context.globalAlpha = 1;
      const [x, y] = [Math.round(scene.px(site.x)), Math.round(scene.py(site.y))];
      context.beginPath();
      context.moveTo(x, y - 6);
      context.lineTo(x + 5.5, y + 4);
      context.lineTo(x - 5.5, y + 4);
      context.closePath();
      if (site.sensor.kind === "bearing") context.stroke();
      else context.fill();
      const key = `${x} ${y}`;
      const together = named.get(key);
      if (together === undefined) named.set(key, { x, y, sites: [site] });
      else together.sites.push(site);
    }
    this.names.length = 0;
    for (const { x, y } of named.values()) scene.reserved.push(x - 7, y - 7, 14, 13);
    // Sites with a fault first: far out there is no room for all names.
    const groups = [...named.values()].sort((one, other) => Number(isFaulty(other.sites)) - Number(isFaulty(one.sites)));
    for (const { x, y, sites } of groups) this.name(scene, x, y, sites);
    this.nameRings(scene);
  }

  /** Write the names of the sensors of a site as one text, beside the site where there is room. */
  private name(scene: Scene, x: number, y: number, sites: readonly Site[]): void {
    const { context, palette } = scene;
    const texts = sites.flatMap(({ sensor, word }, number): [string, string][] => [
      [`${number > 0 ? ", " : ""}${sensor.id}`, palette.label], ...(word === "" ? [] : [[` ${word}`, palette.warning] as [string, string]]),
    ]);
    const width = NAME_PX * texts.reduce((letters, [text]) => letters + text.length, 0) + 4;
    const places = [[x + 8, y - 6], [x - 8 - width, y - 6], [x - width / 2, y + 7], [x - width / 2, y - 21]] as const;
    const place = places.find(([left, top]) => !touches(scene.reserved, left, top, width, 14));
    if (place === undefined) return;
    const [left, top] = place;
    let letters = 0;
    for (const [text, colour] of texts) {
      context.fillStyle = colour;
      context.fillText(text, Math.round(left) + 1 + NAME_PX * letters, top + 11);
      letters += text.length;
    }
    scene.reserved.push(left, top, width, 14);
    this.names.push(...sites.map(({ sensor, word }) => `${sensor.id} ${word}`.trim()));
  }

  /** Write the distance of each ring on its north, where nothing else stands. */
  private nameRings(scene: Scene): void {
    const { context, palette, store, view } = scene;
    for (const site of this.sites.all(scene)) {
      if (view.hiddenSensors.has(site.sensor.id)) continue;
      context.fillStyle = sensorColour(store.sensors.indexOf(site.sensor.id), palette);
      const centre = scene.py(site.y);
      site.rings.forEach((ring, number) => {
        const [x, y] = [Math.round(scene.px(ring[0] ?? 0)), Math.round(scene.py(ring[1] ?? 0))];
        const text = ringName(number, view.units);
        const width = NAME_PX * text.length + 4;
        const [left, top] = [x - width / 2, y - 13];
        if (!scene.isInside(x, y, 0) || centre - y < RING_NAMED_PX || touches(scene.reserved, left, top, width, 13)) return;
        context.fillText(text, left + 2, y - 3);
        scene.reserved.push(left, top, width, 13);
        this.distances.push(text);
      });
    }
  }
}

function isFaulty(sites: readonly Site[]): boolean {
  return sites.some(({ word }) => word !== "");
}

/** Whether a box touches one of some: left, top, width, height, … */
export function touches(boxes: readonly number[], left: number, top: number, width: number, height: number): boolean {
  for (let at = 0; at < boxes.length; at += 4) {
    const [x, y, w, h] = [boxes[at] ?? 0, boxes[at + 1] ?? 0, boxes[at + 2] ?? 0, boxes[at + 3] ?? 0];
    if (left < x + w && x < left + width && top < y + h && y < top + height) return true;
  }
  return false;
}

/** Where a sensor is in map units: that of its last bearing, or its configured site. */
function placeOf({ id, kind, latitude_deg: latitude, longitude_deg: longitude }: Sensor, store: Store): { x: number; y: number } | null {
  const source = kind === "bearing" ? store.sourceOf(id) : undefined;
  if (source !== undefined) return { x: source.x, y: source.y };
  return latitude === null || longitude === null ? null : { x: mercatorX(longitude), y: mercatorY(latitude) };
}

function siteOf(sensor: Sensor, word: string, store: Store): Site[] {
  const { latitude_deg: latitude, longitude_deg: longitude, range_max_m: end, kind } = sensor;
  const place = placeOf(sensor, store);
  if (place === null || kind === "position") return [];
  const rings: Float64Array[] = [];
  if (kind !== "radar" || latitude === null || longitude === null) return [{ sensor, word, ...place, rings }];
  for (let metres = RING_NM * NAUTICAL_MILE_M; metres <= (end ?? RANGE_ASSUMED_M); metres += RING_NM * NAUTICAL_MILE_M) {
    const points = [];
    for (let azimuth = 0; azimuth <= 360; azimuth += STEP_DEG) {
      const [east, north] = destination(latitude, longitude, azimuth, metres);
      points.push(mercatorX(east), mercatorY(north));
    }
    rings.push(Float64Array.from(points));
  }
  return [{ sensor, word, ...place, rings }];
}
