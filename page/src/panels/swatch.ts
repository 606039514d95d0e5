/** The colour and the form of a sensor's plots, as on the map. */

import { html, type TemplateResult } from "lit";

import { markPath } from "../drawing/marks";
import { sensorColour } from "../drawing/palette";
import type { App } from "./panel";

export function swatch(sensor: string, { store, picture }: App): TemplateResult {
  const number = Math.max(store.sensors.indexOf(sensor), 0);
  return html`<svg class="swatch" viewBox="-1.2 -1.2 2.4 2.4" aria-hidden="true" fill="none" stroke-width="0.42"
    stroke=${sensorColour(number, picture.scene.palette)}><path d=${markPath(number)}></path></svg>`;
}
