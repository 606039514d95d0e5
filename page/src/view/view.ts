/** What the user chose: shown parts, units, selection and place; kept in the address of the page. */

import type { Units } from "./units";

export type Switch =
  | "tracks" | "joined" | "labels" | "trails" | "vectors" | "uncertainty" | "plots" | "biases" | "sites" | "tentative" | "ground" | "encounters" | "sweeps" | "trajectories";

/** Parts of the panels, of which one is open. */
export type Tab = "tracks" | "track" | "sensors" | "system" | "map";

/** Which tracks are shown, beyond the switches. */
export interface Filters {
  /** In callsign, code, address or number. */
  text: string;
  /** Level band, metres; null: open. */
  fromM: number | null;
  toM: number | null;
  /** With a plot of this sensor in the last seconds; "": any. */
  sensor: string;
  /** "": any. */
  state: string;
  /** In the table, only what the map shows. */
  area: boolean;
}

export interface ViewState {
  shown: Record<Switch, boolean>;
  units: Units;
  theme: "dark" | "light";
  selected: number | null;
  filters: Filters;
  tab: Tab;
  /** The radar whose sheet is open. */
  sensor: string | null;
  /** On a narrow screen: whether the panels are open. */
  open: boolean;
  centre: [number, number] | null;
  zoom: number | null;
  /** Time between frames, ms. */
  tick: number;
  /** Sensors whose plots, rings and sweeps are not shown. */
  hiddenSensors: Set<string>;
  /** The time shown, s; null: the present, or that of a run that plays. */
  at: number | null;
  /** The one of two recorded runs that table, selection, search and exports are of; the other is for comparison. */
  run: 0 | 1;
  /** Runs and overlays that are switched off. */
  hidden: Set<string>;
}

/** Time between frames, ms: normally, and at least. */
const TICK_MS = 500;
const TICK_MIN_MS = 100;
const TICK_MAX_MS = 60_000;

/** Each switch: its key, its name and whether it is on at first. */
export const SWITCHES: readonly [Switch, string, string, boolean][] = [
  ["biases", "b", "Correct plots for biases", true],
  ["plots", "p", "Plots", true],
  ["joined", "i", "Lines between the plots of each sensor", false],
  ["tracks", "s", "Tracks", true],
  ["labels", "l", "Labels", true],
  ["trails", "h", "Earlier positions", true],
  ["vectors", "v", "Speed vectors (60 s)", true],
  ["uncertainty", "u", "Position uncertainty (3 sigma)", true],
  ["sites", "r", "Sites and range rings", true],
  ["sweeps", "w", "Radar sweeps", true],
  ["encounters", "e", "Encounters (5 NM, 1000 ft, 2 min)", true],
  ["trajectories", "y", "Trajectory set of the selected track", true],
  ["tentative", "t", "Tentative tracks", true],
  ["ground", "g", "Aircraft on the ground", true],
];

/** The tabs: name, key, title. */
export const TABS: readonly [Tab, string, string][] = [
  ["tracks", "1", "Tracks"],
  ["track", "2", "Track"],
  ["sensors", "3", "Radars"],
  ["system", "4", "System"],
  ["map", "5", "Map"],
];

/** Limits of the map. */
export const ZOOM_MIN = 2;
export const ZOOM_MAX = 18;
const LATITUDE_MAX = 85;
/** Later than any recording, s. */
const TIME_MAX_S = 1e10;

export function initialView(address: string): ViewState {
  const given = new URLSearchParams(address.replace(/^#/, ""));
  const [off, on] = [new Set((given.get("off") ?? "").split(",")), new Set((given.get("on") ?? "").split(","))];
  const number = (name: string): number | null => {
    const text = given.get(name);
    const value = text === null || text.trim() === "" ? NaN : Number(text);
    return Number.isFinite(value) ? value : null;
  };
  const [longitude, latitude, zoom] = [number("lon"), number("lat"), number("zoom")];
  const [track, at] = [number("track"), number("at")];
  const shown = Object.fromEntries(
    SWITCHES.map(([name, , , initially]) => [name, initially ? !off.has(name) : on.has(name)]),
  ) as Record<Switch, boolean>;
  return {
    shown,
    units: given.get("units") === "si" ? "si" : "aero",
    theme: given.get("theme") === "light" ? "light" : "dark",
    selected: track !== null && Number.isSafeInteger(track) && track > 0 ? track : null,
    filters: {
      text: given.get("q") ?? "",
      fromM: number("from"),
      toM: number("to"),
      sensor: given.get("by") ?? "",
      state: given.get("state") ?? "",
      area: given.get("area") === "map",
    },
    tab: TABS.find((names) => names.some((one) => one.toLowerCase() === given.get("tab")))?.[0] ?? "tracks",
    sensor: given.get("sensor"),
    open: true,
    centre: longitude !== null && latitude !== null
      ? [((((longitude + 180) % 360) + 360) % 360) - 180, Math.max(-LATITUDE_MAX, Math.min(LATITUDE_MAX, latitude))] : null,
    zoom: zoom === null ? null : Math.max(ZOOM_MIN, Math.min(ZOOM_MAX, zoom)),
    hiddenSensors: new Set((given.get("hide") ?? "").split(",").filter((one) => one !== "")),
    tick: Math.min(TICK_MAX_MS, Math.max(TICK_MIN_MS, number("tick") ?? TICK_MS)),
    at: at !== null && Math.abs(at) <= TIME_MAX_S ? at : null,
    run: given.get("run") === "1" ? 1 : 0,
    hidden: new Set((given.get("without") ?? "").split(",").filter((one) => /^[or][0-9]{1,2}$/.test(one))),
  };
}

export function addressOf(view: ViewState): string {
  const given = new URLSearchParams();
  for (const initially of [true, false]) {
    const changed = SWITCHES.filter(([name, , , first]) => first === initially && view.shown[name] !== first);
    if (changed.length > 0) given.set(initially ? "off" : "on", changed.map(([name]) => name).join(","));
  }
  if (view.units !== "aero") given.set("units", view.units);
  if (view.theme !== "dark") given.set("theme", view.theme);
  if (view.selected !== null) given.set("track", String(view.selected));
  const { text, fromM, toM, sensor, state, area } = view.filters;
  const chosen = { q: text, from: fromM, to: toM, by: sensor, state, area: area ? "map" : "", sensor: view.sensor };
  for (const [name, value] of Object.entries(chosen)) if (value !== null && value !== "") given.set(name, String(value));
  if (view.tab !== "tracks") given.set("tab", view.tab);
  if (view.centre !== null) {
    given.set("lon", view.centre[0].toFixed(4));
    given.set("lat", view.centre[1].toFixed(4));
  }
  if (view.hiddenSensors.size > 0) given.set("hide", [...view.hiddenSensors].join(","));
  if (view.tick !== TICK_MS) given.set("tick", String(view.tick));
  if (view.zoom !== null) given.set("zoom", view.zoom.toFixed(2));
  if (view.at !== null) given.set("at", view.at.toFixed(1));
  if (view.run !== 0) given.set("run", String(view.run));
  if (view.hidden.size > 0) given.set("without", [...view.hidden].sort().join(","));
  return `#${given.toString().replaceAll("%2C", ",")}`;
}
