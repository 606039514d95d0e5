/** What lies on the map beside the tracks of the service: runs, and the user's own GeoJSON. */

import { html, nothing, type TemplateResult } from "lit";

import type { App, Panel } from "../panels/panel";
import { RUN_KEYS } from "../view/shown";
import { keyOf } from "./overlays";

/** The symbols of the chosen run and of the other one, as on the map. */
const FORMS = ["●", "▼"];

export const layersPanel: Panel = { id: "layers", title: "Runs and GeoJSON", tab: "map", draw };

function draw(app: App): TemplateResult {
  const { clock, overlays } = app;
  if (clock.runs.length < 2 && overlays.listed.length === 0) {
    return html`<p class="hint">No second run (<code>view RUN RUN</code>) and no GeoJSON overlays (<code>--overlays DIR</code>) are loaded.</p>`;
  }
  const runs = clock.runs.length < 2 ? [] : clock.runs.slice(0, RUN_KEYS.length);
  return html`<ul class="switches">
    ${runs.map((name, number) => box(app, RUN_KEYS[number] ?? "", html`<span aria-hidden="true">${
      FORMS[Number(number !== app.view.run)]}</span> ${name}`))}
    ${overlays.listed.map((one) => one.problem === ""
      ? box(app, keyOf(one), html`${one.name} <small>${one.features} ${one.features === 1 ? "feature" : "features"}</small>`)
      : html`<li class="alarm">${one.name} is not shown: ${one.problem}</li>`)}</ul>
    ${runs.length > 0 ? html`<p class="hint">Table, selection, search, plots and exports refer to ${runs[app.view.run]}. To switch to the other
      run, use <em>Run</em> in the Tracks tab, click one of its symbols, or hide this run.</p>` : nothing}`;
}

function box(app: App, key: string, text: TemplateResult): TemplateResult {
  return html`<li><label><input type="checkbox" .checked=${!app.view.hidden.has(key)}
    @change=${() => toggle(app, key)}> ${text}</label></li>`;
}

function toggle(app: App, key: string): void {
  const { hidden } = app.view;
  if (!hidden.delete(key)) hidden.add(key);
  app.overlays.apply();
  app.actions.changed();
}
