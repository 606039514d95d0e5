/** Pairs of tracks that are predicted to come close to each other. */

import { get } from "./feed";

const EVERY_MS = 4000;
/** The next question waits so many times as long as the answer took. */
const PATIENCE = 20;
export const HORIZON_S = 120;
/** Within these the pair is an encounter: 5 NM and 1000 ft. */
export const DISTANCE_M = 9260;
const HEIGHT_M = 305;
const PROBABILITY_MIN = 0.01;
const LIMIT = 30;
/** While there is nothing to ask, the question is put so soon after there is, ms. */
const IDLE_MS = 250;

/** An encounter as the service predicts it. */
export interface Encounter {
  time_s: number;
  first_track_id: number;
  second_track_id: number;
  closest_time_s: number;
  time_to_closest_s: number;
  distance_m: number;
  distance_sigma_m: number;
  vertical_separation_m: number | null;
  /** Of coming within the distance, and within both thresholds. */
  probability: number;
  probability_both: number | null;
  first_latitude_deg: number;
  first_longitude_deg: number;
  second_latitude_deg: number;
  second_longitude_deg: number;
}

interface Answer {
  total: number;
  encounters: Encounter[];
}

export class Encounters {
  found: Encounter[] = [];
  /** How many there are: `found` are the first of them. */
  total = 0;
  /** Counts the answers. */
  revision = 0;
  /** Tracks of the encounters. */
  readonly tracks = new Set<number>();

  private wake: () => void = () => undefined;
  /** The past time of `found`, s: it is read once. */
  private foundAtS: number | null = null;
  /** Counts the times chosen: an answer to a question of before is of no use. */
  private jumps = 0;

  constructor(
    private readonly wanted: () => boolean,
    /** The time shown, s; null: the present. */
    private readonly atS: () => number | null,
  ) {}

  /** How many are drawn, in words; empty: all. */
  get drawn(): string {
    return this.total > this.found.length ? `${this.found.length} of ${this.total} encounters` : "";
  }

  start(): void {
    void this.loop();
  }

  private async loop(): Promise<void> {
    const asked = `horizon_s=${HORIZON_S}&distance_m=${DISTANCE_M}&height_m=${HEIGHT_M}`
      + `&probability_min=${PROBABILITY_MIN}&order=probability&limit=${LIMIT}`;
    for (;;) {
      const began = performance.now();
      const { jumps } = this;
      const at = this.atS();
      const isWanted = this.wanted() && !document.hidden;
      const isNew = !isWanted || at === null || at !== this.foundAtS;
      const isRead = !isNew || await this.read(isWanted ? `v1/encounters?${asked}${atOf(at)}` : null, at);
      // Another time may be chosen while an answer comes.
      if (this.jumps !== jumps) continue;
      const took = performance.now() - began;
      // How long no answer took says nothing of the work of the service.
      const pause = isRead ? Math.max(EVERY_MS - took, PATIENCE * took) : EVERY_MS;
      await new Promise<void>((done) => {
        setTimeout(done, isWanted ? pause : IDLE_MS);
        this.wake = done;
      });
    }
  }

  /** Read the encounters; false if there was no answer: those of before stay. */
  private async read(address: string | null, atS: number | null): Promise<boolean> {
    let answer: Answer = { total: 0, encounters: [] };
    const { jumps } = this;
    this.foundAtS = null;
    if (address !== null) {
      try {
        answer = (await (await get(address)).json()) as Answer;
        if (jumps === this.jumps) this.foundAtS = atS;
      } catch {
        // The feed announces a service that does not answer.
        return false;
      }
    }
    if (jumps === this.jumps) this.take(answer);
    return true;
  }

  /** Another time is shown: its encounters are read at once. */
  hurry(): void {
    this.jumps += 1;
    this.foundAtS = null;
    this.take({ total: 0, encounters: [] });
    this.wake();
  }

  private take({ total, encounters: found }: Answer): void {
    this.total = total;
    if (found.length === 0 && this.found.length === 0) return;
    this.found = found;
    this.tracks.clear();
    for (const one of found) this.tracks.add(one.first_track_id).add(one.second_track_id);
    this.revision += 1;
  }
}

/** The parameter of a past time. */
export function atOf(timeS: number | null): string {
  return timeS === null ? "" : `&at=${timeS.toFixed(3)}`;
}

/** The probability of coming within both thresholds, or within the distance where a height is unknown. */
export function probabilityOf(one: Encounter): number {
  return one.probability_both ?? one.probability;
}
