/** The switches of what the map shows. */

import { html, nothing, type TemplateResult } from "lit";

import type { Store } from "../sky/store";
import { SWITCHES } from "../view/view";
import type { App, Panel } from "./panel";
import { swatch } from "./swatch";

export const switchPanel: Panel = {
  id: "switches",
  title: "Layers",
  tab: "map",
  always: true,
  draw: (app) => html`<ul class="switches">${SWITCHES.map(([name, key, text]) => html`
    <li class=${name}><label><input type="checkbox" .checked=${app.view.shown[name]}
      @change=${() => app.actions.toggle(name)}> ${text} <kbd>${key}</kbd></label>${
        name === "encounters" ? html` <small>${app.encounters.drawn}</small>` : nothing}</li>`)}</ul>
    <h2>Sensors</h2>
    <ul class="switches sensors" aria-label="Plots by sensor">${app.store.sensors.map((id, number) => sensor(id, number, app))}</ul>
    <p class="hint">Each sensor is a layer with its plots, rings and sweep. To compare two sensors, show only these two, hide the tracks (<kbd>s</kbd>), and connect their plots with lines (<kbd>i</kbd>).</p>`,
};

function counted({ plots, bearings }: Store, number: number): string {
  const [placed, directed] = [plots.count(number), bearings.count(number)];
  return directed === 0 ? `${placed} plots` : placed === 0 ? `${directed} bearings` : `${placed} plots, ${directed} bearings`;
}

function sensor(id: string, number: number, app: App): TemplateResult {
  const { store, view, actions } = app;
  const alone = store.sensors.every((one) => (one === id) !== view.hiddenSensors.has(one));
  return html`<li><label><input type="checkbox" .checked=${!view.hiddenSensors.has(id)} @change=${() => {
      if (!view.hiddenSensors.delete(id)) view.hiddenSensors.add(id);
      actions.changed();
    }}> ${swatch(id, app)}${id}</label> <small>${counted(store, number)}</small>
    ${store.sensors.length === 1 ? nothing : html`<button type="button" aria-label=${alone ? "Show all sensors" : `Show only ${id}`} @click=${() => {
      view.hiddenSensors.clear();
      if (!alone) for (const one of store.sensors) if (one !== id) view.hiddenSensors.add(one);
      actions.changed();
    }}>${alone ? "All" : "Only"}</button>`}</li>`;
}
