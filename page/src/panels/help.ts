/** The help sheet: what the signs of the map mean, and the keys, from their one declaration. */

import { html, nothing, svg, type TemplateResult } from "lit";

import { sensorColour, type Palette } from "../drawing/palette";
import { markPath } from "../drawing/marks";
import { KEYS } from "../keys";
import type { App } from "./panel";

/** A sign in a box of 34 by 16 around the origin, in classes of the style sheet, and its meaning. */
const signs = (palette: Palette): readonly [TemplateResult, string][] => [
  [svg`<circle class="track full" r="4"></circle>`, "Confirmed track, updated by radars only"],
  [svg`<path class="track full" d="M0-5.4L5.4 0L0 5.4L-5.4 0Z"></path>`, "Also updated by ADS-B in the last 30 s"],
  [svg`<path class="track full" d="M-3.6-3.6H3.6V3.6H-3.6Z"></path>`, "Also updated by multilateration"],
  [svg`<circle class="track" r="4"></circle>`, "Open symbol: tentative"],
  [svg`<circle class="stale" r="4"></circle><path class="stale" d="M-6-6L6 6M6-6L-6 6"></path>`, "Crossed out: coasting, no plots"],
  [svg`<circle class="track full" r="2.2"></circle>`, "Small symbol: on the ground"],
  [svg`<text class="label" text-anchor="middle" y="4">~F120</text>`, "~: level estimated (no height received), or speed uncertain by more than 50 kt"],
  [svg`<circle class="track full" cx="-12" r="3"></circle><path class="faint" d="M-12 0H14"></path>`, "Predicted motion over the next 60 s"],
  [svg`<path class="faint" stroke-width="2" stroke-dasharray="2 4" d="M-13 0H12"></path>`, "Positions over the last two minutes"],
  [svg`<ellipse class="region" rx="14" ry="6"></ellipse>`, "Position uncertainty, 3 sigma"],
  [svg`${[-11, 0, 11].map((x, number) => svg`<path transform="translate(${x} 0) scale(4)" stroke-width=".35"
    stroke=${sensorColour(number, palette)} d=${markPath(number)}></path>`)}`, "Plots from the last 30 s, by sensor"],
  [svg`<path class="warning" stroke-dasharray="4 3" d="M-15 5L-2-3M15 5L2-3"></path><path class="warning" d="M-5-6L1 0M1-6L-5 0M-1-6L5 0M5-6L-1 0"></path>`,
    "Encounter: position, distance, time"],
  [svg`<path class="selected" d="M-15 3L15-3"></path><path class="selected full" d="M-3-2H2V3H-3Z"></path>`, "Selected track over the last ten minutes"],
  [svg`<ellipse class="selected" cx="-9" rx="5" ry="3"></ellipse><ellipse class="selected" cx="6" rx="9" ry="6"></ellipse>`, "Forecast of the selected track: 95 % regions"],
  [svg`<path class="bundle" d="M-15 4L0 0"></path><path class="bundle" d="M4-5V-1M2-3H6M8 0V4M6 2H10"></path>`, "Trajectory set of the selected track"],
  [svg`<path class="site full" d="M0-6L5.5 4H-5.5Z"></path>`, "Radar; rings every 50 NM"],
  [svg`<path class="site" d="M-9-5L-3.5 5H-14.5Z"></path><path stroke=${sensorColour(0, palette)} d="M-9 0L15-6"></path>`, "Direction finder; line: bearing from the last 30 s"],
  [svg`<path class="second" d="M-5-5H5L0 5Z"></path>`, "Comparison run; filled, open and crossed out as above"],
];

export function legend({ picture }: App): TemplateResult {
  return html`<ul class="legend">${signs(picture.scene.palette).map(([sign, text]) => html`<li><svg viewBox="-17 -8 34 16" width="34" height="16" aria-hidden="true">${sign}</svg>${text}</li>`)}</ul>`;
}

export function keyList(): TemplateResult {
  return html`<dl>${KEYS.map((one) => (one.hidden === true ? nothing
    : html`<div><dt><kbd>${one.shown ?? one.key}</kbd></dt><dd>${one.text}</dd></div>`))}</dl>`;
}
