/** Answers where the selected aircraft was some minutes ago. */

import { latitudeOf, longitudeOf } from "../drawing/mercator";
import type { App } from "../panels/panel";
import { utc } from "../view/units";

/** Times are asked for in milliseconds. */
const ASKED_PER_S = 1000;
const ROUNDED_S = 0.01;
const SAID_MS = 5000;

export class Ago {
  private message = "";
  /** Why nothing was done, shown for a while. */
  private refusal = { text: "", untilMs: 0 };
  /** The time that the message is about, s. */
  private saidAtS: number | null = null;
  private wanted: { id: number; name: string; atS: number; jumps: number; isFirst: boolean; before: string } | null = null;

  async show(app: App, seconds: number): Promise<void> {
    const { clock, store, view } = app;
    const asked = view.selected;
    // A track that was selected just now: when it was first tracked comes with its past.
    await app.selection.settled();
    if (view.selected !== asked) return;
    const track = store.track(view.selected);
    const now = clock.at(performance.now()) ?? store.dataTimeS;
    if (track === undefined || now === null) {
      this.refusal = { text: asked === null ? "Select a track first; then press a to show where it was five minutes ago." : "The selected track is not in the picture shown.", untilMs: performance.now() + SAID_MS };
      app.actions.redraw();
      return;
    }
    // A service that has been running for less shows the earliest time that it has.
    const atS = Math.max(now - seconds, clock.span?.[0] ?? -Infinity);
    const before = atS > now - seconds ? `${utc(now - seconds)} is before the earliest retained time. ` : "";
    const name = track.callsign ?? track.code ?? track.address ?? `#${track.id}`;
    // The updates of the last ten minutes: a younger track is shown where it was first.
    const bornS = app.selection.updates[0]?.time_s ?? -Infinity;
    const isFirst = bornS > atS;
    // Not before its first update.
    const shownS = isFirst ? Math.ceil(bornS * ASKED_PER_S) / ASKED_PER_S : atS;
    clock.pause();
    clock.seek(shownS);
    this.wanted = { id: track.id, name, atS: shownS, jumps: clock.jumps, isFirst, before };
  }

  /** What there is to say of the time shown; empty: nothing. */
  said({ clock }: App): string {
    if (performance.now() < this.refusal.untilMs) return this.refusal.text;
    return this.saidAtS !== null && clock.at(performance.now()) === this.saidAtS ? this.message : "";
  }

  /** A frame has come: show the place. */
  arrived(app: App): void {
    const { wanted } = this;
    if (wanted !== null && wanted.jumps !== app.clock.jumps) this.wanted = null;
    else if (wanted !== null && Math.abs((app.store.dataTimeS ?? 0) - wanted.atS) < ROUNDED_S) {
      this.wanted = null;
      this.saidAtS = app.clock.at(performance.now());
      const track = app.store.track(wanted.id);
      const [x, y] = track === undefined ? [0, 0] : app.store.placeOf(track, wanted.atS);
      this.message = wanted.before + (track === undefined
        ? `${wanted.name} had no track at ${utc(wanted.atS)}.`
        : `${wanted.name} ${wanted.isFirst ? "was first tracked " : ""}at ${utc(wanted.atS)}: ${
          latitudeOf(y).toFixed(4)}, ${longitudeOf(x).toFixed(4)}. The picture is paused there; ${
          app.clock.recorded ? "Space resumes playback" : "Go live (n) returns to the present"}.`);
      if (track !== undefined) app.picture.show(track);
    }
  }
}
