/** The switches of what the map shows. */

import { html } from "lit";

import { SWITCHES } from "../view";
import type { Panel } from "./panel";
import { swatch } from "./swatch";

export const switchPanel: Panel = {
  id: "switches",
  title: "Layers",
  tab: "map",
  always: true,
  draw: (app) => html`<ul class="switches">${SWITCHES.map(([name, key, text]) => html`
    <li class=${name}><label><input type="checkbox" .checked=${app.view.shown[name]}
      @change=${() => app.actions.toggle(name)}> ${text} <kbd>${key}</kbd></label></li>`)}</ul>
    <ul class="switches sensors" aria-label="Plots of sensors">${app.store.sensors.map((id) => html`
      <li><label><input type="checkbox" .checked=${!app.view.hiddenSensors.has(id)}
        @change=${() => {
          if (!app.view.hiddenSensors.delete(id)) app.view.hiddenSensors.add(id);
          app.actions.changed();
        }}> ${swatch(id, app)}${id}</label></li>`)}</ul>`,
};
