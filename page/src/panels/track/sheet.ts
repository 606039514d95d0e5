/** The sheet of the selected track. */

import { html, nothing, type TemplateResult } from "lit";

import { latitudeOf, longitudeOf } from "../../drawing/mercator";
import type { Update } from "../../service/selection";
import { nameOf, type Track } from "../../sky/store";
import { aged, unheardS } from "../../time/presence";
import { climb, distance, heading, height, level, speed, utc } from "../../view/units";
import type { App, Panel } from "../panel";
import { Source } from "../source";
import { profile, residuals } from "./curves";
import type { TrackPlots, Transition } from "./documents";
import { contributions } from "./contributions";

const EVERY_MS = 3000;
/** Longer than the curves: also what the identity is taken from. */
const WINDOW_S = 600;
/** Addresses heard in this time are shown, s. */
const HEARD_S = 60;
const TRANSITIONS_MAX = 6;

/** The track that was shown last, by the name that people know. */
let last: { id: number; name: string } | null = null;
const plots = new Source<TrackPlots>(EVERY_MS);
const transitions = new Source<{ transitions: Transition[] }>(EVERY_MS, "transitions");

export const trackPanel: Panel = {
  id: "sheet",
  title: "Track",
  tab: "track",
  draw,
};

function draw(app: App): TemplateResult {
  const { store, view } = app;
  const { selected } = view;
  if (selected === null) return html`<p class="hint">Select a track on the map or in the table.</p>`;
  const track = store.track(selected);
  const past = transitions.read(app, String(selected), `v1/tracks/${selected}/transitions`, track !== undefined);
  const shownS = app.clock.isLive ? Infinity : app.clock.at(performance.now()) ?? Infinity;
  const steps = (past?.transitions ?? []).filter((one) => one.time_s <= shownS);
  if (track === undefined && !app.feed.isCurrent) return html`<p class="hint">Loading the air picture…</p>`;
  if (track === undefined) return transitions.problem === "" ? absent(selected, steps, shownS) : html`<p class="hint">${transitions.problem}</p>`;
  last = { id: selected, name: nameOf(track) };
  const used = plots.read(app, String(selected), `v1/tracks/${selected}/plots?window_s=${WINDOW_S}`, true);
  const { updates } = app.selection;
  return html`${head(track, app)}
    ${facts(track, updates[updates.length - 1], app)}
    ${motion(updates[updates.length - 1])}
    ${identity(track, updates)}
    <section aria-label="Contributing sensors"><h3>Contributing sensors</h3>${
      used === null ? html`<p class="hint">${plots.problem || "Loading the plots…"}</p>` : contributions(used, app)}</section>
    <section aria-label="Level and speed"><h3>Level and speed, last ten minutes</h3>${profile(updates, view.units)}</section>
    <section aria-label="Innovations by sensor"><h3>Innovations by sensor</h3>${used === null ? nothing : residuals(used.plots, app)}</section>
    ${life(steps)}`;
}

function head(track: Track, { actions }: App): TemplateResult {
  const state = track.onGround ? `${track.state}, on the ground` : track.state;
  return html`<div class="head"><div><strong class="name">${nameOf(track)}</strong>
      <span class="badge ${track.state}">${state}</span>${
        track.emergency === "" ? nothing : html` <span class="badge level-fault">${track.emergency}</span>`}</div>
    <div class="actions"><button type="button" @click=${() => actions.show(track.id)}>Centre</button>
      <button type="button" @click=${() => actions.select(null)}>Deselect <kbd>Esc</kbd></button></div></div>`;
}

function facts(track: Track, newest: Update | undefined, { clock, feed, store, view }: App): TemplateResult {
  const { units } = view;
  const olderS = unheardS(feed, clock);
  const timeS = store.dataTimeS ?? track.timeS;
  const [x, y] = store.placeOf(track, timeS);
  const sigma = track.heightSigmaM;
  const received = track.isLevelEstimated ? ", estimated: not received" : "";
  const isAirborne = Number.isFinite(sigma) && !track.onGround;
  const rows: [string, string, string][] = [
    ["Level", track.onGround ? "on the ground" : Number.isFinite(track.heightM) ? level(track.heightM, units, track.isLevelEstimated) : "not received",
      isAirborne ? `± ${height(2 * sigma, units)}${received}` : ""],
    ["Vertical rate", climb(track.climbMps, units), ""],
    ["Speed", speed(track.speedMps, units, track.isSpeedUncertain), Number.isFinite(track.speedMps) ? `± ${speed(2 * track.velocitySigmaMps, units)}` : ""],
    ["Course over ground", heading(track.headingDeg), ""],
    ["Position", `${latitudeOf(y).toFixed(4)}, ${longitudeOf(x).toFixed(4)}`, `at ${utc(timeS)}, ${track.ageS.toFixed(0)} s after the last plot`],
    ["Position sigma", distance(track.sigmaNowM, units), `at that time; ${distance(track.sigmaM, units)} at the last plot`],
    ["Last plot", `${olderS === 0 ? `${track.ageS.toFixed(1)} s` : aged(track.ageS, olderS)} ago`, newest === undefined ? "" : `from ${newest.sensor_id}`],
    ["Track number", String(track.id), ""],
  ];
  return html`<dl class="facts">${rows.map(([name, value, more]) => html`<dt>${name}</dt><dd>${value}${
    more === "" ? nothing : html` <small title=${more.startsWith("±") ? "two standard deviations" : ""}>${more}</small>`}</dd>`)}</dl>`;
}

/** Probabilities of the modes; filters without modes have none. */
function motion(last: Update | undefined): TemplateResult | typeof nothing {
  if (last === undefined || last.turn_left_probability === null) return nothing;
  const [left, right, change] = [last.turn_left_probability, last.turn_right_probability ?? 0, last.speed_change_probability ?? 0];
  const modes: [string, number][] = [
    ["Straight", Math.max(0, 1 - left - right - change)], ["Left turn", left], ["Right turn", right], ["Speed change", change],
  ];
  return html`<section aria-label="Motion"><h3>Motion</h3><table class="modes"><tbody>${modes.map(([name, value]) => html`<tr>
    <th scope="row">${name}</th><td><progress max="1" .value=${value} aria-label=${name}></progress></td>
    <td>${(100 * value).toFixed(0)} %</td></tr>`)}</tbody></table></section>`;
}

/** The identity of the track, and what its sensors heard. */
function identity(track: Track, updates: readonly Update[]): TemplateResult {
  const heard = new Map<string, { address: string; timeS: number }>();
  for (const update of updates) {
    if (update.measured_mode_s_address === null || update.time_s < track.timeS - HEARD_S) continue;
    heard.set(update.sensor_id, { address: update.measured_mode_s_address, timeS: update.time_s });
  }
  const others = [...heard].filter(([, one]) => one.address !== track.address);
  const sources = [...heard.keys()].join(", ");
  return html`<section aria-label="Identity"><h3>Identity</h3><dl class="facts">
    <dt>Callsign</dt><dd>${track.callsign ?? "not received"}</dd>
    <dt>Mode 3/A</dt><dd>${track.code ?? "not received"}</dd>
    <dt>Mode S address</dt><dd>${track.address ?? "not received"}</dd>
    <dt>Addresses received</dt><dd>${heard.size === 0 ? `none in the last ${HEARD_S} s` : others.length === 0
      ? html`the same <small>from ${sources}</small>`
      : others.map(([sensor, one]) => html`<strong class="alarm">${one.address} from ${sensor}, ${utc(one.timeS)}</strong> `)}</dd>
    ${updates[updates.length - 1]?.adsb_implausible === true
      ? html`<dt>ADS-B</dt><dd class="alarm">implausible: contradicted by other sensors</dd>` : nothing}</dl></section>`;
}

function life(found: readonly Transition[]): TemplateResult | typeof nothing {
  if (found.length === 0) return nothing;
  return html`<section aria-label="Track history"><h3>Track history</h3><table><tbody>${found.slice(-TRANSITIONS_MAX).map((one) => html`<tr>
    <th scope="row">${utc(one.time_s)}</th><td>${one.transition}</td><td>${said(one)}</td></tr>`)}</tbody></table></section>`;
}

function absent(id: number, found: readonly Transition[], shownS: number): TemplateResult {
  const end = found[found.length - 1];
  const name = last?.id === id && !last.name.startsWith("#") ? `Track ${id} (${last.name})` : `Track ${id}`;
  if (Number.isFinite(shownS) && end?.transition !== "ended") {
    return html`<p class="hint">${name} did not exist at ${utc(shownS)}.</p>`;
  }
  const how = end?.transition === "ended" ? ` at ${utc(end.time_s)}: ${said(end)}` : "";
  return html`<p class="hint">${name} was terminated${how}.</p>${life(found)}`;
}

const REASONS: Record<string, string> = {
  "new-identity": "new identity", "new-place": "new position", updates: "enough plots", likelihood: "likely an aircraft",
  silent: "no plots", heard: "new plot", refused: "plots outside the gate", unconfirmed: "not confirmed in time",
  unlikely: "likely clutter", merged: "duplicate",
};

function said({ reason, into_track_id: into }: Transition): string {
  return `${REASONS[reason] ?? reason}${into === null ? "" : ` of track ${into}`}`;
}
