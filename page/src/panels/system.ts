/** The service: its state, counts and version. */

import { html, type TemplateResult } from "lit";

import type { App, Panel } from "./panel";

export const systemPanel: Panel = { id: "system", title: "System", draw };

function draw({ store, feed }: App): TemplateResult {
  const { status } = feed;
  const rejected = Object.entries((status["rejected_by_code"] ?? {}) as Record<string, number>);
  const rows: [string, string][] = [
    ["State", String(status["state"] ?? "–")],
    ["Accepted", String(status["accepted"] ?? "–")],
    ["Rejected", rejected.length === 0 ? "none" : rejected.map(([code, count]) => `${code} ${count}`).join(", ")],
    ["Connected readers", String(status["subscribers"] ?? "–")],
    ["Version", String(status["version"] ?? "–")],
    ["Frames", `${store.frames} received, ${store.malformed} malformed, ${store.skipped} plots missed`],
  ];
  return html`<dl>${rows.map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}</dl>`;
}
