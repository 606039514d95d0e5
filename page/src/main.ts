/** The air picture. */

import "ol/ol.css";
import "./page.css";
import "./panels/panels.css";
import "./panels/screens.css";

import { Encounters } from "./encounters";
import { Feed } from "./feed";
import { pressed } from "./keys";
import { drawPanels } from "./panels/index";
import type { Actions, App } from "./panels/panel";
import { Picture } from "./picture";
import { Selection } from "./selection";
import { Store } from "./store";
import { addressOf, initialView } from "./view";

const PANEL_MS = 500;

const store = new Store();
const view = initialView(location.hash);
let drawn = 0;
let queued = false;
/** Screens on which the panels lie over the map. */
const narrow = matchMedia("(max-width: 1000px)");
view.open = !narrow.matches;
const feed = new Feed(store, view.tick, () => redraw());
const selection = new Selection(
  () => store.dataTimeS,
  (id) => view.shown.trajectories && store.bundles.includes(id),
);
selection.follow(view.selected);
feed.track = view.selected;

const encounters = new Encounters(() => view.shown.encounters && store.tracks.length > 1);

const actions: Actions = {
  select(id, opens = true) {
    view.selected = id;
    feed.track = id;
    selection.follow(id);
    if (id !== null && opens) [view.tab, view.open] = ["track", true];
    actions.changed();
  },
  show(id) {
    const track = store.track(id);
    if (track !== undefined) picture.show(track);
    actions.select(id);
  },
  toggle(name) {
    view.shown[name] = !view.shown[name];
    actions.changed();
  },
  filter(changes) {
    Object.assign(view.filters, changes);
    actions.changed();
  },
  tab(name) {
    view.open = !narrow.matches || view.tab !== name || !view.open;
    view.tab = name;
    actions.changed();
  },
  sensor(id) {
    view.sensor = id;
    if (id !== null) [view.tab, view.open] = ["sensors", true];
    actions.changed();
  },
  units() {
    view.units = view.units === "aero" ? "si" : "aero";
    actions.changed();
  },
  theme() {
    view.theme = view.theme === "dark" ? "light" : "dark";
    picture.theme();
    actions.changed();
  },
  help() {
    const dialog = document.getElementById("help") as HTMLDialogElement;
    if (dialog.open) dialog.close();
    else dialog.showModal();
  },
  redraw() {
    requestAnimationFrame(() => drawPanels(app));
  },
  changed() {
    picture.touch();
    redraw(true);
    keep();
  },
};

const picture = new Picture(
  document.getElementById("map") as HTMLElement, store, feed, view, selection, encounters,
  (id) => actions.select(id), keep,
);
const app: App = { store, feed, view, selection, encounters, picture, actions };

function keep(): void {
  history.replaceState(null, "", addressOf(view));
}

/** Draw the panels: at once for the user, else at most twice a second. */
function redraw(now = false): void {
  const due = drawn + PANEL_MS - performance.now();
  if (now || due <= 0) {
    drawn = performance.now();
    drawPanels(app);
  } else if (!queued) {
    queued = true;
    setTimeout(() => {
      queued = false;
      redraw();
    }, due);
  }
}

document.addEventListener("keydown", (event) => pressed(event, app));

// Paper is white: the map is drawn again in light colours.
let printed = view.theme;
window.addEventListener("beforeprint", () => {
  printed = view.theme;
  if (view.theme === "dark") actions.theme();
  picture.map.renderSync();
});
window.addEventListener("afterprint", () => {
  if (view.theme !== printed) actions.theme();
});

feed.start();
encounters.start();
redraw(true);

// What tests and measurements read.
declare global {
  interface Window {
    multiradar: App;
  }
}
window.multiradar = app;
