/** Curves of the selected track. */

import { html, type TemplateResult } from "lit";

import { sensorColour } from "../../drawing/palette";
import type { Update } from "../../service/selection";
import { FOOT_M, KNOT_MPS, type Units } from "../../view/units";
import "../charts/chart";
import type { ChartData, Curve } from "../charts/chart";
import type { App } from "../panel";
import { acrossOf, alongOf, type TrackPlot } from "./documents";

/** Velocities less certain than this are not drawn: they are those of new tracks, and hide the others. */
const VELOCITY_SIGMA_MAX_MPS = 50;

export function profile(all: readonly Update[], units: Units): TemplateResult {
  const updates = all.filter((one) => one.velocity_sigma_mps <= VELOCITY_SIGMA_MAX_MPS);
  if (updates.length < 2) return html`<p class="hint">Fewer than two updates with a known velocity.</p>`;
  const times = updates.map((one) => one.time_s);
  const aero = units === "aero";
  const charts: ChartData[] = [];
  if (updates.some((one) => one.height_m !== null)) {
    const perUnit = aero ? 100 * FOOT_M : 1;
    const values = updates.map((one) => (one.height_m === null ? null : one.height_m / perUnit));
    charts.push({ label: "Level", unit: aero ? "FL" : "m", times, spanMin: aero ? 20 : 600, curves: [{ label: "level", colour: "--accent", values }] });
  }
  const perUnit = aero ? KNOT_MPS : 1;
  const [of, sigma] = [updates.map((one) => one.speed_mps / perUnit), updates.map((one) => (2 * one.velocity_sigma_mps) / perUnit)];
  charts.push({
    label: "Ground speed", unit: aero ? "kt" : "m/s", times, spanMin: 20,
    curves: [
      { label: "+2 sigma", colour: "--accent", values: of.map((value, at) => value + (sigma[at] ?? 0)), band: true },
      { label: "−2 sigma", colour: "--accent", values: of.map((value, at) => Math.max(0, value - (sigma[at] ?? 0))), band: true },
      { label: "speed", colour: "--accent", values: of },
    ],
  });
  return html`${charts.some((one) => one.label === "Level") ? "" : html`<p class="hint">No height received.</p>`}${charts.map(figure)}`;
}

/** Innovations over time, each sensor with its colour and form. */
export function residuals(plots: readonly TrackPlot[], app: App): TemplateResult {
  const names = [...new Set(plots.map((one) => one.sensor_id))].sort();
  const times = plots.map((one) => one.time_s);
  const curves = (value: (plot: TrackPlot) => number | null): Curve[] => names.map((name) => {
    const mark = Math.max(0, app.store.sensors.indexOf(name));
    return { label: name, colour: sensorColour(mark, app.picture.scene.palette), mark, values: plots.map((one) => (one.sensor_id === name ? value(one) : null)) };
  });
  return html`${figure({ label: "Along the line of sight (positions: east)", unit: "m", times, curves: curves(alongOf), zero: true })}
    ${figure({ label: "Across the line of sight (positions: north)", unit: "m", times, curves: curves(acrossOf), zero: true })}`;
}

export function figure(data: ChartData): TemplateResult {
  return html`<figure><figcaption>${data.label}, ${data.unit}</figcaption><mr-chart .data=${data}></mr-chart></figure>`;
}
