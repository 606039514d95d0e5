/** The colour and the form of a sensor's plots, as on the map. */

import { html, svg, type TemplateResult } from "lit";

import { sensorColour } from "../drawing/palette";
import type { App } from "./panel";

const FORMS = [
  svg`<path d="M0 5H10M5 0V10"></path>`,
  svg`<rect x="1.5" y="1.5" width="7" height="7"></rect>`,
  svg`<path d="M5 0.5L9.5 8.5H0.5Z"></path>`,
  svg`<circle cx="5" cy="5" r="3.8"></circle>`,
];

export function swatch(sensor: string, { store }: App): TemplateResult {
  const number = store.sensors.indexOf(sensor);
  return html`<svg class="swatch" viewBox="0 0 10 10" aria-hidden="true" fill="none" stroke-width="1.8"
    stroke=${sensorColour(Math.max(number, 0))}>${FORMS[Math.max(number, 0) % FORMS.length]}</svg>`;
}
