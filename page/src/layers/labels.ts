/** Labels of the tracks: callsign or code, level with trend, speed. */

import { shownKey } from "../view/shown";
import { FONT } from "../drawing/palette";
import { hasLeader, LabelPlaces, leftOf, MARGIN, topOf, type Wanted } from "../drawing/label_places";
import type { Layer, Scene } from "../drawing/scene";
import type { Encounters } from "../service/encounters";
import { nameOf, type Track } from "../sky/store";
import { SECOND_COLOURS } from "../time/second";
import { level, speed, trend, type Units } from "../view/units";

const LABELS_MAX = 600;
const LINE_PX = 13;
const FONT_PX = 12;
const PADDING_PX = 2;
/** Relative width of a letter until the font is measured. */
const LETTER = 0.6;

/** The label of a track, kept with it between drawings. */
class Label implements Wanted {
  x = 0;
  y = 0;
  width = 0;
  height = 2 * LINE_PX;
  rank = 0;
  slot = -1;
  left = 0;
  top = 0;
  covers = false;
  coveredMs = 0;
  home = false;
  lines: [string, string] = ["", ""];
  private key = "";

  constructor(readonly track: Track, readonly run: 0 | 1) {}

  /** Write the lines again if a value changed. */
  write(units: Units, letter: number, unheardS: number): void {
    const { track } = this;
    const height = track.onGround ? "GND" : level(track.heightM, units, track.isLevelEstimated).replace(/ .*/, "");
    const coasting = track.state === "coasting" ? ` ${Math.round(track.ageS + unheardS)} s ago` : "";
    const flown = Number.isFinite(track.speedMps) ? ` ${speed(track.speedMps, units, track.isSpeedUncertain).replace(/ .*/, "")}` : "";
    const second = `${height}${trend(track.climbMps)}${flown}${coasting}`;
    const first = track.emergency === "" ? nameOf(track) : `${nameOf(track)} ${track.emergency}`;
    const key = `${first} ${second}`;
    if (key === this.key) return;
    this.key = key;
    this.lines = [first, second];
    this.width = Math.ceil(letter * Math.max(first.length, second.length)) + 2 * PADDING_PX;
  }
}

export class LabelsLayer implements Layer {
  readonly plane = "moving";
  private readonly places = new LabelPlaces();
  private readonly labels = new Map<number, Label>();
  private readonly wanted: Label[] = [];
  private count = 0;
  private letter = LETTER * FONT_PX;
  /** Whether the map moved since labels could go back to their symbols, and with this drawing. */
  private moved = false;
  private moving = false;
  /** When and where the labels were placed. */
  private placedS = -Infinity;
  private placedState = "";
  private place = "";

  constructor(private readonly encounters: Encounters) {}

  draw(scene: Scene): void {
    if (!scene.view.shown.labels) return;
    const { context } = scene;
    context.font = `${FONT_PX}px ${FONT}`;
    if (this.isDue(scene) || !this.follow(scene)) {
      this.letter = context.measureText("0").width;
      this.arrange(scene);
    }
    this.write(scene);
  }

  /** Number of labels on the canvas, for measurements. */
  get drawn(): number {
    let drawn = 0;
    for (let at = 0; at < this.count; at++) if ((this.wanted[at]?.slot ?? -1) >= 0) drawn += 1;
    return drawn;
  }

  /** Labels on the canvas, for tests: name, and the corners of its box. */
  get boxes(): { id: number; run: number; left: number; top: number; right: number; bottom: number; slot: number }[] {
    return this.wanted.slice(0, this.count).filter((one) => one.slot >= 0).map((one) => ({
      id: one.track.id, run: one.run, left: one.left, top: one.top, right: one.left + one.width, bottom: one.top + one.height, slot: one.slot,
    }));
  }

  /** Placed again with new data, another view, or when two labels could touch. */
  private isDue(scene: Scene): boolean {
    const { view } = scene;
    const place = `${scene.a} ${scene.e} ${scene.f} ${scene.width} ${scene.height} ${view.units} ${view.selected} ${shownKey(view)}`;
    const state = `${scene.reservations} ${[...view.hidden].join()} ${view.run} ${this.encounters.revision} ${view.shown.encounters} ${Math.floor(scene.unheardS)}`;
    const moved = scene.store.fastest * scene.a * (scene.timeS - this.placedS);
    const due = place !== this.place || state !== this.placedState || !(moved < MARGIN);
    this.moving = place !== this.place;
    this.moved ||= this.moving;
    if (due) [this.place, this.placedState, this.placedS] = [place, state, scene.timeS];
    return due;
  }

  private arrange(scene: Scene): void {
    const { view } = scene;
    this.count = scene.seen.length + scene.seenSecond.length;
    // After the map moved there may be room beside the symbol.
    const home = this.moved && !this.moving;
    if (home) this.moved = false;
    for (let at = 0; at < this.count; at++) {
      const run = at < scene.seen.length ? 0 : 1;
      const seen = run === 0 ? scene.seen : scene.seenSecond;
      const place = run === 0 ? at : at - scene.seen.length;
      const track = seen.tracks[place] as Track;
      const key = run === 0 ? track.id : -track.id;
      let label = this.labels.get(key);
      if (label === undefined || label.track !== track) {
        label = new Label(track, run);
        this.labels.set(key, label);
      }
      label.write(view.units, this.letter, scene.unheardS);
      label.home = home;
      label.x = seen.x[place] ?? 0;
      label.y = seen.y[place] ?? 0;
      const first = run === 0;
      label.rank = rankOf(track, first && track.id === view.selected, first && this.encounters.tracks.has(track.id));
      this.wanted[at] = label;
    }
    this.places.place(this.wanted, this.count, LABELS_MAX, scene.width, scene.height, performance.now(), [scene.reserved, scene.reservedMoving]);
    if (this.labels.size > 2 * this.count + 100) this.forget(scene);
  }

  /** Between placements a label moves with its symbol; false if the tracks on the canvas changed. */
  private follow(scene: Scene): boolean {
    const first = scene.seen.length;
    if (first + scene.seenSecond.length !== this.count) return false;
    for (let at = 0; at < this.count; at++) {
      const label = this.wanted[at] as Label;
      const seen = at < first ? scene.seen : scene.seenSecond;
      const place = at < first ? at : at - first;
      if (label.track !== seen.tracks[place]) return false;
      label.x = seen.x[place] ?? 0;
      label.y = seen.y[place] ?? 0;
      if (label.slot < 0) continue;
      label.left = leftOf(label, label.slot);
      label.top = topOf(label, label.slot);
    }
    return true;
  }

  private write(scene: Scene): void {
    const { context, palette, view } = scene;
    context.strokeStyle = palette.faint;
    context.lineWidth = 1;
    context.beginPath();
    for (let at = 0; at < this.count; at++) {
      const label = this.wanted[at] as Label;
      if (label.slot < 0 || !hasLeader(label.slot)) continue;
      context.moveTo(label.x, label.y);
      context.lineTo(
        Math.max(label.left, Math.min(label.x, label.left + label.width)),
        Math.max(label.top, Math.min(label.y, label.top + label.height)),
      );
    }
    context.stroke();
    // The symbol under it stays visible.
    context.fillStyle = palette.background;
    context.globalAlpha = 0.4;
    for (let at = 0; at < this.count; at++) {
      const label = this.wanted[at] as Label;
      if (label.slot >= 0 && label.covers) {
        context.fillRect(Math.round(label.left), Math.round(label.top), label.width, label.height);
      }
    }
    context.globalAlpha = 1;
    let colour = "";
    for (let at = 0; at < this.count; at++) {
      const label = this.wanted[at] as Label;
      if (label.slot < 0) continue;
      const wanted = label.run === 1 ? SECOND_COLOURS[view.theme]
        : label.track.id === view.selected ? palette.selected
        : label.track.emergency !== "" ? palette.warning
        : label.track.state === "confirmed" ? palette.label
        : label.track.state === "coasting" ? palette.stale : palette.faint;
      if (wanted !== colour) context.fillStyle = colour = wanted;
      const [x, y] = [Math.round(label.left) + PADDING_PX, Math.round(label.top)];
      context.fillText(label.lines[0], x, y + LINE_PX - 3);
      context.fillText(label.lines[1], x, y + 2 * LINE_PX - 3);
    }
  }

  private forget(scene: Scene): void {
    for (const [key, label] of this.labels) {
      const store = label.run === 0 ? scene.store : scene.feed.second;
      if (store.track(label.track.id) !== label.track) this.labels.delete(key);
    }
  }
}

/** The selected track, emergencies and encounters, then by state; on the ground last. */
function rankOf(track: Track, selected: boolean, encounter: boolean): number {
  if (selected) return 0;
  if (encounter || track.emergency !== "") return 1;
  return track.onGround ? 5 : track.state === "confirmed" ? 2 : track.state === "coasting" ? 3 : 4;
}
