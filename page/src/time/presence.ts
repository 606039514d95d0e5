/** Whether the present that is shown is one of data: without data nothing may look alive. */

import type { Feed } from "../service/feed";
import type { Clock } from "./clock";

export interface Present {
  word: "Connecting" | "Live" | "Delayed" | "No contact" | "Not running" | "No data";
  /** Time since the last measurement in the picture, s: 0 while they come, null where it is not known. */
  forS: number | null;
}

const LIVE: Present = { word: "Live", forS: 0 };

export function presentOf(feed: Feed, nowMs: number): Present {
  const { status } = feed;
  const number = (name: string): number | null => (typeof status[name] === "number" ? status[name] : null);
  const sinceS = (nowMs - feed.statusMs) / 1000;
  const silence = number("silence_s");
  // After a restart the service does not know when it received data before; the page may.
  const forS = feed.receivedMs !== null ? (nowMs - feed.receivedMs) / 1000 : silence === null ? null : silence + sinceS;
  const { state } = status;
  // While it starts the service has no picture, but it answers.
  if (feed.isStatusFresh(nowMs) && state !== undefined && state !== "running") return { word: "Not running", forS };
  if (feed.isLost(nowMs) || feed.isUnreachable) return { word: "No contact", forS: forS ?? (nowMs - feed.lastAnswerMs) / 1000 };
  if (state === undefined) return { word: "Connecting", forS: 0 };
  const lagS = lagOf(status);
  if (lagS !== null) return { word: "Delayed", forS: lagS + sinceS };
  const waiting = (number("intake_rows") ?? 0) + (number("backlog_rows") ?? 0);
  if (waiting > 0) return LIVE;
  // Read every few seconds: what is newer than that is not known.
  const limitS = number("silence_limit_s");
  return limitS === null || (number("received_age_s") ?? Infinity) <= limitS ? LIVE : { word: "No data", forS };
}

/** How long the oldest message has been waiting if the service does not keep up, s; null: it does. */
function lagOf(status: Record<string, unknown>): number | null {
  const unready = Array.isArray(status["unready"]) ? (status["unready"] as { code?: unknown }[]) : [];
  if (!unready.some(({ code }) => code === "LAG")) return null;
  return Math.max(0, ...Object.values((status["lags_s"] ?? {}) as Record<string, number>));
}

/** Time for which no sensor has delivered, s; null where it is not known. */
export function silentS(feed: Feed, clock: Clock): number | null {
  const { word, forS } = presentOf(feed, performance.now());
  return clock.isLive && word !== "Delayed" ? forS : 0;
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
