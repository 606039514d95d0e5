/** The air picture. */

import "ol/ol.css";
import "./page.css";

import { Feed } from "./feed";
import { Panels } from "./panels";
import { Picture } from "./picture";
import { Selection } from "./selection";
import { Store } from "./store";
import { addressOf, initialView, SWITCHES, type Switch } from "./view";

const PANEL_MS = 500;

const store = new Store();
const view = initialView(location.hash);
let drawn = 0;
let queued = false;
const feed = new Feed(store, () => redraw());
const selection = new Selection(() => store.dataTimeS);
selection.follow(view.selected);

const actions = {
  select(id: number | null): void {
    view.selected = id;
    selection.follow(id);
    redraw(true);
    keep();
  },
  show(id: number): void {
    view.selected = id;
    selection.follow(id);
    const track = store.track(id);
    if (track !== undefined) picture.show(track);
    redraw(true);
    keep();
  },
  toggle(name: Switch): void {
    view.shown[name] = !view.shown[name];
    redraw(true);
    keep();
  },
  filter(text: string): void {
    view.filter = text;
    redraw(true);
    keep();
  },
  units(): void {
    view.units = view.units === "aero" ? "si" : "aero";
    redraw(true);
    keep();
  },
  theme(): void {
    view.theme = view.theme === "dark" ? "light" : "dark";
    picture.theme();
    redraw(true);
    keep();
  },
  help(): void {
    const dialog = document.getElementById("help") as HTMLDialogElement;
    if (dialog.open) dialog.close();
    else dialog.showModal();
  },
};

const panels = new Panels(store, feed, view, actions);
const picture = new Picture(
  document.getElementById("map") as HTMLElement, store, feed, view, selection,
  (id) => actions.select(id), keep,
);

function keep(): void {
  history.replaceState(null, "", addressOf(view));
}

/** Draw the panels: at once for the user, else at most twice a second. */
function redraw(now = false): void {
  const due = drawn + PANEL_MS - performance.now();
  if (now || due <= 0) {
    drawn = performance.now();
    panels.draw();
  } else if (!queued) {
    queued = true;
    setTimeout(() => {
      queued = false;
      redraw();
    }, due);
  }
}

document.addEventListener("keydown", (event) => {
  const typing = event.target instanceof HTMLInputElement && event.target.type === "search";
  if (event.key === "Escape") {
    if (typing) (event.target as HTMLInputElement).blur();
    else actions.select(null);
    return;
  }
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  const named = SWITCHES.find(([, key]) => key === event.key);
  if (named !== undefined) actions.toggle(named[0]);
  else if (event.key === "f") picture.fit();
  else if (event.key === "?") actions.help();
  else if (event.key === "m") actions.units();
  else if (event.key === "d") actions.theme();
  else if (event.key === "/") {
    event.preventDefault();
    document.getElementById("filter")?.focus();
  }
});

feed.start();
redraw(true);

// What tests and measurements read.
declare global {
  interface Window {
    multiradar: { store: Store; picture: Picture; view: typeof view; selection: Selection; actions: typeof actions };
  }
}
window.multiradar = { store, picture, view, selection, actions };
