/** Which tracks the switches and the filter show. */

import type { Track } from "./store";
import type { ViewState } from "./view";

/** Whether the switches and the filter show a track. */
export function isShown(track: Track, view: ViewState): boolean {
  if (track.state === "tentative" && !view.shown.tentative) return false;
  if (track.onGround && !view.shown.ground) return false;
  return matches(track, view.filter);
}

export function matches(track: Track, filter: string): boolean {
  if (filter === "") return true;
  const wanted = filter.trim().toUpperCase();
  if (wanted === "") return true;
  return [track.callsign, track.code, track.address, String(track.id)].some(
    (text) => text !== null && text.toUpperCase().includes(wanted),
  );
}
