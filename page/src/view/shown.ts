/** Which tracks the switches and the filters show: on the map and in the table alike. */

import { PLOTS_KEPT_S } from "../sky/plots";
import type { Track } from "../sky/store";
import { levelNumber } from "./units";
import type { Filters, ViewState } from "./view";

/** The names of the runs among what is hidden. */
export const RUN_KEYS = ["r0", "r1"] as const;

/** Whether the switches and the filters show a track, of the chosen run or of the other one. */
export function isShown(track: Track, view: ViewState, isOther = false): boolean {
  if (!view.shown.tracks || view.hidden.has(RUN_KEYS[isOther ? otherRun(view) : view.run])) return false;
  if (track.state === "tentative" && !view.shown.tentative) return false;
  if (track.onGround && !view.shown.ground) return false;
  return matches(track, view);
}

/** The run that is shown for comparison. */
export function otherRun({ run }: ViewState): 0 | 1 {
  return run === 0 ? 1 : 0;
}

function matches(track: Track, { filters, units }: ViewState): boolean {
  const { fromM, toM, sensor, state } = filters;
  if (state !== "" && track.state !== state) return false;
  // As levels are shown: rounded. A track of unknown level is in no band.
  const shown = levelNumber(track.heightM, units);
  if (fromM !== null && !(shown >= levelNumber(fromM, units))) return false;
  if (toM !== null && !(shown <= levelNumber(toM, units))) return false;
  if (sensor !== "" && !((track.heardS.get(sensor) ?? -Infinity) >= track.timeS - PLOTS_KEPT_S)) return false;
  return hasText(track, filters.text);
}

function hasText(track: Track, text: string): boolean {
  if (text === "") return true;
  const wanted = text.trim().toUpperCase();
  if (wanted === "") return true;
  return [track.callsign, track.code, track.address, String(track.id)].some(
    (one) => one !== null && one.toUpperCase().includes(wanted),
  );
}

/** Whether any filter is set. */
export function isFiltered({ text, fromM, toM, sensor, state, area }: Filters): boolean {
  return text !== "" || fromM !== null || toM !== null || sensor !== "" || state !== "" || area;
}

/** Whether no level is in the band: its lower limit is above the upper one. */
export function isBandEmpty({ fromM, toM }: Filters): boolean {
  return fromM !== null && toM !== null && fromM > toM;
}

/** A text that changes when other tracks may be shown. */
export function shownKey({ filters, shown }: ViewState): string {
  const { text, fromM, toM, sensor, state } = filters;
  return `${text} ${fromM} ${toM} ${sensor} ${state} ${shown.tentative} ${shown.ground} ${shown.tracks}`;
}
