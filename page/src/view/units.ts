/** Formats of values: aeronautical units or SI, and times in UTC. */

export type Units = "aero" | "si";

export const FOOT_M = 0.3048;
export const KNOT_MPS = 0.514444;
export const NAUTICAL_MILE_M = 1852;

const known = (value: number): boolean => Number.isFinite(value);

/** A level; an estimated one, which was not received, has a tilde. */
export function level(heightM: number, units: Units, isEstimated = false): string {
  if (!known(heightM)) return "–";
  const mark = isEstimated ? "~" : "";
  const shown = levelNumber(heightM, units);
  return units === "si" ? `${mark}${shown} m` : `${mark}F${String(shown).padStart(3, "0")}`;
}

/** A level as it is shown: a flight level, or metres. */
export function levelNumber(heightM: number, units: Units): number {
  return units === "si" ? Math.round(heightM) : Math.max(0, Math.round(heightM / FOOT_M / 100));
}

/** A difference of heights. */
export function height(metres: number, units: Units): string {
  return units === "si" ? `${Math.round(metres)} m` : `${Math.round(metres / FOOT_M / 10) * 10} ft`;
}

/** A speed; an uncertain one has a tilde. */
export function speed(mps: number, units: Units, isUncertain = false): string {
  if (!known(mps)) return "–";
  const mark = isUncertain ? "~" : "";
  return units === "si" ? `${mark}${Math.round(mps)} m/s` : `${mark}${Math.round(mps / KNOT_MPS)} kt`;
}

export function climb(mps: number, units: Units): string {
  if (!known(mps)) return "–";
  const value = units === "si" ? Math.round(10 * mps) / 10 : Math.round((mps / FOOT_M) * 60 / 50) * 50;
  // No "+0" and no "-0".
  const text = value === 0 ? "0" : `${value > 0 ? "+" : "−"}${Math.abs(value).toFixed(units === "si" ? 1 : 0)}`;
  return `${text} ${units === "si" ? "m/s" : "ft/min"}`;
}

/** Trend of height: climbing, descending or level. */
export function trend(mps: number): string {
  if (!known(mps) || Math.abs(mps) < 1.5) return "";
  return mps > 0 ? "↑" : "↓";
}

export function distance(metres: number, units: Units): string {
  if (!known(metres)) return "–";
  if (metres < 2000 || units === "si") {
    return metres < 2000 ? `${Math.round(metres)} m` : `${(metres / 1000).toFixed(1)} km`;
  }
  return `${(metres / NAUTICAL_MILE_M).toFixed(1)} NM`;
}

export function heading(degrees: number): string {
  return known(degrees) ? `${String(Math.round(degrees) % 360).padStart(3, "0")}°` : "–";
}

export function utc(seconds: number | null): string {
  if (seconds === null || !known(seconds)) return "no data";
  return new Date(seconds * 1000).toISOString().slice(11, 19);
}

/** Times below are times of the day without a date, s. */
const DATED_FROM_S = 366 * 86_400;

/** The date; empty where it is not known. */
export function date(seconds: number | null): string {
  return seconds === null ? "" : (isoTime(seconds) ?? "").slice(0, 10);
}

/** A text of the service with its Unix times, in seconds, as dates and times. */
export function dated(text: string): string {
  return text.replace(/\b([0-9]{9,10})(\.[0-9]+)? s\b/g, (_, whole: string) => `${date(Number(whole))} ${utc(Number(whole))} UTC`);
}

/** A time in ISO 8601; null where the date is not known. */
export function isoTime(seconds: number): string | null {
  return Math.abs(seconds) >= DATED_FROM_S ? new Date(Math.round(seconds * 1000)).toISOString() : null;
}
