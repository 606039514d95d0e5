/** Why a track is where it is: what each sensor and each plot of the last minute contributed. */

import { html, nothing, type TemplateResult } from "lit";

import { swatch } from "../swatch";
import { distance, utc } from "../../view/units";
import type { App } from "../panel";
import { acrossOf, alongOf, residualOf, sigmasOf, type TrackPlot, type TrackPlots } from "./documents";

const WINDOW_S = 60;
const PLOTS_MAX = 60;
/** Normalised innovations from here on are marked. */
const SIGMAS_MAX = 3;

interface Sum {
  sensor: string;
  plots: TrackPlot[];
  weight: number;
}

export function contributions({ plots, time_s: time }: TrackPlots, app: App): TemplateResult {
  const recent = plots.filter((one) => one.time_s >= time - WINDOW_S);
  const sums = bySensor(recent);
  const whole = sums.reduce((sum, one) => sum + one.weight, 0);
  const first = sums[0];
  const share = first === undefined || whole === 0 ? "" : `; ${first.sensor} has ${((100 * first.weight) / whole).toFixed(0)}\u00a0% of the weight`;
  return html`<p class="summary">${recent.length} ${recent.length === 1 ? "plot" : "plots"} from ${sums.length} ${
      sums.length === 1 ? "sensor" : "sensors"} in the last minute${share}.</p>
    <table><thead><tr><th scope="col">Sensor</th><th scope="col">Plots</th>
      <th scope="col" title="Relative influence on the estimate">Weight</th>
      <th scope="col" title="Bias correction of range and azimuth">Bias removed</th>
      <th scope="col" title="Median distance of the bias-corrected plots from the track">Residual</th></tr></thead>
    <tbody>${sums.map((one) => html`<tr><th scope="row">${swatch(one.sensor, app)}${one.sensor}</th><td>${one.plots.length}</td>
      <td>${whole === 0 ? "–" : `${((100 * one.weight) / whole).toFixed(0)} %`}</td>
      <td>${removed(one.plots[one.plots.length - 1])}</td>
      <td>${distance(median(one.plots.map(residualOf)), app.view.units)}</td></tr>`)}</tbody></table>
    <p class="hint">Weight: the sensor's relative influence on the position. Residual: median distance of its bias-corrected plots from the track.</p>
    <details><summary>Individual plots</summary>
      <table><thead><tr><th scope="col">UTC</th><th scope="col">Sensor</th>
        <th scope="col" title="Innovation along the line of sight (positions: east)">Along</th>
        <th scope="col" title="Innovation across the line of sight (positions: north)">Across</th>
        <th scope="col" title="Normalised innovation: typically about 1">Sigmas</th>
        <th scope="col" title="Influence on the estimate: 0 % (ignored) to 100 % (followed)">Weight</th></tr></thead>
      <tbody>${recent.slice(-PLOTS_MAX).reverse().map(plotRow)}</tbody></table>
      ${recent.length > PLOTS_MAX ? html`<p class="hint">The last ${PLOTS_MAX} of ${recent.length} plots.</p>` : nothing}</details>`;
}

function plotRow(plot: TrackPlot): TemplateResult {
  const sigmas = sigmasOf(plot);
  const far = sigmas !== null && sigmas > SIGMAS_MAX;
  return html`<tr><td>${utc(plot.time_s)}</td><td>${plot.sensor_id}</td><td>${metres(alongOf(plot))}</td>
    <td>${metres(acrossOf(plot))}</td>
    <td>${sigmas === null ? "first" : far ? html`<strong class="alarm">${sigmas.toFixed(1)} !</strong>` : sigmas.toFixed(1)}</td>
    <td>${plot.weight === null ? "–" : `${(100 * plot.weight).toFixed(0)} %`}</td></tr>`;
}

/** The sensors by weight, the greatest first. */
function bySensor(plots: readonly TrackPlot[]): Sum[] {
  const sums = new Map<string, Sum>();
  for (const plot of plots) {
    let sum = sums.get(plot.sensor_id);
    if (sum === undefined) sums.set(plot.sensor_id, (sum = { sensor: plot.sensor_id, plots: [], weight: 0 }));
    sum.plots.push(plot);
    sum.weight += plot.weight ?? 0;
  }
  return [...sums.values()].sort((a, b) => b.weight - a.weight || (a.sensor < b.sensor ? -1 : 1));
}

function removed(plot: TrackPlot | undefined): string {
  const parts = [
    plot?.range_bias_m == null ? "" : `${signed(plot.range_bias_m, 0)} m`,
    plot?.azimuth_bias_deg == null ? "" : `${signed(plot.azimuth_bias_deg, 3)}°`,
  ];
  return parts.filter((one) => one !== "").join(", ") || "none";
}

function metres(value: number | null): string {
  return value === null ? "–" : `${signed(value, 0)} m`;
}

/** With its sign; no "−0". */
export function signed(value: number, digits: number): string {
  const text = Math.abs(value).toFixed(digits);
  return Number(text) === 0 ? text : `${value < 0 ? "−" : "+"}${text}`;
}

function median(values: readonly number[]): number {
  const known = values.filter(Number.isFinite).sort((a, b) => a - b);
  return known[Math.floor(known.length / 2)] ?? NaN;
}
