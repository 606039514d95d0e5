/** Whether the present that is shown is one of data: without data nothing may look alive. */

import type { Feed } from "../service/feed";
import type { Clock } from "./clock";

export interface Present {
  word: "Connecting" | "Live" | "No contact" | "Not running" | "No data";
  /** Time since the last measurement, s: 0 while they come, null where it is not known. */
  forS: number | null;
}

const LIVE: Present = { word: "Live", forS: 0 };

export function presentOf(feed: Feed, nowMs: number): Present {
  const { status } = feed;
  const number = (name: string): number | null => (typeof status[name] === "number" ? status[name] : null);
  const sinceS = (nowMs - feed.statusMs) / 1000;
  const last = number("received_age_s") ?? number("silence_s");
  const forS = last === null ? null : last + sinceS;
  if (feed.isLost(nowMs) || feed.isUnreachable) return { word: "No contact", forS: forS ?? (nowMs - feed.lastAnswerMs) / 1000 };
  const { state } = status;
  if (state === undefined) return { word: "Connecting", forS: 0 };
  if (state !== "running") return { word: "Not running", forS };
  const waiting = (number("intake_rows") ?? 0) + (number("backlog_rows") ?? 0);
  if (waiting > 0) return LIVE;
  // Read every few seconds: what is newer than that is not known.
  const limitS = number("silence_limit_s");
  return limitS === null || (number("received_age_s") ?? Infinity) <= limitS ? LIVE : { word: "No data", forS };
}

/** Time by which the picture of the present is older than it says, s; null where it is not known. */
export function unheardS(feed: Feed, clock: Clock): number | null {
  return clock.isLive ? presentOf(feed, performance.now()).forS : 0;
}

/** The age of something in the picture that is older by so much, s. */
export function aged(ageS: number, olderS: number | null): string {
  if (olderS === null) return `≥ ${ageS.toFixed(0)} s`;
  return olderS === 0 ? `${ageS.toFixed(0)} s` : lasting(ageS + olderS);
}

/** A duration in its greatest unit. */
export function lasting(seconds: number): string {
  if (seconds < 120) return `${Math.round(seconds)} s`;
  return seconds < 7200 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 3600)} h`;
}
