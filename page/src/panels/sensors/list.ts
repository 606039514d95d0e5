/** The sensors by severity: the wrong one is on top; below them the sheet of one. */

import { html, nothing, type TemplateResult } from "lit";

import type { Sensor } from "../../service/feed";
import { signed } from "../track/contributions";
import type { App, Panel } from "../panel";
import { swatch } from "../swatch";
import { utc } from "../../view/units";
import { bySeverity, doubtOf, estimateOf, isWithoutPlots, numberOf, type Severity } from "../../sky/severity";
import { silentS } from "../../time/presence";
import { rejectsOf } from "../system";
import { sensorSheet } from "./sheet";

export const sensorPanel: Panel = {
  id: "sensors",
  title: "Radars",
  tab: "sensors",
  badge: (app) => {
    const wrong = sortedOf(app).filter(({ severity }) => severity.rank > 0);
    const [first] = wrong;
    // Those of the worst level: two that are checked do not make a second fault.
    const worst = wrong.filter(({ severity }) => severity.level === first?.severity.level).length;
    // Short enough for all tabs to stay in sight.
    return first === undefined ? "" : `${worst} ${first.severity.level.replace(" ONLY", "")}`;
  },
  draw,
};

/** The sensors by severity, with what the service receives of all. */
function sortedOf({ feed, store, clock }: App): { sensor: Sensor; severity: Severity }[] {
  return bySeverity(feed.sensors, store, { olderS: silentS(feed, clock), rejects: clock.isLive ? rejectsOf(feed.status) : "" });
}

function draw(app: App): TemplateResult {
  const { feed, view } = app;
  const sorted = sortedOf(app);
  if (sorted.length === 0) return html`<p class="hint">The service has no sensors, or has not responded yet.</p>`;
  const olderS = silentS(feed, app.clock);
  const [first] = sorted;
  const open = sorted.find(({ sensor }) => sensor.id === view.sensor) ?? first;
  return html`${feed.sensorsAtS === null ? nothing : html`<p class="summary"><span class="badge check">${utc(feed.sensorsAtS)}</span>&nbsp;Biases and health at the time shown${app.clock.recorded ? "; probable causes from the whole run" : ""}.</p>`}
    ${first !== undefined ? verdict(sorted) : nothing}
    <table class="sensors"><thead><tr><th scope="col">Sensor</th><th scope="col">State</th>
      <th scope="col" title="Probability of detection">Pd</th>
      <th scope="col" title="Measured noise relative to the configured noise: range, azimuth">Noise</th>
      <th scope="col" title="Estimated range bias">Range<br>bias</th>
      <th scope="col" title="Estimated azimuth bias">Azimuth<br>bias</th></tr></thead>
    <tbody>${sorted.map(({ sensor, severity }) => row(sensor, severity, sensor === open?.sensor, olderS, app))}</tbody></table>
    ${open === undefined ? nothing : sensorSheet(open.sensor, open.severity, open === first && open.severity.rank > 0 ? 1 : 0, app)}`;
}

/** One sentence: which sensor to look at first. */
function verdict(sorted: { sensor: Sensor; severity: Severity }[]): TemplateResult {
  const [worst] = sorted;
  const wrong = sorted.filter(({ severity }) => severity.rank > 0).length;
  if (worst === undefined || wrong === 0) return html`<p class="summary">No sensor has an alarm.</p>`;
  return html`<p class="summary"><strong>${worst.sensor.id}: ${worst.severity.reasons[0] ?? worst.severity.level}</strong>${
    wrong > 1 ? html` <span class="count">${wrong - 1} more to check.</span>` : ""}</p>`;
}

function row(sensor: Sensor, severity: Severity, open: boolean, olderS: number | null, app: App): TemplateResult {
  const ratio = (name: string): string => format(numberOf(sensor.health?.[name]), 1);
  // Those of a radar are of its plots.
  const isMeasured = sensor.health !== null && !isWithoutPlots(sensor, app.store, olderS);
  const detection = isMeasured ? numberOf(sensor.health?.["detection_probability"]) : NaN;
  const bias = (name: string, digits: number, unit: string): string => {
    const found = sensor.biases.find((one) => one["parameter"] === name);
    const estimate = found === undefined ? NaN : estimateOf(found);
    return Number.isNaN(estimate) ? "–" : `${signed(estimate, digits)}${unit}${doubtOf(severity, sensor, app.feed.sensors) === "" ? "" : "?"}`;
  };
  return html`<tr aria-current=${open} @click=${() => app.actions.sensor(sensor.id)}>
    <th scope="row"><button type="button" class="link" aria-expanded=${open} @click=${(event: Event) => {
      event.stopPropagation();
      app.actions.sensor(sensor.id);
    }}>${swatch(sensor.id, app)}${sensor.id}</button></th>
    <td>${severityBadge(severity)}</td>
    <td>${Number.isFinite(detection) ? `${(100 * detection).toFixed(0)} %` : "–"}</td>
    <td>${!isMeasured ? "–" : `${ratio("range_sigma_ratio")}, ${ratio("azimuth_sigma_ratio")}`}</td>
    <td>${bias("range_offset_m", 0, " m")}</td><td>${bias("azimuth_offset_deg", 3, "°")}</td></tr>`;
}

export function severityBadge({ level }: Severity): TemplateResult {
  return html`<span class="badge level-${level.replace(" ", "-").toLowerCase()}">${level}</span>`;
}

function format(value: number, digits: number): string {
  return Number.isFinite(value) ? value.toFixed(digits) : "–";
}
