/** The line below the map: which time is shown, and how it runs. */

import { html, nothing, type TemplateResult } from "lit";

import { exportMenu } from "../export/menu";
import type { App } from "../panels/panel";
import type { Feed } from "../service/feed";
import { date, utc } from "../view/units";
import { lasting, presentOf, type Present } from "./presence";

const AGO_S = 300;

/** Which picture it is, and for how long there have been no data: for print and images. */
export function stateOf({ clock, feed }: App): string {
  if (!clock.isLive) return clock.recorded ? "Recorded" : "History";
  const { word } = presentOf(feed, performance.now());
  return `${word} ${sinceOf(feed, word)}`.trim();
}

/** How long there have been no data, or how late they are; empty while they come. */
function sinceOf(feed: Feed, word: Present["word"]): string {
  const nowMs = performance.now();
  if (word === "No contact") return `for ${lasting((nowMs - feed.lastAnswerMs) / 1000)}`;
  if (word !== "No data" && word !== "Delayed") return "";
  const { forS } = presentOf(feed, nowMs);
  if (word === "Delayed") return `by ${lasting(forS ?? 0)}`;
  return forS === null ? "since the service started" : `for ${lasting(forS)}`;
}

/** The time of the map, s; null while that of the time chosen is being read. */
export function shownTime({ feed, store }: App): number | null {
  return feed.isCurrent ? store.timeAt(performance.now()) : null;
}

export function timeBar(app: App): TemplateResult {
  const { clock, store, view, measure } = app;
  const { span } = clock;
  // While history plays, frames come at intervals: the time is that of the map, as above it.
  const time = shownTime(app) ?? clock.at(performance.now()) ?? store.dataTimeS;
  const { word } = presentOf(app.feed, performance.now());
  const mode = clock.recorded ? "Recorded" : clock.isLive ? word : "History";
  document.body.dataset["time"] = clock.isLive && word !== "Live" ? "stale" : mode.toLowerCase();
  const since = clock.isLive ? sinceOf(app.feed, word) : "";
  const said = outage(app) || app.ago.said(app);
  const moves: [number, string][] = [[-60, "−1 min"], [-10, "−10 s"], [10, "+10 s"], [60, "+1 min"]];
  const selected = view.selected === null ? undefined : store.track(view.selected);
  return html`
    <p class="clock" @keydown=${(event: KeyboardEvent) => keys(event, app)}>
      <strong class="mode" role="status">${mode}${clock.isLive ? nothing : clock.playing ? html` ▶ ×${clock.speed}` : " paused"}</strong>
      ${since === "" ? nothing : html`<span class="since">${since}</span>`}
      <time>${date(time) === "" ? nothing : html`<small>${date(time)}</small> `}${time === null ? "–" : utc(time)}</time>
      <button type="button" @click=${() => clock.toggle()} title="Space">${clock.isLive || clock.playing ? "Pause" : "Play"}</button>
      ${clock.recorded ? nothing : html`<button type="button" ?disabled=${clock.isLive} @click=${() => clock.live()}>Go live</button>`}
      <span class="together" role="group" aria-label="Move in time">${moves.map(([seconds, text]) =>
        html`<button type="button" ?disabled=${span === null} @click=${() => clock.step(seconds)}>${text}</button>`)}</span>
      <span class="together" role="group" aria-label="Speed">
        <button type="button" aria-label="Slower" title="-" ?disabled=${clock.isLive} @click=${() => clock.faster(-1)}>−</button>
        <span class="speed">${clock.isLive ? "–" : `×${clock.speed}`}</span>
        <button type="button" aria-label="Faster" title="+" ?disabled=${clock.isLive} @click=${() => clock.faster(1)}>+</button></span>
      <button type="button" class="ago" ?disabled=${selected === undefined}
        title=${selected === undefined ? "Select a track first" : "Pause five minutes before the time shown, with the map centred on where the selected aircraft was (a)"}
        @click=${() => app.ago.show(app, AGO_S)}>Go back 5 min</button>
      <button type="button" aria-pressed=${measure.active} title="x" @click=${() => measure.toggle(app)}>Measure</button>
      ${exportMenu(app)}
    </p>
    ${span === null ? nothing : html`<p class="span" @keydown=${(event: KeyboardEvent) => keys(event, app)}>
      <span title="Earliest time ${clock.recorded ? "of the run" : "retained by the service"}">${ends(span[0], span[1])}</span>
      <input type="range" aria-label="Time" min=${span[1] - Math.ceil(span[1] - span[0])} max=${span[1]} step="1"
        .value=${String(clock.isLive ? span[1] : time ?? span[1])}
        aria-valuetext="${date(time)} ${utc(time)} UTC" @input=${(event: Event) => clock.seek(Number((event.target as HTMLInputElement).value))}>
      <span>${ends(span[1], span[0])}</span></p>`}
    ${said === "" ? nothing : html`<p class="hint" role="status">${said}</p>`}`;
}

/** One end of the times that there are, with its date where the other has another one. */
function ends(time: number, other: number): string {
  return date(time) === date(other) ? utc(time) : `${date(time)} ${utc(time)}`;
}

/** Why the picture is that of another time than the one chosen; empty: it is not, or is being read. */
function outage({ feed, store }: App): string {
  return feed.isCurrent || feed.problem === "" || store.dataTimeS === null ? ""
    : `Still showing ${utc(store.dataTimeS)}: the selected time cannot be loaded until the service responds.`;
}

/** Keys that the slider or a button would keep for itself. */
function keys(event: KeyboardEvent, { clock }: App): void {
  const slider = event.target instanceof HTMLInputElement;
  if (event.key === " " && slider) clock.toggle();
  else if (event.key === "+") clock.faster(1);
  else if (event.key === "-") clock.faster(-1);
  else return;
  event.preventDefault();
  event.stopPropagation();
}
