/** How badly a sensor does, and why: what its list is sorted by. */

import type { Sensor } from "../service/feed";
import { aged, lasting } from "../time/presence";
import type { Store } from "./store";

/** Noise over the configured one, and detection, that an operator should look at. */
const NOISE_RATIO_MAX = 1.5;
const DETECTION_MIN = 0.7;
/** Scans without a plot after which a sensor counts as silent; seconds without a scan period. */
const SCANS_MAX = 5;
const SILENCE_MAX_S = 60;
/** A sigma that is at least so much of the prior has not been reduced by any plot. */
const UNTOUCHED_RATIO_MIN = 0.999;
/** Causes that put the plots of a sensor at wrong positions: the biases of others absorb part of them. */
const MISPLACED = new Set(["site", "positions_displaced", "clock", "time_of_scan", "range_gain", "ground_ranges"]);
/** Causes by which measurements are missing: they move none of the others. */
const MISSING = new Set(["ends_early", "starts_late", "no_measurements", "range_max"]);

export type Level = "FAULT" | "ALARM" | "SILENT" | "BEARINGS ONLY" | "CHECK" | "NO DATA" | "DISABLED" | "OK";

export interface Severity {
  level: Level;
  rank: number;
  /** Sentences, the most important first. */
  reasons: string[];
}

/** What the service says of all sensors together. */
export interface Reception {
  /** Time by which the last data are older than they say, s: 0 while they come, null where it is not known. */
  olderS: number | null;
  /** A sentence on rejected measurements; empty: none was rejected. */
  rejects: string;
}

const BEARINGS_ONLY = "It delivers bearings only: no plot in the last 30 s has a range, as under jamming.";

const RECEIVING: Reception = { olderS: 0, rejects: "" };

const RANKS: Record<Level, number> = { FAULT: 4, ALARM: 3, SILENT: 3, "BEARINGS ONLY": 2.5, CHECK: 2, "NO DATA": 1, DISABLED: 0, OK: 0 };

/** What each alarm is called, and what it means; those without a meaning here have figures in it. */
const ALARMS: Record<string, { name: string; meaning?: string }> = {
  silent: { name: "no plots", meaning: "No plots for five scans of aircraft that other radars still detect." },
  bias_jump: { name: "bias jump", meaning: "A bias jumped within the last eight scans." },
  noise: { name: "noise", meaning: "The noise is more than twice, or less than a quarter of, the configured noise." },
  site: { name: "wrong site", meaning: "Its configured site is wrong, or the site of a radar that detects the same aircraft." },
  address: { name: "wrong Mode S address", meaning: "A plot updated a track with a different Mode S address: a bug in multiradar." },
  clock: { name: "wrong clock" },
  storm: { name: "excessive number of measurements" },
};

/** An alarm in words. */
export function alarmName(alarm: string): string {
  return ALARMS[alarm]?.name ?? alarm.replaceAll("_", " ");
}

export function alarmsOf(sensor: Sensor): string[] {
  const alarms = sensor.health?.["alarms"];
  const named = typeof alarms === "string" && alarms !== "" ? alarms.split(",") : [];
  if (sensor.clock_lead_s != null) named.push("clock");
  if (sensor.storm) named.push("storm");
  return named;
}

export function severityOf(sensor: Sensor, store: Store, { olderS, rejects }: Reception = RECEIVING): Severity {
  if (sensor.enabled === false) {
    return { level: "DISABLED", rank: RANKS.DISABLED, reasons: ["Disabled by an operator or in the sensors file: its measurements are rejected."] };
  }
  const alarms = alarmsOf(sensor);
  // The name stands before them on the page.
  const causes = sensor.diagnoses.map(({ sentence }) => ended(sentence.startsWith(`${sensor.id}: `) ? sentence.slice(sensor.id.length + 2) : sentence));
  const meaning = (alarm: string): string => alarm === "storm"
    ? `Excessive number of measurements: ${sensor.storm}.` : alarm === "clock"
    ? `Its clock is ${(sensor.clock_lead_s ?? 0).toFixed(0)} s ahead of the data time.` : ALARMS[alarm]?.meaning ?? `Alarm: ${alarmName(alarm)}.`;
  const seen = doubts(sensor, olderS);
  // What a cause or a figure says better is not repeated.
  const isSaid = (alarm: string): boolean => (alarm === "site" && causes.some((one) => one.includes("site")))
    || (alarm === "noise" && seen.some((one) => one.includes("noise")));
  const isBearing = isBearingsOnly(sensor, store) && olderS === 0;
  const reasons = [...causes, ...alarms.filter((one) => !isSaid(one)).map(meaning),
    ...(isBearing ? [BEARINGS_ONLY] : []), ...seen];
  const isUnused = (sensor.updates ?? sensor.last_update_s ?? 0) === 0 && !store.hasPlots(sensor.id) && !store.hasBearings(sensor.id);
  const level: Level = causes.length > 0 ? "FAULT" : alarms.includes("silent") ? "SILENT" : alarms.length > 0 ? "ALARM"
    : isUnused || olderS !== 0 ? "NO DATA" : isBearing ? "BEARINGS ONLY" : reasons.length > 0 ? "CHECK" : "OK";
  if (level === "NO DATA" && !isUnused) reasons.unshift(olderS === null ? "No data since the service started." : `No data for ${lasting(olderS)}.`);
  else if (level === "NO DATA") {
    if (rejects !== "") reasons.unshift(rejects);
    reasons.unshift(sensor.updates === null ? "No plot updated a track in the last two minutes." : "No plot has updated a track yet.");
  }
  return { level, rank: RANKS[level], reasons };
}

/** Whether a radar delivers azimuths without ranges, as under jamming. */
export function isBearingsOnly(sensor: Sensor, store: Store): boolean {
  return sensor.kind === "radar" && store.hasOnlyBearings(sensor.id);
}

/** Whether a radar delivers no plots now: its probability of detection and noise are those of before. */
export function isWithoutPlots(sensor: Sensor, store: Store, olderS: number | null): boolean {
  return olderS !== 0 || alarmsOf(sensor).includes("silent") || isUnheard(sensor) || isBearingsOnly(sensor, store);
}

/** Why the biases of a radar mean nothing: they absorb an error that they do not model; empty: they do not. */
export function doubtOf({ level }: Severity, sensor: Sensor, sensors: readonly Sensor[]): string {
  const isWrong = level === "FAULT" && sensor.diagnoses.some(({ code }) => !MISSING.has(code ?? ""));
  if (isWrong || isMisplaced(sensor)) return "this sensor has a fault";
  if (alarmsOf(sensor).includes("clock")) return "the clock of this sensor is wrong";
  const wrong = sensors.find(isMisplaced);
  return wrong === undefined ? "" : `the positions from ${wrong.id} are wrong`;
}

function isMisplaced(sensor: Sensor): boolean {
  return sensor.diagnoses.some(({ code }) => MISPLACED.has(code ?? "")) || alarmsOf(sensor).includes("site");
}

/** What its site on the map says in a word; empty where there is nothing to say. */
export function wordOf({ level }: Severity): string {
  return level === "OK" || level === "CHECK" ? "" : level;
}

/** Sensors by severity, the worst first; then by name. */
export function bySeverity(sensors: readonly Sensor[], store: Store, reception?: Reception): { sensor: Sensor; severity: Severity }[] {
  return sensors
    .map((sensor) => ({ sensor, severity: severityOf(sensor, store, reception) }))
    .sort((a, b) => b.severity.rank - a.severity.rank || b.severity.reasons.length - a.severity.reasons.length
      || (a.sensor.id < b.sensor.id ? -1 : 1));
}

/** A sentence with its full stop. */
function ended(sentence: string): string {
  return /[.!?]$/.test(sentence) ? sentence : `${sentence}.`;
}

/** A sentence at the beginning of a paragraph: with a capital, unless its first word is the name of a setting. */
export function capitalised(sentence: string): string {
  return /^[a-z]+[\s,:]/.test(sentence) ? `${sentence.charAt(0).toUpperCase()}${sentence.slice(1)}` : sentence;
}

function doubts(sensor: Sensor, olderS: number | null): string[] {
  const { health } = sensor;
  const found: string[] = [];
  const value = (name: string): number => numberOf(health?.[name]);
  for (const [name, what] of [["range_sigma_ratio", "range"], ["azimuth_sigma_ratio", "azimuth"]] as const) {
    const ratio = value(name);
    if (ratio > NOISE_RATIO_MAX) found.push(`The noise of the ${what} is ${ratio.toFixed(1)} times the configured noise.`);
  }
  const detection = value("detection_probability");
  if (detection < DETECTION_MIN) found.push(`The probability of detection is only ${(100 * detection).toFixed(0)} %.`);
  if (isUnheard(sensor)) found.push(`No plot for ${aged(sensor.age_s ?? NaN, olderS)}.`);
  return found;
}

/** Whether its last plot is older than some scans. */
function isUnheard({ age_s: age, rotation_period_s: period }: Sensor): boolean {
  return age !== null && age > (period === null ? SILENCE_MAX_S : SCANS_MAX * period);
}

/** The estimate of a bias, NaN without any information: before the first plot that shows it, it is that of the prior. */
export function estimateOf(bias: Record<string, unknown>): number {
  return numberOf(bias["prior_ratio"]) >= UNTOUCHED_RATIO_MIN ? NaN : numberOf(bias["estimate"]);
}

/** A number of a document, NaN if it has none. */
export function numberOf(value: unknown): number {
  return typeof value === "number" ? value : NaN;
}
