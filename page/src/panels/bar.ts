/** The line above the map, and what is announced below it. */

import { html, nothing, type TemplateResult } from "lit";

import { isFiltered, isShown } from "../view/shown";
import { date, utc } from "../view/units";
import { shownTime, stateOf } from "../time/bar";
import type { App } from "./panel";

export function banner(app: App): TemplateResult | typeof nothing {
  return html`${restarted(app)}${notice(app)}`;
}

/** The data time went back: what was on the screen is not what is there now. */
function restarted({ feed, actions }: App): TemplateResult | typeof nothing {
  const { wentBack } = feed;
  if (wentBack === null) return nothing;
  return html`<p role="alert">The data time jumped back from ${utc(wentBack.fromS)} to ${utc(wentBack.toS)} UTC: the service
    restarted with earlier data, or its clock was set back. The picture continues from the earlier time.
    <button type="button" @click=${() => {
      feed.wentBack = null;
      actions.changed();
    }}>Close</button></p>`;
}

function notice(app: App): TemplateResult | typeof nothing {
  const { feed } = app;
  if (feed.isLost(performance.now())) {
    const since = (performance.timeOrigin + feed.lastAnswerMs) / 1000;
    return html`<p role="alert">Air picture not updated since ${utc(since)} UTC. ${
      feed.problem.charAt(0).toUpperCase()}${feed.problem.slice(1)}</p>`;
  }
  const silence = feed.silenceS;
  if (silence !== null) {
    return html`<p role="alert">No measurements from any sensor for ${silence.toFixed(0)} s: all tracks are stale.</p>`;
  }
  if (feed.problem !== "") return html`<p role="alert">${feed.problem}</p>`;
  return app.biasHint.draw(app);
}

export function bar(app: App): TemplateResult {
  const { store, view, actions, clock } = app;
  const { tracks } = store;
  const time = shownTime(app) ?? store.dataTimeS;
  const confirmed = tracks.filter((one) => one.state === "confirmed").length;
  const { biases } = view.shown;
  return html`
    <h1>multiradar</h1>
    <span class="print-only">${date(time)}</span>
    <time title="Data time, UTC ${date(time)}">${utc(time)}${time === null ? "" : html` <small>UTC</small>`}</time>
    <strong class="print-only">${stateOf(app)}</strong>
    <span>${clock.runs.length > 1 ? `${clock.runs[view.run]}: ` : ""}${tracks.length === 0 ? "no tracks" : `${confirmed} confirmed, ${tracks.length - confirmed} other tracks`}${
      store.isPart ? html` <small title="With more than 4000 tracks, only those of the visible area are received">(${
        tracks.length} of ${store.total})</small>` : nothing}</span>
    ${isFiltered(view.filters) ? html`<span class="badge check">filtered: ${tracks.filter((one) => isShown(one, view)).length} shown</span>`
      : html`<span class="minor">${store.plotCount} plots${store.bearings.length === 0 ? "" : `, ${store.bearings.length} bearings`} in 30 s</span>`}
    <span class="buttons">
      <button type="button" class="switch" role="switch" aria-checked=${biases} @click=${() => actions.toggle("biases")}
        title="On: plots corrected for estimated radar biases. Off: plots as measured (b)">Bias correction
        <span class="state" aria-hidden="true">${biases ? "on" : "off"}</span></button>
      <button type="button" title="Units (m)" @click=${() => actions.units()}>${view.units === "aero" ? "FL, kt, NM" : "m, m/s, km"}</button>
      <button type="button" title="Dark or light (d)" @click=${() => actions.theme()}>${view.theme === "dark" ? "Light" : "Dark"}</button>
      <button type="button" @click=${() => window.print()}>Print</button>
      <button type="button" @click=${() => actions.help()}>Help <kbd>?</kbd></button>
      <a href="docs">API</a></span>`;
}
