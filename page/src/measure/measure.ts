/**
 * The measuring line: true bearing, distance, and time at the speed of the selected track.
 *
 * With a pointer: the first click or tap is the start, the second the end. With keys: `x` starts at the selected
 * track or in the middle of the map, the arrows move the map below the end, Enter sets it.
 */

import DoubleClickZoom from "ol/interaction/DoubleClickZoom";
import { fromLonLat, toLonLat } from "ol/proj";

import { FONT } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import type { App } from "../panels/panel";
import { distance, heading } from "../view/units";
import type { ViewState } from "../view/view";
import { between, inverse, type Line } from "./geodesic";

const STEPS = 32;
const TENTH = 10;

type Place = readonly [number, number];

export class Measure implements Layer {
  readonly plane = "moving";
  active = false;
  start: Place | null = null;
  end: Place | null = null;
  /** Whether the end follows the pointer or the middle of the map. */
  following = false;
  /** The line, and in words; empty without one. */
  line: Line | null = null;
  text = "";
  private speedMps = NaN;

  /** Begin by key or button, or end. */
  toggle(app: App): void {
    if (this.active) {
      this.stop(app);
      return;
    }
    this.activate(true, app);
    const track = app.store.track(app.view.selected);
    if (track !== undefined) {
      this.begin([track.longitude, track.latitude], app);
      this.move(middle(app), app);
    }
    app.actions.changed();
  }

  stop(app: App): void {
    this.activate(false, app);
    [this.start, this.end, this.following, this.line, this.text] = [null, null, false, null, ""];
    app.actions.changed();
  }

  /** Set the start or the end. @returns whether it was measured. */
  click(place: Place, app: App): boolean {
    if (!this.active) return false;
    if (this.start === null || !this.following) this.begin(place, app);
    else {
      this.move(place, app);
      this.following = false;
    }
    app.actions.changed();
    return true;
  }

  /** Enter: as a click in the middle of the map. */
  enter(app: App): void {
    if (!this.active) return;
    if (this.start !== null && this.following && this.end !== null) this.following = false;
    else this.begin(middle(app), app);
    app.actions.changed();
  }

  /** The pointer or the map moved. */
  move(place: Place, app: App): void {
    if (!this.following || this.start === null) return;
    this.end = place;
    const track = app.store.track(app.view.selected);
    this.speedMps = track?.speedMps ?? NaN;
    this.line = inverse(this.start, place);
    this.text = described(this.line, this.speedMps, app.view);
    app.picture.touch();
  }

  draw(scene: Scene): void {
    if (this.start === null || this.end === null || this.line === null) return;
    const { context, palette } = scene;
    this.text = described(this.line, this.speedMps, scene.view);
    context.strokeStyle = palette.selected;
    context.fillStyle = palette.selected;
    context.lineWidth = 1.5;
    context.setLineDash([6, 4]);
    context.beginPath();
    let last: [number, number] = [0, 0];
    for (const place of between(this.start, this.end, STEPS)) {
      const [x, y] = fromLonLat(place) as [number, number];
      last = [scene.px(x), scene.py(y)];
      context.lineTo(...last);
    }
    context.stroke();
    context.setLineDash([]);
    context.font = `12px ${FONT}`;
    const width = context.measureText(this.text).width;
    const left = Math.max(2, Math.min(last[0] + 8, scene.width - width - 10));
    const top = Math.max(18, Math.min(last[1] - 8, scene.height - 6));
    context.fillStyle = palette.background;
    context.fillRect(left - 3, top - 13, width + 6, 18);
    context.fillStyle = palette.selected;
    context.fillText(this.text, left, top);
  }

  /** While it measures, two quick clicks are not a zoom. */
  private activate(active: boolean, app: App): void {
    this.active = active;
    for (const one of app.picture.map.getInteractions().getArray()) {
      if (one instanceof DoubleClickZoom) one.setActive(!active);
    }
  }

  private begin(place: Place, app: App): void {
    this.start = place;
    this.following = true;
    this.move(place, app);
  }
}

export function middle(app: App): Place {
  const centre = app.picture.map.getView().getCenter() ?? [0, 0];
  const [longitude, latitude] = toLonLat(centre);
  return [longitude ?? 0, latitude ?? 0];
}

/** Connect the line with the map. */
export function attach(measure: Measure, app: App): void {
  const { map } = app.picture;
  const placed = (coordinate: number[]): Place => {
    const [longitude, latitude] = toLonLat(coordinate);
    return [longitude ?? 0, latitude ?? 0];
  };
  app.picture.clicked = (coordinate) => measure.click(placed(coordinate), app);
  map.on("pointermove", (event) => {
    if (!event.dragging) measure.move(placed(event.coordinate), app);
  });
  // Keys move the map, not the pointer.
  map.on("moveend", () => {
    if (document.activeElement?.id === "map") measure.move(middle(app), app);
  });
}

function described(line: Line, speedMps: number, view: ViewState): string {
  const bearing = Number.isFinite(line.bearingDeg) ? `${heading(line.bearingDeg)} true` : "–";
  const parts = [bearing, distance(Math.round(line.metres * TENTH) / TENTH, view.units)];
  if (speedMps > 1) {
    const seconds = Math.round(line.metres / speedMps);
    parts.push(`${Math.floor(seconds / 60)} min ${String(seconds % 60).padStart(2, "0")} s`);
  }
  return parts.join("  ");
}
