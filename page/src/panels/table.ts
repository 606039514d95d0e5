/** The table of tracks: the map as text. */

import { html, type TemplateResult } from "lit";

import { isShown, matches } from "../shown";
import { nameOf, type Track } from "../store";
import { distance, level, speed } from "../units";
import type { App, Panel } from "./panel";

const ROWS_MAX = 200;

type Key = "name" | "level" | "speed" | "sigma" | "age";

const COLUMNS: [Key, string][] = [
  ["name", "Track"], ["level", "Level"], ["speed", "Speed"], ["sigma", "Sigma"], ["age", "Age"],
];

const sorting: { key: Key; descending: boolean } = { key: "name", descending: false };

export const tablePanel: Panel = { id: "tracks", title: "Tracks", draw };

function draw(app: App): TemplateResult {
  const { store, view, actions } = app;
  const shown = store.tracks.filter((one) => isShown(one, view));
  const sorted = [...shown].sort((a, b) => order(a, b) * (sorting.descending ? -1 : 1));
  const hidden = store.tracks.filter((one) => !matches(one, view.filter)).length;
  return html`
    <input type="search" id="filter" placeholder="Callsign, code, address or number (/)" aria-label="Filter tracks"
      .value=${view.filter} @input=${(event: Event) => actions.filter((event.target as HTMLInputElement).value)}>
    <table>
      <thead><tr>${COLUMNS.map(([key, text]) => html`<th scope="col" aria-sort=${sortOf(key)}>
        <button type="button" @click=${() => sort(key, app)}>${text}</button></th>`)}</tr></thead>
      <tbody>${sorted.slice(0, ROWS_MAX).map((track) => row(track, app))}</tbody>
    </table>
    <p class="hint">${shown.length} shown${hidden > 0 ? `, ${hidden} hidden by the filter` : ""}${
      shown.length > ROWS_MAX ? `; the table has the first ${ROWS_MAX}` : ""}</p>`;
}

function row(track: Track, { view, actions }: App): TemplateResult {
  const { units } = view;
  return html`<tr aria-selected=${track.id === view.selected} class=${track.state}>
    <td><button type="button" @click=${() => actions.show(track.id)}>${nameOf(track)}</button></td>
    <td>${track.onGround ? "GND" : level(track.heightM, units)}</td>
    <td>${speed(track.speedMps, units)}</td>
    <td>${distance(track.sigmaM, units)}</td>
    <td>${track.ageS.toFixed(0)} s</td></tr>`;
}

function sortOf(key: Key): "none" | "ascending" | "descending" {
  if (key !== sorting.key) return "none";
  return sorting.descending ? "descending" : "ascending";
}

function sort(key: Key, { actions }: App): void {
  sorting.descending = key === sorting.key ? !sorting.descending : key !== "name";
  sorting.key = key;
  actions.changed();
}

function order(a: Track, b: Track): number {
  if (sorting.key === "name") return nameOf(a).localeCompare(nameOf(b));
  const value = (track: Track): number =>
    ({ level: track.heightM, speed: track.speedMps, sigma: track.sigmaM, age: track.ageS })[sorting.key as Exclude<Key, "name">];
  // Unknown values come last in descending order.
  const known = (one: number): number => (Number.isFinite(one) ? one : -Infinity);
  return known(value(a)) - known(value(b));
}
