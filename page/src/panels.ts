/** The panels beside the map: tracks, the selected track, radars, the system. */

import { html, nothing, render, type TemplateResult } from "lit";

import type { Feed, Sensor } from "./feed";
import { isShown, matches, sensorColour } from "./drawing";
import type { Store, Track } from "./store";
import { climb, date, distance, heading, level, speed, utc } from "./units";
import { SWITCHES, type Switch, type ViewState } from "./view";

const ROWS_MAX = 200;

export interface Actions {
  select(id: number | null): void;
  show(id: number): void;
  toggle(name: Switch): void;
  filter(text: string): void;
  units(): void;
  theme(): void;
  help(): void;
}

type Key = "name" | "level" | "speed" | "sigma" | "age";

const COLUMNS: [Key, string][] = [
  ["name", "Track"], ["level", "Level"], ["speed", "Speed"], ["sigma", "Sigma"], ["age", "Age"],
];

export class Panels {
  private key: Key = "name";
  private descending = false;

  constructor(
    private readonly store: Store,
    private readonly feed: Feed,
    private readonly view: ViewState,
    private readonly actions: Actions,
  ) {}

  draw(): void {
    const at = (id: string): HTMLElement => document.getElementById(id) ?? document.body;
    render(this.banner(), at("banner"));
    render(this.bar(), at("bar"));
    render(this.switches(), at("switches"));
    render(this.sheet(), at("sheet"));
    render(this.tracks(), at("tracks"));
    render(this.sensors(), at("sensors"));
    render(this.system(), at("system"));
  }

  private banner(): TemplateResult | typeof nothing {
    const now = performance.now();
    if (this.feed.isLost(now)) {
      return html`<p role="alert">No answer from the service for ${Math.round(this.feed.silentS(now))} s.
        The picture is out of date. ${this.feed.problem}</p>`;
    }
    if (this.feed.problem !== "") return html`<p role="alert">${this.feed.problem}</p>`;
    return nothing;
  }

  private bar(): TemplateResult {
    const tracks = this.store.tracks;
    const confirmed = tracks.filter((one) => one.state === "confirmed").length;
    const time = this.store.dataTimeS;
    return html`
      <strong>multiradar</strong>
      <time title="Data time, UTC ${date(time)}">${utc(time)}${time === null ? "" : " UTC"}</time>
      <span>${tracks.length === 0 ? "no tracks" : `${confirmed} confirmed, ${tracks.length - confirmed} other tracks`}</span>
      <span>${this.store.plots.length} plots in 30 s</span>
      <button type="button" @click=${() => this.actions.units()}>${this.view.units === "aero" ? "FL, kt, NM" : "m, m/s, km"}</button>
      <button type="button" @click=${() => this.actions.theme()}>${this.view.theme === "dark" ? "Light" : "Dark"}</button>
      <button type="button" @click=${() => this.actions.help()}>Keys (?)</button>
      <a href="docs">API</a>`;
  }

  private switches(): TemplateResult {
    return html`<ul class="switches">${SWITCHES.map(([name, key, text]) => html`
      <li class=${name}><label><input type="checkbox" .checked=${this.view.shown[name]}
        @change=${() => this.actions.toggle(name)}> ${text} <kbd>${key}</kbd></label></li>`)}</ul>`;
  }

  private sheet(): TemplateResult {
    const track = this.store.track(this.view.selected);
    if (this.view.selected === null) return html`<p class="hint">Select a track on the map or in the table.</p>`;
    if (track === undefined) return html`<p class="hint">Track ${this.view.selected} has ended.</p>`;
    const { units } = this.view;
    const rows: [string, string][] = [
      ["Track number", String(track.id)],
      ["State", `${track.state}${track.onGround ? ", on the ground" : ""}`],
      ["Callsign", track.callsign ?? "–"],
      ["Mode 3/A", track.code ?? "–"],
      ["Mode S address", track.address ?? "–"],
      ["Position", `${track.latitude.toFixed(4)}, ${track.longitude.toFixed(4)}`],
      ["Position sigma", distance(track.sigmaM, units)],
      ["Level", level(track.heightM, units)],
      ["Vertical rate", climb(track.climbMps, units)],
      ["Speed", speed(track.speedMps, units)],
      ["Heading", heading(track.headingDeg)],
      ["Last plot", `${track.ageS.toFixed(1)} s ago`],
      ["Plots in 30 s", this.plotsOf(track)],
    ];
    return html`<dl>${rows.map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}</dl>
      <p><button type="button" @click=${() => this.actions.show(track.id)}>Centre</button>
      <button type="button" @click=${() => this.actions.select(null)}>Deselect (Esc)</button></p>`;
  }

  private plotsOf(track: Track): string {
    const counts = new Map<string, number>();
    for (const plot of this.store.plots) {
      if (plot.track !== track.id) continue;
      const name = this.store.sensors[plot.sensor] ?? "?";
      counts.set(name, (counts.get(name) ?? 0) + 1);
    }
    return [...counts].map(([name, count]) => `${name}: ${count}`).join(", ") || "none";
  }

  private tracks(): TemplateResult {
    const shown = this.store.tracks.filter((one) => isShown(one, this.view));
    const sorted = [...shown].sort((a, b) => this.order(a, b) * (this.descending ? -1 : 1));
    const hidden = this.store.tracks.filter((one) => !matches(one, this.view.filter)).length;
    return html`
      <input type="search" id="filter" placeholder="Callsign, code, address or number (/)" aria-label="Filter tracks"
        .value=${this.view.filter} @input=${(event: Event) => this.actions.filter((event.target as HTMLInputElement).value)}>
      <table>
        <thead><tr>${COLUMNS.map(([key, text]) => html`<th scope="col" aria-sort=${this.sorted(key)}>
          <button type="button" @click=${() => this.sort(key)}>${text}</button></th>`)}</tr></thead>
        <tbody>${sorted.slice(0, ROWS_MAX).map((track) => this.row(track))}</tbody>
      </table>
      <p class="hint">${shown.length} shown${hidden > 0 ? `, ${hidden} hidden by the filter` : ""}${
        shown.length > ROWS_MAX ? `; the table has the first ${ROWS_MAX}` : ""}</p>`;
  }

  private row(track: Track): TemplateResult {
    const { units } = this.view;
    const selected = track.id === this.view.selected;
    return html`<tr aria-selected=${selected} class=${track.state}>
      <td><button type="button" @click=${() => this.actions.show(track.id)}>${nameOf(track)}</button></td>
      <td>${track.onGround ? "GND" : level(track.heightM, units)}</td>
      <td>${speed(track.speedMps, units)}</td>
      <td>${distance(track.sigmaM, units)}</td>
      <td>${track.ageS.toFixed(0)} s</td></tr>`;
  }

  private sorted(key: Key): "none" | "ascending" | "descending" {
    if (key !== this.key) return "none";
    return this.descending ? "descending" : "ascending";
  }

  private sort(key: Key): void {
    this.descending = key === this.key ? !this.descending : key !== "name";
    this.key = key;
    this.draw();
  }

  private order(a: Track, b: Track): number {
    if (this.key === "name") return nameOf(a).localeCompare(nameOf(b));
    const value = (track: Track): number =>
      ({ level: track.heightM, speed: track.speedMps, sigma: track.sigmaM, age: track.ageS })[this.key as Exclude<Key, "name">];
    // Unknown values come last in descending order.
    const known = (one: number): number => (Number.isFinite(one) ? one : -Infinity);
    return known(value(a)) - known(value(b));
  }

  private sensors(): TemplateResult {
    return html`${this.feed.sensors.map((sensor) => this.sensor(sensor))}`;
  }

  private sensor(sensor: Sensor): TemplateResult {
    const number = this.store.sensors.indexOf(sensor.id);
    const alarms = alarmsOf(sensor);
    return html`<details ?open=${alarms.length > 0}>
      <summary><svg class="swatch" viewBox="0 0 1 1" aria-hidden="true"><rect width="1" height="1" fill=${sensorColour(number)}></rect></svg>
        ${sensor.id} <small>${sensor.kind}, ${sensor.updates} updates${
          sensor.age_s === null ? ", nothing yet" : `, ${sensor.age_s.toFixed(0)} s ago`}</small>
        ${alarms.length > 0 ? html`<strong class="alarm">${alarms.join(", ")}</strong>` : nothing}</summary>
      ${sensor.diagnoses.map((one) => html`<p class="alarm">${one.sentence}</p>`)}
      ${sensor.biases.length === 0 ? html`<p class="hint">No bias estimated yet.</p>` : html`
        <table><thead><tr><th scope="col">Bias</th><th scope="col">Estimate</th><th scope="col">± 2 sigma</th></tr></thead>
        <tbody>${sensor.biases.map((bias) => this.bias(bias))}</tbody></table>`}
    </details>`;
  }

  private bias(bias: Record<string, unknown>): TemplateResult {
    const name = String(bias["parameter"] ?? "");
    const [estimate, sigma] = [Number(bias["estimate"]), Number(bias["sigma"])];
    const digits = Math.abs(sigma) > 0 ? Math.max(0, Math.min(6, 1 - Math.floor(Math.log10(sigma)))) : 2;
    return html`<tr><td>${name.replaceAll("_", " ")}</td><td>${estimate.toFixed(digits)}</td><td>${(2 * sigma).toFixed(digits)}</td></tr>`;
  }

  private system(): TemplateResult {
    const { status } = this.feed;
    const rejected = Object.entries((status["rejected_by_code"] ?? {}) as Record<string, number>);
    const rows: [string, string][] = [
      ["State", String(status["state"] ?? "–")],
      ["Accepted", String(status["accepted"] ?? "–")],
      ["Rejected", rejected.length === 0 ? "none" : rejected.map(([code, count]) => `${code} ${count}`).join(", ")],
      ["Connected readers", String(status["subscribers"] ?? "–")],
      ["Version", String(status["version"] ?? "–")],
      ["Frames", `${this.store.frames} received, ${this.store.malformed} malformed, ${this.store.skipped} plots missed`],
    ];
    return html`<dl>${rows.map(([name, value]) => html`<dt>${name}</dt><dd>${value}</dd>`)}</dl>`;
  }
}

function nameOf(track: Track): string {
  return track.callsign ?? track.code ?? track.address ?? `#${track.id}`;
}

function alarmsOf(sensor: Sensor): string[] {
  const alarms = sensor.health?.["alarms"];
  return typeof alarms === "string" && alarms !== "" ? alarms.split(",") : [];
}
