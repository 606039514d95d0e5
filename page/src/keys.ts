/** The keys of the page, each declared once; the help sheet lists them. A new key is a line in `KEYS`. */

import type { App } from "./panels/panel";
import { SWITCHES } from "./view";

export interface Key {
  /** As in `KeyboardEvent.key`. */
  key: string;
  /** In the help sheet, if it is not the key. */
  shown?: string;
  text: string;
  /** Absent: the browser or the map does it. */
  run?: (app: App) => void;
}

export const KEYS: readonly Key[] = [
  ...SWITCHES.map(([name, key, text]): Key => ({ key, text, run: (app) => app.actions.toggle(name) })),
  { key: "f", text: "Show everything", run: (app) => app.picture.fit() },
  { key: "/", text: "Filter the tracks", run: () => document.getElementById("filter")?.focus() },
  { key: "m", text: "FL, kt, NM or SI units", run: (app) => app.actions.units() },
  { key: "d", text: "Dark or light", run: (app) => app.actions.theme() },
  { key: "?", text: "This sheet", run: (app) => app.actions.help() },
  { key: "Escape", shown: "Esc", text: "Deselect, close", run: (app) => app.actions.select(null) },
  { key: "ArrowUp", shown: "arrows, + and −", text: "Move and zoom the map (with the map focused)" },
];

/** Handle a key that was pressed outside dialogs. */
export function pressed(event: KeyboardEvent, app: App): void {
  const { target } = event;
  const typing = target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement
    || (target instanceof HTMLInputElement && !["checkbox", "radio", "button"].includes(target.type));
  if (typing) {
    if (event.key === "Escape") target.blur();
    return;
  }
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const found = KEYS.find((one) => one.key === event.key && one.run !== undefined);
  if (found === undefined) return;
  event.preventDefault();
  found.run?.(app);
}
