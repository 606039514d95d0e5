/** Colours of the map, by theme. */

import type { ViewState } from "../view";

export interface Palette {
  background: string;
  land: string;
  border: string;
  track: string;
  faint: string;
  /** Symbols of tracks without recent plots. */
  stale: string;
  selected: string;
  label: string;
  /** Callout of what needs attention: encounters. */
  warning: string;
  /** Trajectory sets. */
  bundle: string;
  uncertainty: string;
  uncertaintyEdge: string;
}

/** Colours of radars that also differ in hue for the colour-blind (Okabe and Ito, 2008). */
const SENSOR_COLOURS = ["#e69f00", "#56b4e9", "#cc79a7", "#009e73", "#f0e442", "#d55e00", "#0072b2", "#999999"];

export const PALETTES: Record<ViewState["theme"], Palette> = {
  dark: {
    background: "#0c1316", land: "#121c20", border: "#2a3b42", track: "#b9e6cd", faint: "#6f8a93",
    stale: "#8a7d6a", selected: "#ffd24a", label: "#d5e4e6", warning: "#ff8f6b", bundle: "#e39ad0",
    uncertainty: "rgba(110, 180, 225, 0.12)", uncertaintyEdge: "rgba(110, 180, 225, 0.45)",
  },
  light: {
    background: "#dfe7eb", land: "#f7f6f2", border: "#a9b8bf", track: "#0a5136", faint: "#61757d",
    stale: "#8a6a3a", selected: "#a84300", label: "#14262c", warning: "#b3261e", bundle: "#8a2f78",
    uncertainty: "rgba(0, 90, 170, 0.10)", uncertaintyEdge: "rgba(0, 90, 170, 0.45)",
  },
};

/** The colour of a sensor, the same everywhere on the page. */
export function sensorColour(number: number): string {
  return SENSOR_COLOURS[number % SENSOR_COLOURS.length] ?? "#999999";
}

/** Letters of the map: condensed where the system has it, and of equal width. */
export const FONT = '"Roboto Mono Condensed", "Iosevka", "DejaVu Sans Mono", "Liberation Mono", Consolas, ui-monospace, monospace';
