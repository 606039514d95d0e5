/** The service: rates, lags, rejects by reason with examples, journal, and who is connected. */

import { html, nothing, type TemplateResult } from "lit";

import { follow } from "../service/access";
import { dated, utc } from "../view/units";
import type { App, Panel } from "./panel";
import { Source } from "./source";

const EXAMPLES = 3;
const EXAMPLES_MS = 10_000;
/** Rates are those of this time, ms. */
const RATE_MS = 20_000;

interface Reject {
  number: number;
  source: string;
  reason: string;
  raw: string;
}

interface Sample {
  atMs: number;
  read: number;
  updates: number;
  dataS: number;
}

const examples = new Map<string, Source<{ rejects: Reject[] }>>();
const opened = new Set<string>();
const samples: Sample[] = [];
let sampled = -1;

export const systemPanel: Panel = {
  id: "system",
  title: "System",
  tab: "system",
  badge: (app) => {
    // Also while another tab is open: rates are known at once.
    sample(app);
    const { feed } = app;
    const { state, warnings } = feed.status as { state?: string; warnings?: unknown[] };
    if (state !== undefined && state !== "running" && state !== "recorded") return state;
    return Array.isArray(warnings) && warnings.length > 0 ? `${warnings.length} warning${warnings.length > 1 ? "s" : ""}` : "";
  },
  draw,
};

function draw(app: App): TemplateResult {
  const { feed, store } = app;
  const { status } = feed;
  const count = (name: string): number => (typeof status[name] === "number" ? status[name] : NaN);
  const text = (name: string): string => String(status[name] ?? "–");
  const warnings = Array.isArray(status["warnings"]) ? status["warnings"].map(String) : [];
  const unobservable = Array.isArray(status["unobservable_biases"]) ? (status["unobservable_biases"] as { what: string; reason: string }[]) : [];
  return html`${app.clock.isLive || app.clock.recorded ? nothing
      : html`<p class="summary"><span class="badge check">NOW</span> Current state of the service, not its state at the time shown.</p>`}
    ${status["failure"] == null ? nothing : html`<p class="alarm"><strong>${String(status["failure"])}</strong></p>`}
    ${warnings.map((one) => html`<p class="alarm">${one}</p>`)}
    ${group("Service", [
      ["State", text("state")], ["Version", text("version")], ["Filter", text("filter")],
      ["Data time", dataTime(status, store.dataTimeS)],
    ])}
    ${app.clock.recorded ? nothing : html`${group("Rates", rates())}
    ${group("Lags", [
      ["Waiting for the journal", `${text("intake_rows")} rows`], ["Waiting for the engine", `${text("backlog_rows")} rows`],
      ["Journal entries processed", `${text("processed_sequence")} of ${text("journal_sequence")}`],
      ["Entries skipped", text("skipped_entries")],
      // Live tracks are at least so old: later measurements may still be earlier ones.
      ["Track lag behind newest plot", Number.isNaN(count("reorder_horizon_s")) ? "–" : `≥ ${count("reorder_horizon_s")} s (reordering)`],
    ])}`}
    ${group("Measurements", [
      ["Read", text("read")], ["Accepted", text("accepted")], ["Rejected", text("rejected")], [app.clock.recorded ? "Duplicate" : "Duplicate (repeated messages)", text("duplicate")],
    ])}
    ${count("read") === count("accepted") + count("rejected") + count("duplicate") || Number.isNaN(count("read"))
      ? nothing : html`<p class="hint">Some measurements are still being counted.</p>`}
    ${rejects(app)}
    ${outcomes(status)}
    ${unobservable.length === 0 ? nothing : html`<h3>Unobservable biases</h3>${unobservable.map((one) => html`<p class="hint">${one.what}: ${one.reason}</p>`)}`}
    ${group("Tracks", app.clock.recorded ? [["Initiated", text("tracks_initiated")], ["Confirmed", text("tracks_confirmed")]] : [
      ["Live", text("tracks")], ["Confirmed or coasting", text("tracks_confirmed_live")],
      ["Initiated", text("tracks_initiated")], ["Terminated", text("tracks_ended")],
    ])}
    ${app.clock.recorded ? nothing : group("Connections", [
      ["Pages", pages(status)], ["Event stream", `${text("subscribers")} client${status["subscribers"] === 1 ? "" : "s"}`], ["Zenoh", status["zenoh"] == null ? "off" : "on"],
      ["ASTERIX in, out", `${status["asterix"] == null ? "off" : "on"}, ${status["asterix_output"] == null ? "off" : "on"}`],
      ["Receiver feeds", status["feeds"] == null ? "off" : "on"],
      ["Stream frames received by this page", `${store.frames}, ${store.malformed} malformed`], ["Plots skipped by this page", String(store.skipped)],
    ])}`;
}

/** That of the service, which is not the time shown in the history. */
function dataTime(status: Record<string, unknown>, shownS: number | null): string {
  const time = typeof status["data_time_s"] === "number" ? status["data_time_s"] : shownS;
  return time === null ? "no data" : `${utc(time)} UTC`;
}

/** A sentence on the measurements that the service rejected; empty: none. */
export function rejectsOf(status: Record<string, unknown>): string {
  const count = Number(status["rejected"] ?? 0);
  const [most] = rejectCounts(status);
  return count === 0 || most === undefined ? "" : `The service has rejected ${count} measurement${count === 1 ? "" : "s"} (mostly ${most[0]}); see System.`;
}

/** Rejects by reason, the most frequent first. */
function rejectCounts(status: Record<string, unknown>): [string, number][] {
  return Object.entries((status["rejected_by_code"] ?? {}) as Record<string, number>).sort((a, b) => b[1] - a[1]);
}

/** Who has the page open. */
function pages(status: Record<string, unknown>): string {
  const found = Object.entries((status["pages"] ?? {}) as Record<string, number>);
  return found.length === 0 ? "–" : found.map(([client, count]) => (count > 1 ? `${client} (${count})` : client)).join(", ");
}

function group(title: string, rows: [string, string][]): TemplateResult {
  return html`<section aria-label=${title}><h3>${title}</h3><dl class="facts">${rows.map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}</dl></section>`;
}

/** Keep the counts of each status, for rates. */
function sample({ feed }: App): void {
  if (feed.revision === sampled || typeof feed.status["read"] !== "number") return;
  sampled = feed.revision;
  const now = performance.now();
  samples.push({ atMs: now, read: feed.status["read"], updates: Number(feed.status["output_sequence"] ?? 0), dataS: Number(feed.status["data_time_s"] ?? NaN) });
  while (samples.length > 2 && (samples[0]?.atMs ?? now) < now - RATE_MS) samples.shift();
}

function rates(): [string, string][] {
  const [first, last] = [samples[0], samples[samples.length - 1]];
  if (first === undefined || last === undefined || last.atMs - first.atMs < 1000) return [["Measurements", "not known yet"]];
  const seconds = (last.atMs - first.atMs) / 1000;
  const speed = (last.dataS - first.dataS) / seconds;
  return [
    ["Measurements", `${Math.max(0, (last.read - first.read) / seconds).toFixed(1)} per s`],
    ["Track updates", `${Math.max(0, (last.updates - first.updates) / seconds).toFixed(1)} per s`],
    ["Data time", Number.isFinite(speed) ? `${speed.toFixed(1).replace("-", "−")} s per s` : "no data"],
  ];
}

function rejects(app: App): TemplateResult {
  const counts = rejectCounts(app.feed.status);
  if (counts.length === 0) return html`<section aria-label="Rejects"><h3>Rejects by reason</h3><p class="hint">None.</p></section>`;
  const listed = counts.reduce((sum, [, count]) => sum + count, 0);
  return html`<section aria-label="Rejects"><h3>Rejects by reason</h3>${counts.map(([code, count]) => html`<details
    @toggle=${(event: Event) => {
      if ((event.target as HTMLDetailsElement).open) opened.add(code);
      else opened.delete(code);
      app.actions.redraw();
    }}><summary>${code} <span class="count">${count}</span></summary>${opened.has(code) ? shown(code, app) : nothing}</details>`)}
    ${listed > Number(app.feed.status["rejected"] ?? 0) + Number(app.feed.status["duplicate"] ?? 0)
      ? html`<p class="hint">Including accepted plots that were not used, such as duplicates of other plots (DUPLICATE).</p>` : nothing}</section>`;
}

/** The last rejected rows of a reason. */
function shown(code: string, app: App): TemplateResult {
  if (app.clock.recorded) return html`<p class="hint">The rejected rows are listed in the output of the run.</p>`;
  let source = examples.get(code);
  if (source === undefined) examples.set(code, (source = new Source(EXAMPLES_MS)));
  const found = source.read(app, code, `v1/rejects?code=${encodeURIComponent(code)}&limit=1000`);
  if (found === null) return html`<p class="hint">${source.problem || "Loading…"}</p>`;
  return html`${found.rejects.slice(-EXAMPLES).reverse().map((one) => html`<p>${dated(one.reason)}<br><code>${one.raw}</code></p>`)}
    <p class="hint"><a href="v1/rejects?code=${encodeURIComponent(code)}" @click=${follow}>All retained rejects</a></p>`;
}

function outcomes(status: Record<string, unknown>): TemplateResult | typeof nothing {
  const counts = Object.entries((status["engine"] ?? {}) as Record<string, number>).filter(([, count]) => count > 0);
  if (counts.length === 0) return nothing;
  return html`<details><summary>Disposition in the filter</summary><dl class="facts">${counts.map(([code, count]) => html`<dt>${
    code.toLowerCase().replaceAll("_", " ")}</dt><dd>${count}</dd>`)}</dl></details>`;
}
