/** The sensors: biases with two sigmas, alarms and their probable causes. */

import { html, nothing, type TemplateResult } from "lit";

import { sensorColour } from "../drawing/palette";
import type { Sensor } from "../feed";
import type { App, Panel } from "./panel";

export const sensorPanel: Panel = {
  id: "sensors",
  title: "Sensors",
  draw: (app) => html`${app.feed.sensors.map((sensor) => sheet(sensor, app))}`,
};

function sheet(sensor: Sensor, { store }: App): TemplateResult {
  const number = store.sensors.indexOf(sensor.id);
  const alarms = alarmsOf(sensor);
  return html`<details ?open=${alarms.length > 0}>
    <summary><svg class="swatch" viewBox="0 0 1 1" aria-hidden="true"><rect width="1" height="1" fill=${sensorColour(number)}></rect></svg>
      ${sensor.id} <small>${sensor.kind}, ${sensor.updates} updates${
        sensor.age_s === null ? ", nothing yet" : `, ${sensor.age_s.toFixed(0)} s ago`}</small>
      ${alarms.length > 0 ? html`<strong class="alarm">${alarms.join(", ")}</strong>` : nothing}</summary>
    ${sensor.diagnoses.map((one) => html`<p class="alarm">${one.sentence}</p>`)}
    ${sensor.biases.length === 0 ? html`<p class="hint">No bias estimated yet.</p>` : html`
      <table><thead><tr><th scope="col">Bias</th><th scope="col">Estimate</th><th scope="col">± 2 sigma</th></tr></thead>
      <tbody>${sensor.biases.map((bias) => biasRow(bias))}</tbody></table>`}
  </details>`;
}

function biasRow(bias: Record<string, unknown>): TemplateResult {
  const name = String(bias["parameter"] ?? "");
  const [estimate, sigma] = [Number(bias["estimate"]), Number(bias["sigma"])];
  const digits = Math.abs(sigma) > 0 ? Math.max(0, Math.min(6, 1 - Math.floor(Math.log10(sigma)))) : 2;
  return html`<tr><td>${name.replaceAll("_", " ")}</td><td>${estimate.toFixed(digits)}</td><td>${(2 * sigma).toFixed(digits)}</td></tr>`;
}

function alarmsOf(sensor: Sensor): string[] {
  const alarms = sensor.health?.["alarms"];
  return typeof alarms === "string" && alarms !== "" ? alarms.split(",") : [];
}
