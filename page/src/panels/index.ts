/** The panels beside the map. A new panel is a module of this folder and a line in `PANELS`. */

import { html, nothing, render, type TemplateResult } from "lit";

import { TABS, type Tab } from "../view/view";
import { announce } from "./announcer";
import { banner, bar } from "./bar";
import { keyList, legend } from "./help";
import type { App, Panel } from "./panel";
import { sensorPanel } from "./sensors/list";
import { switchPanel } from "./switches";
import { systemPanel } from "./system";
import { layersPanel } from "../overlays/panel";
import { timeBar } from "../time/bar";
import { tablePanel } from "./table";
import { trackPanel } from "./track/sheet";

/** In the order of their tab. */
export const PANELS: readonly Panel[] = [
  tablePanel,
  trackPanel,
  sensorPanel,
  systemPanel,
  switchPanel,
  layersPanel,
];

const at = (id: string): HTMLElement => document.getElementById(id) ?? document.body;

/** Draw everything but the map. */
export function drawPanels(app: App): void {
  document.body.classList.toggle("closed", !app.view.open);
  render(banner(app), at("banner"));
  render(bar(app), at("bar"));
  render(timeBar(app), at("time"));
  render(tabs(app), at("tabs"));
  render(html`${TABS.map(([tab, , title]) => tabPanel(tab, title, app))}`, at("panels"));
  render(legend(app), at("legend"));
  render(keyList(), at("keys"));
  announce(app);
}

function tabs(app: App): TemplateResult {
  const { view, actions } = app;
  return html`${TABS.map(([tab, key, title]) => html`<button type="button" role="tab" id="tab-${tab}"
    aria-controls="panel-${tab}" aria-selected=${tab === view.tab} aria-keyshortcuts=${key} title="${title} (${key})"
    tabindex=${tab === view.tab ? 0 : -1} @click=${() => actions.tab(tab)} @keydown=${(event: KeyboardEvent) => moved(event, app)}
    >${title}${badge(tab, app)}</button>`)}`;
}

function badge(tab: Tab, app: App): TemplateResult | typeof nothing {
  const text = PANELS.filter((panel) => panel.tab === tab).map((panel) => panel.badge?.(app) ?? "").find((one) => one !== "");
  return text === undefined ? nothing : html` <span class="badge ${/FAULT|ALARM|SILENT/.test(text) ? "level-alarm" : ""}">${text}</span>`;
}

/** Arrows move between the tabs, as in every list of tabs. */
function moved(event: KeyboardEvent, { view, actions }: App): void {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (step === undefined) return;
  event.preventDefault();
  event.stopPropagation();
  const place = TABS.findIndex(([tab]) => tab === view.tab);
  const [tab] = TABS[(place + step + TABS.length) % TABS.length] ?? TABS[0] ?? ["tracks"];
  actions.tab(tab);
  document.getElementById(`tab-${tab}`)?.focus();
}

function tabPanel(tab: Tab, title: string, app: App): TemplateResult {
  const panels = PANELS.filter((panel) => panel.tab === tab);
  const open = tab === app.view.tab;
  return html`<div role="tabpanel" id="panel-${tab}" aria-labelledby="tab-${tab}" ?hidden=${!open} tabindex="-1">
    ${panels.map((panel) => html`<section aria-label=${panel.title}>
      <h2 class=${panels.length > 1 || panel.title !== title ? "" : "unseen"}>${panel.title}</h2>
      <div id=${panel.id}>${open || panel.always === true ? panel.draw(app) : nothing}</div></section>`)}</div>`;
}
