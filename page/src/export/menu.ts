/** Exports of the selected track, or of all that are shown, as files that the browser makes. */

import { toLonLat } from "ol/proj";
import { html, type TemplateResult } from "lit";

import { PALETTES } from "../drawing/palette";
import type { App } from "../panels/panel";
import { isFiltered, isShown } from "../view/shown";
import { stateOf } from "../time/bar";
import type { Track } from "../sky/store";
import { date, isoTime, utc } from "../view/units";
import { csv, geojson, kml, type Past } from "./formats";

const CAPTION_PX = 24;
/** Pixels of the image for each of the page, on paper. */
const PAPER_RATIO = 2;

export function exportMenu(app: App): TemplateResult {
  const { view, store } = app;
  const what = store.track(view.selected) === undefined ? "all shown" : "selected";
  const one = (name: string, run: () => void): TemplateResult =>
    html`<button type="button" @click=${(event: Event) => {
      run();
      (event.target as HTMLElement).closest("details")?.removeAttribute("open");
    }}>${name}</button>`;
  return html`<details class="menu"><summary>Export (${what})</summary><span>
    ${one("CSV", () => save(app, "csv", "text/csv", csv(chosen(app))))}
    ${one("GeoJSON", () => save(app, "geojson", "application/geo+json", geojson(chosen(app), pastOf(app))))}
    ${one("KML", () => save(app, "kml", "application/vnd.google-earth.kml+xml", kml(chosen(app), pastOf(app), titleOf(app))))}
    ${one("PNG of the map", () => void png(app))}</span></details>`;
}

/** Close the menu if it is open, unless a click was in it; whether it was closed. */
export function closeMenu(clicked?: EventTarget | null): boolean {
  const menu = document.querySelector<HTMLDetailsElement>("details.menu[open]");
  if (menu === null || (clicked instanceof Node && menu.contains(clicked))) return false;
  // The focus would be lost with the button that has it.
  if (menu.contains(document.activeElement)) menu.querySelector("summary")?.focus();
  menu.open = false;
  return true;
}

function chosen({ store, view }: App): Track[] {
  const selected = store.track(view.selected);
  return selected === undefined ? store.tracks.filter((one) => isShown(one, view)) : [selected];
}

function pastOf({ store, view, selection }: App): Past | null {
  const track = store.track(view.selected);
  if (track === undefined) return null;
  return { id: track.id, points: selection.past.map((one) => {
    const [longitude, latitude] = toLonLat([one.x, one.y]);
    return [longitude ?? 0, latitude ?? 0, one.timeS];
  }) };
}

function titleOf(app: App): string {
  const time = app.store.dataTimeS;
  const { runs } = app.clock;
  const state = `${stateOf(app)}${runs.length > 1 ? `, ${runs[app.view.run]}` : ""}${isFiltered(app.view.filters) ? ", filtered" : ""}`;
  return time === null ? `multiradar, ${state}` : `multiradar, ${`${date(time)} ${utc(time)}`.trim()} UTC, ${state}`;
}

/** A name of letters, digits and dashes. */
function fileName({ store, clock, view }: App, ending: string): string {
  const time = store.dataTimeS ?? 0;
  const text = (isoTime(time) ?? utc(time)).slice(0, 19).replaceAll(/[^0-9T]/g, "");
  const run = clock.runs.length > 1 ? `-${clock.runs[view.run]?.replaceAll(/[^\w-]/g, "_")}` : "";
  return `multiradar-${text}${run}.${ending}`;
}

function save(app: App, ending: string, type: string, content: string): void {
  download(fileName(app, ending), new Blob([content], { type: `${type};charset=utf-8` }));
}

function download(name: string, blob: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The map as it is seen on a canvas, with room below it, px; null where the browser has none. */
function composed(app: App, ratio: number, below = 0): CanvasRenderingContext2D | null {
  const target = document.getElementById("map") as HTMLElement;
  const box = target.getBoundingClientRect();
  const image = document.createElement("canvas");
  image.width = Math.round(box.width * ratio);
  image.height = Math.round((box.height + below) * ratio);
  const context = image.getContext("2d");
  if (context === null) return null;
  context.scale(ratio, ratio);
  context.fillStyle = PALETTES[app.view.theme].background;
  context.fillRect(0, 0, box.width, box.height + below);
  for (const canvas of target.querySelectorAll("canvas")) {
    // What is out of date looks so, as on the page.
    const style = getComputedStyle(canvas.closest(".ol-layers") ?? canvas);
    [context.filter, context.globalAlpha] = [style.filter, Number(style.opacity)];
    const own = canvas.getBoundingClientRect();
    if (canvas.width > 0 && own.width > 0) {
      context.drawImage(canvas, own.left - box.left, own.top - box.top, own.width, own.height);
    }
  }
  [context.filter, context.globalAlpha] = ["none", 1];
  return context;
}

/**
 * Put the map on paper as one image: browsers print a canvas by its lines and texts, without the
 * symbols that are written into it, and crop it to the paper.
 */
export function toPaper(app: App): void {
  fromPaper();
  const context = composed(app, Math.max(PAPER_RATIO, window.devicePixelRatio));
  if (context === null) return;
  context.canvas.className = "paper";
  document.getElementById("map")?.append(context.canvas);
}

/** Remove what was printed. */
export function fromPaper(): void {
  document.querySelector("#map > canvas.paper")?.remove();
}

/** The map as it is seen, with the time below it. */
async function png(app: App): Promise<void> {
  const context = composed(app, window.devicePixelRatio, CAPTION_PX);
  if (context === null) return;
  const bottom = (document.getElementById("map") as HTMLElement).getBoundingClientRect().height;
  context.fillStyle = PALETTES[app.view.theme].label;
  context.font = "13px sans-serif";
  context.fillText(`${titleOf(app)}. Coastlines: Natural Earth`, 8, bottom + 16);
  const blob = await new Promise<Blob | null>((done) => context.canvas.toBlob(done, "image/png"));
  if (blob !== null) download(fileName(app, "png"), blob);
}
