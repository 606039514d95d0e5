/** The table of tracks: the map as text, with the same filters and the same selection. */

import { html, nothing, type TemplateResult } from "lit";

import { isBandEmpty, isShown, otherRun } from "../view/shown";
import { nameOf, type Track } from "../sky/store";
import { aged, unheardS } from "../time/presence";
import { distance, level, speed, trend } from "../view/units";
import { filterForm } from "./filters";
import type { App, Panel } from "./panel";

/** Height of a row, pixels, as in the style sheet. */
const ROW_PX = 26;
const TOUCH_ROW_PX = 44;
/** Rows drawn beyond both ends of the visible part. */
const MARGIN_ROWS = 8;
const PAGE_ROWS = 10;

type Key = "name" | "level" | "speed" | "sigma" | "age";

const COLUMNS: readonly [Key, string, string][] = [
  ["name", "Track", "Callsign, else Mode 3/A code, address or number"],
  ["level", "Level", "Level; ~ means estimated, not received"],
  ["speed", "Speed", "Ground speed; ~ means uncertain by more than 50 kt (1 sigma)"],
  ["sigma", "Sigma", "Position uncertainty at the time shown, one standard deviation; it grows between plots"],
  ["age", "Age", "Time since the last plot"],
];
const SYMBOLS: Record<string, string> = { confirmed: "●", tentative: "○", coasting: "✕", unknown: "?" };

const sorting: { key: Key; descending: boolean } = { key: "name", descending: false };
let rows: Track[] = [];
/** What the ages are older by, s. */
let olderS: number | null = 0;

export const tablePanel: Panel = {
  id: "tracks",
  title: "Tracks",
  tab: "tracks",
  draw,
};

function draw(app: App): TemplateResult {
  const { store, view, picture, actions } = app;
  const shown = store.tracks.filter((one) => isShown(one, view));
  rows = view.filters.area ? shown.filter((one) => picture.contains(one)) : shown;
  rows.sort(order);
  olderS = unheardS(app.feed, app.clock);
  const hidden = store.tracks.length - rows.length;
  return html`${filterForm(app)}
    <p class="summary"><span>${rows.length} shown${hidden > 0 ? `, ${hidden} hidden by filters and switches` : ""}${
      store.isPart ? `; ${store.tracks.length} of ${store.total} tracks received: the search covers the visible area` : ""}</span>
      <span>${leastCertain(app)}</span></p>
    ${rows.length > 0 ? nothing : html`<p class="hint">${
      isBandEmpty(view.filters) ? "The level band is empty: its lower limit is above its upper limit."
      : store.tracks.length > 0 ? `No track ${store.isPart ? "in the visible area " : ""}matches the filters.` : none(app)}${inOther(app)}</p>`}
    <div class="rows" @scroll=${() => actions.redraw()} @keydown=${(event: KeyboardEvent) => moved(event, app)}>
    <table role="grid" aria-label="Tracks" aria-rowcount=${rows.length + 1}>
      <thead><tr>${COLUMNS.map(([key, text, title]) => html`<th scope="col" aria-sort=${sortOf(key)} title=${title}>
        <button type="button" @click=${() => sort(key, app)}>${text}</button></th>`)}</tr></thead>
      <tbody>${body(app)}</tbody>
    </table></div>`;
}

/** What the other of two runs has instead. */
function inOther({ actions, clock, feed, view }: App): TemplateResult | typeof nothing {
  const other = otherRun(view);
  const found = clock.runs.length < 2 ? 0 : feed.second.tracks.filter((one) => isShown(one, view, true)).length;
  return found === 0 ? nothing : html` <button type="button" class="link" @click=${() => actions.run(other)}>${
    clock.runs[other]} has ${found}</button>`;
}

/** Why there are no tracks. */
function none({ feed, store }: App): string {
  const { backlog_rows: backlog, intake_rows: intake } = feed.status;
  if (!store.isRead) return "Loading the air picture…";
  if (Number(backlog ?? 0) + Number(intake ?? 0) > 0) return "The service is still processing the measurements received so far.";
  if (store.isPart) return `No tracks in the visible area: ${store.total} elsewhere.`;
  return store.dataTimeS === null ? "No tracks: there are no aircraft, or no measurements have been received." : "No tracks at this time.";
}

/** The least certain track; if it is tentative, which may be clutter, also that of the others. */
function leastCertain({ view, actions }: App): TemplateResult | typeof nothing {
  const most = (one: Track | null, other: Track): Track | null => (other.sigmaNowM > (one?.sigmaNowM ?? -1) ? other : one);
  const worst = rows.reduce(most, null);
  if (worst === null) return nothing;
  const link = (before: string, track: Track, state: string): TemplateResult => html`<button type="button" class="link"
    @click=${() => actions.show(track.id)}>${before}${nameOf(track)}${state}, ${distance(track.sigmaNowM, view.units)}${
      track.state === "coasting" ? `, ${track.ageS.toFixed(0)} s after its last plot` : ""}</button>`;
  const other = worst.state === "tentative" ? rows.filter((one) => one.state !== "tentative").reduce(most, null) : null;
  return html`${link("Least certain: ", worst, worst.state === "tentative" ? " (tentative)" : "")}${
    other === null ? nothing : html`; ${link(`${other.state}: `, other, "")}`}`;
}

/** The rows in sight, between spaces as high as those that are not. */
function body(app: App): TemplateResult {
  const place = scroller();
  const height = rowHeight();
  const first = Math.max(0, Math.floor((place?.scrollTop ?? 0) / height) - MARGIN_ROWS);
  const count = Math.ceil((place?.clientHeight || 600) / height) + 2 * MARGIN_ROWS;
  const last = Math.min(rows.length, first + count);
  const focused = rows.some((one) => one.id === app.view.selected) ? app.view.selected : rows[0]?.id;
  return html`${space(first * height)}${rows.slice(first, last).map((track, at) => row(track, first + at, focused, app))}${
    space((rows.length - last) * height)}`;
}

function space(height: number): TemplateResult | typeof nothing {
  return height > 0 ? html`<tr aria-hidden="true"><td colspan=${COLUMNS.length} class="space" height=${height}></td></tr>` : nothing;
}

function row(track: Track, place: number, focused: number | null | undefined, { view, actions }: App): TemplateResult {
  const { units } = view;
  const state = track.onGround ? "on the ground" : track.state;
  return html`<tr data-id=${track.id} aria-rowindex=${place + 2} aria-selected=${track.id === view.selected}
    tabindex=${track.id === focused ? 0 : -1} class=${track.state} @click=${() => actions.show(track.id)}>
    <td class="name" title=${`${nameOf(track)}${track.emergency === "" ? "" : ` ${track.emergency}`}, ${state}`}><span class="state" title=${state} aria-hidden="true">${track.onGround ? "■" : SYMBOLS[track.state]}</span>${
        track.emergency === "" ? nothing : html`<span class="badge level-fault">${track.emergency}</span> `}${nameOf(track)}
      <span class="unseen">${state}</span></td>
    <td><span class="trend">${track.onGround ? "" : trend(track.climbMps)}</span>${track.onGround ? "GND" : level(track.heightM, units, track.isLevelEstimated)}</td>
    <td>${speed(track.speedMps, units, track.isSpeedUncertain)}</td>
    <td>${distance(track.sigmaNowM, units)}</td>
    <td>${aged(track.ageS, olderS)}</td></tr>`;
}

function scroller(): HTMLElement | null {
  return document.querySelector("#tracks .rows");
}

function rowHeight(): number {
  return matchMedia("(pointer: coarse), (max-width: 1000px)").matches ? TOUCH_ROW_PX : ROW_PX;
}

/** Arrows, Home, End and the page keys select; Enter opens the sheet. */
function moved(event: KeyboardEvent, app: App): void {
  const { view, actions } = app;
  const place = rows.findIndex((one) => one.id === view.selected);
  const steps: Record<string, number> = {
    ArrowDown: place + 1, ArrowUp: place < 0 ? 0 : place - 1, Home: 0, End: rows.length - 1,
    PageDown: place + PAGE_ROWS, PageUp: place - PAGE_ROWS,
  };
  if (event.target instanceof HTMLButtonElement) return;
  if (event.key === "Enter" && view.selected !== null) {
    event.preventDefault();
    actions.show(view.selected);
    document.getElementById("panel-track")?.focus();
    return;
  }
  const step = steps[event.key];
  if (step === undefined) return;
  event.preventDefault();
  focusRow(Math.max(0, Math.min(rows.length - 1, step)), app);
}

/** Select the row so many after the selected one. */
export function nextRow(app: App, by: number): void {
  const place = rows.findIndex((one) => one.id === app.view.selected);
  focusRow(Math.max(0, Math.min(rows.length - 1, place + by)), app);
}

/** Select a row, and bring it into sight. */
function focusRow(place: number, { actions }: App): void {
  const track = rows[place];
  const box = scroller();
  if (track === undefined || box === null) return;
  const height = rowHeight();
  const [top, bottom] = [place * height, (place + 2) * height];
  if (top < box.scrollTop) box.scrollTop = top;
  else if (bottom > box.scrollTop + box.clientHeight) box.scrollTop = bottom - box.clientHeight;
  actions.select(track.id, false);
  box.querySelector<HTMLElement>(`tr[data-id="${track.id}"]`)?.focus({ preventScroll: true });
}

function sortOf(key: Key): "none" | "ascending" | "descending" {
  if (key !== sorting.key) return "none";
  return sorting.descending ? "descending" : "ascending";
}

function sort(key: Key, { actions }: App): void {
  sorting.descending = key === sorting.key ? !sorting.descending : key !== "name";
  sorting.key = key;
  const box = scroller();
  if (box !== null) box.scrollTop = 0;
  actions.redraw();
}

/** Unknown values come last in either direction; equal ones stay by number. */
function order(a: Track, b: Track): number {
  const sign = sorting.descending ? -1 : 1;
  if (sorting.key === "name") {
    const [first, second] = [nameOf(a), nameOf(b)];
    return sign * (first < second ? -1 : first > second ? 1 : a.id - b.id);
  }
  const [first, second] = [valueOf(a), valueOf(b)];
  if (Number.isNaN(first) || Number.isNaN(second)) return Number(Number.isNaN(first)) - Number(Number.isNaN(second)) || a.id - b.id;
  return sign * (first - second) || a.id - b.id;
}

function valueOf(track: Track): number {
  switch (sorting.key) {
    case "level": return track.heightM;
    case "speed": return track.speedMps;
    case "sigma": return track.sigmaNowM;
    default: return track.ageS;
  }
}
