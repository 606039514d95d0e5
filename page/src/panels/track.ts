/** The sheet of the selected track. */

import { html, type TemplateResult } from "lit";

import type { Store, Track } from "../store";
import { climb, distance, heading, level, speed } from "../units";
import type { App, Panel } from "./panel";

export const trackPanel: Panel = { id: "sheet", title: "Selected track", draw };

function draw({ store, view, actions }: App): TemplateResult {
  const track = store.track(view.selected);
  if (view.selected === null) return html`<p class="hint">Select a track on the map or in the table.</p>`;
  if (track === undefined) return html`<p class="hint">Track ${view.selected} has ended.</p>`;
  const { units } = view;
  const rows: [string, string][] = [
    ["Track number", String(track.id)],
    ["State", `${track.state}${track.onGround ? ", on the ground" : ""}`],
    ["Callsign", track.callsign ?? "–"],
    ["Mode 3/A", track.code ?? "–"],
    ["Mode S address", track.address ?? "–"],
    ["Position", `${track.latitude.toFixed(4)}, ${track.longitude.toFixed(4)}`],
    ["Position sigma", distance(track.sigmaM, units)],
    ["Level", level(track.heightM, units)],
    ["Vertical rate", climb(track.climbMps, units)],
    ["Speed", speed(track.speedMps, units)],
    ["Heading", heading(track.headingDeg)],
    ["Last plot", `${track.ageS.toFixed(1)} s ago`],
    ["Plots in 30 s", plotsOf(track, store)],
  ];
  return html`<dl>${rows.map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}</dl>
    <p><button type="button" @click=${() => actions.show(track.id)}>Centre</button>
    <button type="button" @click=${() => actions.select(null)}>Deselect (Esc)</button></p>`;
}

function plotsOf(track: Track, store: Store): string {
  const counts = new Map<string, number>();
  for (const plot of store.plots) {
    if (plot.track !== track.id) continue;
    const name = store.sensors[plot.sensor] ?? "?";
    counts.set(name, (counts.get(name) ?? 0) + 1);
  }
  return [...counts].map(([name, count]) => `${name}: ${count}`).join(", ") || "none";
}
