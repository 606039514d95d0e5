/** The air picture. */

import "ol/ol.css";
import "./page.css";

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
const feed = new Feed(store, view.tick, () => redraw());
const selection = new Selection(
  () => store.dataTimeS,
  (id) => view.shown.trajectories && store.bundles.includes(id),
);
selection.follow(view.selected);
feed.track = view.selected;

const encounters = new Encounters(() => view.shown.encounters && store.tracks.length > 1);

const actions: Actions = {
  select(id) {
    view.selected = id;
    feed.track = id;
    selection.follow(id);
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
  filter(text) {
    view.filter = text;
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
