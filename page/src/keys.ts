/** The keys of the page, each declared once; the help sheet lists them. A new key is a line in `KEYS`. */

import { closeMenu } from "./export/menu";
import type { App } from "./panels/panel";
import { nextRow } from "./panels/table";
import { SWITCHES, TABS } from "./view/view";

export interface Key {
  /** As in `KeyboardEvent.key`. */
  key: string;
  /** In the help sheet, if it is not the key. */
  shown?: string;
  text: string;
  /** Not in the help sheet: it is described with another. */
  hidden?: boolean;
  /** The map has its own use of it while it is focused. */
  mapped?: boolean;
  /** Absent: the browser or the map does it. */
  run?: (app: App) => void;
}

export const KEYS: readonly Key[] = [
  ...SWITCHES.map(([name, key, text]): Key => ({ key, text, run: (app) => app.actions.toggle(name) })),
  { key: " ", shown: "Space", text: "Pause or resume", run: (app) => app.clock.toggle() },
  { key: "ArrowLeft", shown: "← →", text: "10 s back or forward (on the map: pan)", mapped: true, run: (app) => app.clock.step(-10) },
  { key: "ArrowRight", hidden: true, text: "", mapped: true, run: (app) => app.clock.step(10) },
  { key: "+", shown: "+ −", text: "Play faster or slower (on the map: zoom)", mapped: true, run: (app) => app.clock.faster(1) },
  { key: "-", hidden: true, text: "", mapped: true, run: (app) => app.clock.faster(-1) },
  { key: "n", text: "Return to the present", run: (app) => app.clock.live() },
  { key: "a", text: "Go back 5 minutes, and centre the map on the selected aircraft", run: (app) => app.ago.show(app, 300) },
  { key: "x", text: "Measure; Enter sets the end point at the centre of the map", run: (app) => app.measure.toggle(app) },
  { key: "Enter", hidden: true, text: "", run: (app) => app.measure.enter(app) },
  { key: "f", text: "Show everything", run: (app) => app.picture.fit() },
  ...TABS.map(([tab, key, title]): Key => ({ key, text: `Panel: ${title}`, run: (app) => app.actions.tab(tab) })),
  { key: "/", text: "Search the tracks", run: search },
  { key: "j", text: "Next track in the table", run: (app) => step(app, 1) },
  { key: "k", text: "Previous track", run: (app) => step(app, -1) },
  { key: "Enter", text: "In the table: open the details of the selected track" },
  { key: "m", text: "Switch between FL, kt, NM and SI units", run: (app) => app.actions.units() },
  { key: "d", text: "Switch between dark and light", run: (app) => app.actions.theme() },
  { key: "?", text: "Show this help", run: (app) => app.actions.help() },
  {
    key: "Escape", shown: "Esc", text: "Stop measuring, deselect, close",
    run: (app) => {
      if (closeMenu()) return;
      if (app.measure.active) app.measure.stop(app);
      else app.actions.select(null);
    },
  },
  { key: "ArrowUp", shown: "↑ ↓", text: "With ← → + −: pan and zoom the map while it is focused" },
];

function search(app: App): void {
  if (app.view.tab !== "tracks" || !app.view.open) app.actions.tab("tracks");
  document.getElementById("filter")?.focus();
}

function step(app: App, by: number): void {
  if (app.view.tab !== "tracks") app.actions.tab("tracks");
  nextRow(app, by);
}

/** Handle a key that was pressed outside dialogs. */
export function pressed(event: KeyboardEvent, app: App): void {
  const { target } = event;
  const typing = target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement
    || (target instanceof HTMLInputElement && !["checkbox", "radio", "button", "range"].includes(target.type));
  if (typing) {
    if (event.key === "Escape") target.blur();
    return;
  }
  // An open sheet has keys of its own, and is closed by the browser.
  if (document.querySelector("dialog[open]") !== null && event.key !== "?") return;
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  // Held down, a key that switches would do so many times a second.
  if (event.repeat && event.key === " ") return event.preventDefault();
  const found = KEYS.find((one) => one.key === event.key && one.run !== undefined);
  if (found === undefined || !(target instanceof Element)) return;
  if (event.key === "Enter" && !app.measure.active) return;
  if (found.mapped === true && target.closest("#map") !== null) return;
  if ((event.key === " " || event.key === "Enter") && target.closest("button, summary, a, input") !== null) return;
  event.preventDefault();
  found.run?.(app);
}
