/** The line above the map, and what is announced below it. */

import { html, nothing, type TemplateResult } from "lit";

import { date, utc } from "../units";
import type { App } from "./panel";

export function banner({ feed }: App): TemplateResult | typeof nothing {
  const now = performance.now();
  if (feed.isLost(now)) {
    return html`<p role="alert">No answer from the service for ${Math.round(feed.silentS(now))} s.
      The picture is out of date. ${feed.problem}</p>`;
  }
  if (feed.problem !== "") return html`<p role="alert">${feed.problem}</p>`;
  return nothing;
}

export function bar({ store, view, actions }: App): TemplateResult {
  const { tracks, dataTimeS: time } = store;
  const confirmed = tracks.filter((one) => one.state === "confirmed").length;
  return html`
    <strong>multiradar</strong>
    <time title="Data time, UTC ${date(time)}">${utc(time)}${time === null ? "" : " UTC"}</time>
    <span>${tracks.length === 0 ? "no tracks" : `${confirmed} confirmed, ${tracks.length - confirmed} other tracks`}</span>
    <span>${store.plots.length} plots in 30 s</span>
    <button type="button" @click=${() => actions.units()}>${view.units === "aero" ? "FL, kt, NM" : "m, m/s, km"}</button>
    <button type="button" @click=${() => actions.theme()}>${view.theme === "dark" ? "Light" : "Dark"}</button>
    <button type="button" @click=${() => actions.help()}>Keys (?)</button>
    <a href="docs">API</a>`;
}
