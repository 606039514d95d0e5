/** Says where the bias switch can be seen: far out the plots move by less than their marks are wide. */

import { html, nothing, type TemplateResult } from "lit";

import { scaleAt } from "../drawing/mercator";
import { distance } from "../view/units";
import type { App } from "./panel";

/** Less cannot be seen, pixels. */
const SEEN_PX = 6;
/** The hint is shown so long after the switch, ms. */
const SHOWN_MS = 60_000;
/** A typical shift is so long after "Zoom to an aircraft", pixels. */
const CLOSE_PX = 25;

export class BiasHint {
  private sinceMs = -Infinity;

  /** The switch was used. */
  switched(): void {
    this.sinceMs = performance.now();
  }

  /** Until the switch is used again. */
  private close(app: App): void {
    this.sinceMs = -Infinity;
    app.actions.changed();
  }

  draw(app: App): TemplateResult | typeof nothing {
    if (performance.now() - this.sinceMs > SHOWN_MS || !app.view.shown.plots) return nothing;
    const most = mostMoved(app);
    if (most === null) return nothing;
    const perMetre = app.picture.scene.a * scaleAt(app.picture.latitude);
    if (most.metres * perMetre >= SEEN_PX) return nothing;
    return html`<p class="note" role="status">The biases of ${most.sensor} move its plots by ${distance(most.metres, app.view.units)}, those of
      other sensors by less: too little to be visible at this zoom.
      <button type="button" @click=${() => {
        zoom(app, most);
        this.close(app);
      }}>Zoom to an aircraft</button>
      <button type="button" @click=${() => this.close(app)}>Close</button></p>`;
  }
}

interface Moved {
  sensor: string;
  number: number;
  /** Median distance between the measured and the corrected positions of its plots. */
  metres: number;
}

/** The sensor shown whose plots the biases move most; null where they move none. */
function mostMoved({ store, picture, view }: App): Moved | null {
  const { plots } = store;
  const shifts = new Map<number, number[]>();
  for (let number = plots.first; number < plots.last; number++) {
    const at = plots.slot(number);
    const sensor = plots.sensor[at] ?? -1;
    if (view.hiddenSensors.has(store.sensors[sensor] ?? "")) continue;
    const shift = Math.hypot((plots.correctedX[at] ?? NaN) - (plots.x[at] ?? NaN), (plots.correctedY[at] ?? NaN) - (plots.y[at] ?? NaN));
    if (!shifts.has(sensor)) shifts.set(sensor, []);
    if (Number.isFinite(shift)) shifts.get(sensor)?.push(shift);
  }
  let most: Moved | null = null;
  for (const [number, of] of shifts) {
    of.sort((a, b) => a - b);
    const metres = (of[Math.floor(of.length / 2)] ?? 0) / scaleAt(picture.latitude);
    if (metres > (most?.metres ?? 0)) most = { sensor: store.sensors[number] ?? "", number, metres };
  }
  return most;
}

/** Show a plot of the sensor, of the selected track or of the one with plots of most sensors, so close that its shift is seen. */
function zoom(app: App, { number: sensor, metres }: Moved): void {
  const { actions, picture, store, view } = app;
  const { plots } = store;
  const seen = new Map<number, Set<number>>();
  const last = new Map<number, number>();
  for (let number = plots.first; number < plots.last; number++) {
    const at = plots.slot(number);
    const track = plots.track[at] ?? 0;
    if (store.track(track) === undefined) continue;
    if (!seen.has(track)) seen.set(track, new Set());
    seen.get(track)?.add(plots.sensor[at] ?? 0);
    if (plots.sensor[at] === sensor) last.set(track, at);
  }
  const sensors = (id: number): number => seen.get(id)?.size ?? 0;
  const most = [...last.keys()].reduce<number | null>((best, one) => (sensors(one) > sensors(best ?? -1) ? one : best), null);
  const id = view.selected !== null && last.has(view.selected) ? view.selected : most;
  const at = last.get(id ?? NaN);
  if (id === null || at === undefined) return;
  picture.zoomTo(CLOSE_PX / metres);
  picture.goTo([((plots.x[at] ?? 0) + (plots.correctedX[at] ?? 0)) / 2, ((plots.y[at] ?? 0) + (plots.correctedY[at] ?? 0)) / 2]);
  actions.select(id, false);
}
