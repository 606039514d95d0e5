/** Says where the bias switch can be seen: far out the plots move by less than their marks are wide. */

import { html, nothing, type TemplateResult } from "lit";

import { scaleAt } from "../drawing/mercator";
import { distance } from "../view/units";
import type { App } from "./panel";

/** Less cannot be seen, pixels. */
const SEEN_PX = 6;
/** The hint is shown so long after the switch, ms. */
const SHOWN_MS = 10_000;
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
    const metres = shiftM(app);
    const perMetre = app.picture.scene.a * scaleAt(app.picture.latitude);
    if (!(metres > 0) || metres * perMetre >= SEEN_PX) return nothing;
    return html`<p class="note" role="status">The biases move plots by ${distance(metres, app.view.units)}, too little to be visible at this zoom.
      <button type="button" @click=${() => {
        zoom(app, metres);
        this.close(app);
      }}>Zoom to an aircraft</button>
      <button type="button" @click=${() => this.close(app)}>Close</button></p>`;
  }
}

/** Median distance between the measured and the corrected positions, m; NaN without plots. */
function shiftM({ store, picture }: App): number {
  const { plots } = store;
  const shifts: number[] = [];
  for (let number = plots.first; number < plots.last; number++) {
    const at = plots.slot(number);
    shifts.push(Math.hypot((plots.correctedX[at] ?? NaN) - (plots.x[at] ?? NaN), (plots.correctedY[at] ?? NaN) - (plots.y[at] ?? NaN)));
  }
  shifts.sort((a, b) => a - b);
  return (shifts[Math.floor(shifts.length / 2)] ?? NaN) / scaleAt(picture.latitude);
}

/** Show the selected track, or the one with plots of most sensors, at a zoom where the shift is seen. */
function zoom(app: App, metres: number): void {
  const { actions, picture, store, view } = app;
  const seen = new Map<number, Set<number>>();
  for (let number = store.plots.first; number < store.plots.last; number++) {
    const at = store.plots.slot(number);
    const track = store.plots.track[at] ?? 0;
    if (!seen.has(track)) seen.set(track, new Set());
    seen.get(track)?.add(store.plots.sensor[at] ?? 0);
  }
  const sensors = (id: number): number => seen.get(id)?.size ?? 0;
  const most = store.tracks.reduce<number | null>((best, one) => (sensors(one.id) > sensors(best ?? -1) ? one.id : best), null);
  const id = store.track(view.selected)?.id ?? most;
  if (id === null) return;
  picture.zoomTo(CLOSE_PX / metres);
  actions.show(id);
}
