/** The air picture. */

import "ol/ol.css";
import "./page.css";
import "./panels/panels.css";
import "./panels/screens.css";
import "./time/time.css";

import { Encounters } from "./service/encounters";
import { closeMenu, fromPaper, toPaper } from "./export/menu";
import { Feed } from "./service/feed";
import { pressed } from "./keys";
import { BiasHint } from "./panels/bias_hint";
import { drawPanels } from "./panels/index";
import type { Actions, App } from "./panels/panel";
import { Picture } from "./drawing/picture";
import { Selection } from "./service/selection";
import { Overlays } from "./overlays/overlays";
import { attach } from "./measure/measure";
import { Store } from "./sky/store";
import { Ago } from "./time/ago";
import { Clock } from "./time/clock";
import { otherRun, RUN_KEYS } from "./view/shown";
import { addressOf, initialView } from "./view/view";

const PANEL_MS = 500;
/** The address follows the time shown so much later, ms: browsers limit how often it changes. */
const KEEP_MS = 400;

const store = new Store();
const view = initialView(location.hash);
let drawn = 0;
let queued = false;
/** Screens on which the panels lie over the map. */
const narrow = matchMedia("(max-width: 1000px)");
view.open = !narrow.matches;
let keeping = 0;
const clock = new Clock(() => clockChanged());
const feed = new Feed(store, clock, view.tick, () => read());
const selection = new Selection(
  () => store.dataTimeS,
  (id) => store.track(id) !== undefined,
  () => (clock.isLive ? "live" : clock.recorded ? "recorded" : "history"),
  (id) => view.shown.trajectories && store.bundles.includes(id),
);
selection.follow(view.selected);
feed.track = view.selected;

const encounters = new Encounters(
  () => view.shown.encounters && !clock.recorded && store.tracks.length > 1,
  () => clock.at(performance.now()),
);

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
  run(number) {
    if (number === view.run) return;
    view.run = number;
    view.hidden.delete(RUN_KEYS[number]);
    actions.select(null);
  },
  toggle(name) {
    view.shown[name] = !view.shown[name];
    if (name === "biases") app.biasHint.switched();
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
    overlays.apply();
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
    choose();
    picture.touch();
    redraw(true);
    keep();
  },
};

const picture = new Picture(
  document.getElementById("map") as HTMLElement, store, feed, view, selection, encounters, clock,
  (id, isOther) => {
    if (isOther) actions.run(otherRun(view));
    actions.select(id);
  }, keep,
);
const overlays = new Overlays(picture.map, view, picture.layers.overlayNames, () => actions.changed());
const { measure } = picture.layers;
const app: App = {
  store, feed, view, selection, encounters, picture, actions, clock, ago: new Ago(), biasHint: new BiasHint(), measure, overlays,
};
attach(measure, app);
let jumps = 0;
let followed = -1;

function keep(): void {
  history.replaceState(null, "", addressOf(view));
}

/** Keep the view in the address, although the slider moves. */
function keepSoon(): void {
  if (keeping !== 0) return;
  keeping = window.setTimeout(() => {
    keeping = 0;
    keep();
  }, KEEP_MS);
}

/** Read the run that the user or the address chose, or the only one that is visible; a service has none. */
function choose(): void {
  if (clock.runs.length < 2) return;
  const other = otherRun(view);
  if (view.hidden.has(RUN_KEYS[view.run]) && !view.hidden.has(RUN_KEYS[other])) actions.run(other);
  else if (feed.run !== view.run) feed.choose(view.run);
}

/** A frame or a document was read, or could not be. */
function read(): void {
  choose();
  app.ago.arrived(app);
  // The first picture of a time that was chosen.
  if (feed.isCurrent && followed !== clock.jumps) {
    followed = clock.jumps;
    selection.moved();
  }
  // The first tracks are shown at once.
  redraw(store.frames === 1);
}

/** The time shown was chosen. */
function clockChanged(): void {
  const time = clock.at(performance.now());
  view.at = clock.playing ? null : time;
  store.pace = clock.pace;
  feed.second.pace = clock.pace;
  if (clock.jumps !== jumps) {
    jumps = clock.jumps;
    feed.hurry();
    encounters.hurry();
  }
  picture.touch();
  redraw(true);
  keepSoon();
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
// Clicked with the mouse, a button does not keep the focus: Space is pause again, and not the same button.
document.addEventListener("click", (event) => {
  if (event.detail > 0 && event.target instanceof Element) event.target.closest<HTMLElement>("#time button, #bar button")?.blur();
});
document.addEventListener("pointerdown", (event) => void closeMenu(event.target));

// Paper is white: the map is drawn again in light colours.
let printed = view.theme;
window.addEventListener("beforeprint", () => {
  printed = view.theme;
  if (view.theme === "dark") actions.theme();
  picture.map.renderSync();
  toPaper(app);
});
window.addEventListener("afterprint", () => {
  fromPaper();
  if (view.theme !== printed) actions.theme();
});

/** The user went to another address of the open page: show what it says. */
function addressed(): void {
  const { open, tick, ...chosen } = initialView(location.hash);
  Object.assign(view, chosen);
  if (chosen.at === null) clock.live();
  else {
    clock.pause();
    clock.seek(chosen.at);
  }
  picture.theme();
  picture.goToView();
  overlays.apply();
  actions.select(chosen.selected, false);
}

// The page itself replaces the address: that is no such event.
window.addEventListener("hashchange", addressed);
if (view.at !== null) clock.seek(view.at);
// The clock and ages go on between frames, and while no answer comes.
setInterval(() => redraw(), PANEL_MS);
void overlays.load();
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
