/** The sheet of a sensor: biases over time, innovations by range and azimuth, detection, noise, clock. */

import { html, nothing, type TemplateResult } from "lit";

import type { Sensor } from "../../service/feed";
import { bars, type Bar } from "../charts/bars";
import type { ChartData } from "../charts/chart";
import type { App } from "../panel";
import { Source } from "../source";
import { signed } from "../track/contributions";
import { figure } from "../track/curves";
import { utc } from "../../view/units";
import { capitalised, doubtOf, estimateOf, isWithoutPlots, numberOf, type Severity } from "../../sky/severity";
import { aged, silentS, unheardS } from "../../time/presence";

const EVERY_MS = 5000;
const PAST_S = 3600;
/** Means of fewer plots are not shown. */
const PLOTS_MIN = 20;

interface Estimate {
  time_s: number;
  parameter: string;
  estimate: number;
  sigma: number;
}

interface Bin {
  begin: number;
  end: number;
  plots: number;
  range_mean_m: number;
  range_rms_m: number;
  azimuth_mean_deg: number;
  azimuth_rms_deg: number;
}

interface Residuals {
  sensors: { sensor_id: string; plots: number; by_range: Bin[]; by_azimuth: Bin[] }[];
}

const history = new Source<{ biases: Estimate[] }>(EVERY_MS, "biases");
const residuals = new Source<Residuals>(EVERY_MS);

/** The sheet, with what is wrong with the sensor in sentences, but for the first ones, which are said elsewhere. */
export function sensorSheet(sensor: Sensor, severity: Severity, said: number, app: App): TemplateResult {
  const doubt = doubtOf(severity, sensor, app.feed.sensors);
  return html`<section class="sheet" aria-label="Sensor ${sensor.id}"><h3 class="own">${sensor.id}</h3>
    ${severity.reasons.slice(said).map((one) => html`<p class="alarm">${capitalised(one)}</p>`)}
    ${sensor.biases.length === 0 ? html`<p class="hint">No bias is estimated${(sensor.updates ?? 1) === 0 ? " yet" : ""}.</p>` : biases(sensor, doubt)}
    ${curves(sensor, app)}
    ${sensor.kind === "radar" ? byPlace(sensor, app) : nothing}
    ${facts(sensor, doubt, app)}</section>`;
}

function biases({ biases: found }: Sensor, doubt: string): TemplateResult {
  return html`<table><thead><tr><th scope="col">Bias</th><th scope="col">Estimate</th><th scope="col">± 2 sigma</th>
    <th scope="col" title="Sigma relative to the prior sigma">Of prior</th></tr></thead>
    <tbody>${found.map((bias) => {
      const [estimate, sigma, ratio] = [estimateOf(bias), numberOf(bias["sigma"]), numberOf(bias["prior_ratio"])];
      const [name, unit] = named(String(bias["parameter"] ?? ""));
      const digits = digitsOf(sigma);
      return html`<tr><th scope="row">${name}</th><td>${Number.isNaN(estimate) ? "–" : `${signed(estimate, digits)}${unit}`}</td><td>${(2 * sigma).toFixed(digits)}${unit}</td>
        <td>${Number.isFinite(ratio) ? `${Number((100 * ratio).toPrecision(2))} %` : "–"}</td></tr>`;
    })}</tbody></table>
    ${doubt !== "" ? html`<p class="alarm">Do not use these biases: ${doubt}, and the biases absorb part of that error,
      which ± 2 sigma does not include. Correct the fault first.</p>` : nothing}
    <p class="hint">${doubt !== "" ? "" : "The true bias lies within ± 2 sigma of the estimate with a probability of 95 %. "}Of prior: sigma as a
      percentage of the sigma before the first plot; at 100 % the plots contain no information about this bias.</p>`;
}

/** Each bias over the last hour, with a band of two sigmas. */
function curves(sensor: Sensor, app: App): TemplateResult | typeof nothing {
  const { dataTimeS } = app.store;
  if (dataTimeS === null || sensor.biases.length === 0) return nothing;
  const atS = app.feed.sensorsAtS ?? dataTimeS;
  const address = `v1/sensors/${encodeURIComponent(sensor.id)}/bias?history=true&since=${Math.max(0, atS - PAST_S).toFixed(1)}`;
  const found = history.read(app, `${sensor.id} ${app.clock.jumps}`, address, false, app.feed.sensorsAtS ?? Infinity);
  if (found === null) return html`<p class="hint">${history.problem || "Loading the biases…"}</p>`;
  const names = [...new Set(found.biases.map((one) => one.parameter))];
  return html`${names.map((parameter) => {
    const rows = settled(found.biases.filter((one) => one.parameter === parameter && one.time_s <= atS));
    const [name, unit] = named(parameter);
    const data: ChartData = {
      label: `${name}, ± 2 sigma`, unit: unit.trim(), times: rows.map((one) => one.time_s), digits: digitsOf(rows[rows.length - 1]?.sigma ?? NaN),
      curves: [
        { label: "+2 sigma", colour: "--accent", values: rows.map((one) => one.estimate + 2 * one.sigma), band: true },
        { label: "−2 sigma", colour: "--accent", values: rows.map((one) => one.estimate - 2 * one.sigma), band: true },
        { label: name, colour: "--accent", values: rows.map((one) => one.estimate) },
      ],
    };
    return rows.length < 2 ? nothing : figure(data);
  })}`;
}

/** Without the first estimates: their sigma is that of the prior, and would hide everything else. */
function settled(rows: Estimate[]): Estimate[] {
  const least = Math.min(...rows.map((one) => one.sigma));
  const begin = rows.findIndex((one) => one.sigma <= 20 * least);
  return rows.slice(Math.max(begin, 0));
}

function byPlace(sensor: Sensor, app: App): TemplateResult {
  const answer = residuals.read(app, "all", "v1/residuals");
  const found = answer?.sensors.find((one) => one.sensor_id === sensor.id);
  if (found === undefined) return html`<p class="hint">${answer === null ? residuals.problem || "Loading the innovations…" : "No plots in the last ten minutes."}</p>`;
  const km = (begin: number): string => `${begin / 1000} km`;
  const degrees = (begin: number): string => `${begin}°`;
  const range = (one: Bin): [number, number] => [one.range_mean_m, one.range_rms_m];
  const azimuth = (one: Bin): [number, number] => [one.azimuth_mean_deg, one.azimuth_rms_deg];
  return html`<h4>Mean innovation over the last ten minutes <small>${found.plots} plots</small></h4>
    <p class="hint">A pattern indicates an error that the biases do not model, such as a wrong site or a tilted or eccentric antenna.</p>
    <div class="grid">
    ${bars("Range by azimuth", "m", barsOf(found.by_azimuth, 360, degrees, range), 0)}
    ${bars("Azimuth by azimuth", "°", barsOf(found.by_azimuth, 360, degrees, azimuth), 3)}
    ${bars("Range by range", "m", barsOf(found.by_range, 0, km, range), 0)}
    ${bars("Azimuth by range", "°", barsOf(found.by_range, 0, km, azimuth), 3)}</div>`;
}

/** A bar for each interval from zero to an end, or to the last one with plots. */
function barsOf(bins: readonly Bin[], end: number, name: (begin: number) => string, value: (one: Bin) => [number, number]): Bar[] {
  const last = bins[bins.length - 1];
  if (last === undefined) return [];
  const step = last.end - last.begin;
  const byBegin = new Map(bins.map((one) => [one.begin, one]));
  return Array.from({ length: Math.round(Math.max(end, last.end) / step) }, (_, number) => {
    const begin = number * step;
    const one = byBegin.get(begin);
    if (one === undefined || one.plots < PLOTS_MIN) return { name: name(begin), mean: 0, error: 0, count: 0 };
    const [mean, rms] = value(one);
    return { name: name(begin), mean, error: Math.sqrt(Math.max(0, rms * rms - mean * mean) / one.plots), count: one.plots };
  });
}

const KINDS: Record<string, string> = {
  radar: "radar", position: "reported positions (ADS-B or multilateration)", bearing: "direction finder",
};

function facts(sensor: Sensor, doubt: string, { feed, clock: shown, store }: App): TemplateResult {
  const { health } = sensor;
  const now = feed.sensorsAtS === null ? "" : " (now)";
  const olderS = unheardS(feed, shown);
  const value = (name: string): number => numberOf(health?.[name]);
  const arrivals = ((feed.status["arrivals"] ?? {}) as Record<string, Record<string, unknown>>)[sensor.id];
  const delay = [numberOf(arrivals?.["delay_s_median"]), numberOf(arrivals?.["delay_s_p99"])] as const;
  const before = isWithoutPlots(sensor, store, silentS(feed, shown)) ? "no plots at present; previously: " : "";
  const noise = (ratio: number, configured: number | null, unit: string): string =>
    Number.isFinite(ratio) && configured !== null ? `${before}${ratio.toFixed(2)} × ${configured}${unit}` : "not estimated yet";
  const clock = sensor.biases.find((one) => one["parameter"] === "time_offset_s");
  const rows: [string, string][] = [
    ["Kind", KINDS[sensor.kind] ?? sensor.kind],
    ["Updates", [sensor.updates === null ? "" : String(sensor.updates), sensor.age_s === null ? "" : `last ${olderS === 0 ? `${sensor.age_s.toFixed(1)} s` : aged(sensor.age_s, olderS)} ago`]
      .filter((one) => one !== "").join(", ") || (sensor.updates === null ? "none in the last 2 min" : "none")],
    ["Scan period", sensor.rotation_period_s === null ? "not configured" : `${sensor.rotation_period_s} s`],
    [`Latency behind data time${now}`, Number.isFinite(delay[0]) ? `${delay[0].toFixed(2)} s, 99 %: ${delay[1].toFixed(2)} s` : "no data"],
    [`Received too late${now}`, arrivals === undefined ? "no data" : String(numberOf(arrivals["late"]))],
    ...asterixClock(feed.status, sensor.id, now),
    ["Clock offset, estimated", clock === undefined ? "not estimated" : `${signed(numberOf(clock["estimate"]), 3)} ± ${(2 * numberOf(clock["sigma"])).toFixed(3)} s`],
  ];
  if (sensor.kind === "radar") {
    rows.push(
      ["Detection probability", Number.isFinite(value("detection_probability"))
        ? `${before}${(100 * value("detection_probability")).toFixed(1)} % of ${value("looks").toFixed(0)} scans` : "not estimated yet"],
      ["Range noise", noise(value("range_sigma_ratio"), sensor.range_sigma_m, " m")],
      ["Azimuth noise", noise(value("azimuth_sigma_ratio"), sensor.azimuth_sigma_deg, "°")],
      ["Tracks in coverage", Number.isFinite(value("tracks_in_cover")) ? `${value("tracks_heard")} of ${value("tracks_in_cover")} detected` : "–"],
      ["Site error", doubt !== "" ? "not valid: estimated relative to tracks that the fault has displaced" : Number.isFinite(value("site_sigma_m"))
        ? `${signed(value("site_east_m"), 0)} m east, ${signed(value("site_north_m"), 0)} m north (±\u00a0${(2 * value("site_sigma_m")).toFixed(0)}\u00a0m)` : "not estimated yet"],
      ["Bias jumps", `${Number.isFinite(value("bias_jumps")) ? value("bias_jumps") : 0}${
        Number.isFinite(value("last_jump_s")) ? `, the last at ${utc(value("last_jump_s"))}` : ""}`],
    );
  }
  return html`<h4>Operation</h4><dl class="facts">${rows.map(([name, text]) => html`<dt>${name}</dt><dd>${text}</dd>`)}</dl>`;
}

/** Offset and latency of the messages of a radar, from their times and those of their reception. */
function asterixClock(status: Record<string, unknown>, id: string, now: string): [string, string][] {
  const { clocks } = (status["asterix"] ?? {}) as { clocks?: Record<string, Record<string, unknown>> };
  const found = clocks?.[id];
  if (found === undefined) return [];
  const seconds = (name: string): string => {
    const value = numberOf(found[name]);
    return Number.isFinite(value) ? `${signed(value, 3)} s` : "not known";
  };
  const alarm = typeof found["reason"] === "string" && found["alarm"] != null ? `: ${found["reason"]}` : "";
  return [
    [`Clock offset, ASTERIX${now}`, `${seconds("clock_offset_s")}${alarm}`],
    [`Latency, ASTERIX${now}`, `${seconds("latency_median_s")}, 99 %: ${seconds("latency_p99_s")}`],
  ];
}

const NAMES: Record<string, [string, string]> = {
  range_offset_m: ["Range offset", " m"], azimuth_offset_deg: ["Azimuth offset", "°"], range_gain: ["Range gain", ""],
  time_offset_s: ["Time offset", " s"], azimuth_sine_deg: ["Azimuth eccentricity, sine", "°"],
  azimuth_cosine_deg: ["Azimuth eccentricity, cosine", "°"], frame_east_m: ["Frame shift east", " m"],
  frame_north_m: ["Frame shift north", " m"], frame_rotation_deg: ["Frame rotation", "°"],
};

function named(parameter: string): [string, string] {
  return NAMES[parameter] ?? [parameter, ""];
}

/** As many digits as two significant ones of a sigma need. */
function digitsOf(sigma: number): number {
  return sigma > 0 ? Math.max(0, Math.min(6, 1 - Math.floor(Math.log10(sigma)))) : 2;
}
