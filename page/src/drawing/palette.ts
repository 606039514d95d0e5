/** Colours of the map, by theme. */

import type { ViewState } from "../view/view";

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
  /** Of radars: hues that differ for the colour-blind, too (Okabe and Ito, 2008), darker on light ground. */
  sensors: readonly string[];
}

/** Contrast with background and land (WCAG AA): texts 4.5, marks of sensors 3. */
export const PALETTES: Record<ViewState["theme"], Palette> = {
  dark: {
    background: "#0c1316", land: "#121c20", border: "#2a3b42", track: "#b9e6cd", faint: "#6f8a93",
    stale: "#9a8c78", selected: "#ffd24a", label: "#d5e4e6", warning: "#ff8f6b", bundle: "#e39ad0",
    uncertainty: "rgba(110, 180, 225, 0.12)", uncertaintyEdge: "rgba(110, 180, 225, 0.45)",
    sensors: ["#e69f00", "#56b4e9", "#cc79a7", "#009e73", "#f0e442", "#d55e00", "#0072b2", "#999999"],
  },
  light: {
    background: "#dfe7eb", land: "#f7f6f2", border: "#a9b8bf", track: "#0a5136", faint: "#4f626a",
    stale: "#75562a", selected: "#a84300", label: "#14262c", warning: "#b3261e", bundle: "#8a2f78",
    uncertainty: "rgba(0, 90, 170, 0.10)", uncertaintyEdge: "rgba(0, 90, 170, 0.45)",
    sensors: ["#a86400", "#1878b4", "#a84d82", "#007a58", "#807000", "#b84700", "#005b96", "#636363"],
  },
};

/** The colour of a sensor, the same everywhere on the page. */
export function sensorColour(number: number, { sensors }: Palette): string {
  return sensors[number % sensors.length] ?? sensors[sensors.length - 1] ?? "";
}

/** Letters of the map: condensed where the system has it, and of equal width. */
export const FONT = '"Roboto Mono Condensed", "Iosevka", "DejaVu Sans Mono", "Liberation Mono", Consolas, ui-monospace, monospace';
