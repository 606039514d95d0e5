/** The switches of what the map shows. */

import { html } from "lit";

import { sensorColour } from "../drawing/palette";
import { SWITCHES } from "../view";
import type { Panel } from "./panel";

export const switchPanel: Panel = {
  id: "switches",
  title: "Show",
  draw: ({ view, actions, store }) => html`<ul class="switches">${SWITCHES.map(([name, key, text]) => html`
    <li class=${name}><label><input type="checkbox" .checked=${view.shown[name]}
      @change=${() => actions.toggle(name)}> ${text} <kbd>${key}</kbd></label></li>`)}</ul>
    <ul class="switches sensors" aria-label="Plots of sensors">${store.sensors.map((id, number) => html`
      <li><label><input type="checkbox" .checked=${!view.hiddenSensors.has(id)}
        @change=${() => {
          if (!view.hiddenSensors.delete(id)) view.hiddenSensors.add(id);
          actions.changed();
        }}> <svg class="swatch" viewBox="0 0 1 1" aria-hidden="true"><rect width="1" height="1" fill=${sensorColour(number)}></rect></svg>${id}</label></li>`)}</ul>`,
};
