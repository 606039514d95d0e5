/** The panels beside the map. A new panel is a module of this folder and a line in `PANELS`. */

import { html, render } from "lit";

import { banner, bar } from "./bar";
import { keyList } from "./help";
import type { App, Panel } from "./panel";
import { sensorPanel } from "./sensor";
import { switchPanel } from "./switches";
import { systemPanel } from "./system";
import { tablePanel } from "./table";
import { trackPanel } from "./track";

/** In the order of the page. */
export const PANELS: readonly Panel[] = [
  switchPanel,
  trackPanel,
  sensorPanel,
  tablePanel,
  systemPanel,
];

const at = (id: string): HTMLElement => document.getElementById(id) ?? document.body;

/** Draw everything but the map. */
export function drawPanels(app: App): void {
  render(banner(app), at("banner"));
  render(bar(app), at("bar"));
  render(html`${PANELS.map((panel) => html`<section aria-labelledby="${panel.id}-title">
    <h2 id="${panel.id}-title">${panel.title}</h2><div id=${panel.id}>${panel.draw(app)}</div></section>`)}`, at("side"));
  render(keyList(), at("keys"));
}
