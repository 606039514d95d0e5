/** Reads the service: frames each second, sensors and status less often; announces interruptions. */

import { readRun, request } from "./access";
import { decode, type Frame } from "./frame";
import { Store } from "../sky/store";
import type { Clock } from "../time/clock";

const SLOW_TICK_MS = 4000;
/** A history that stands still is read so often, ms: to know that the service answers. */
const STANDING_MS = 2000;
const TIMEOUT_MS = 10_000;
/** What is read once is requested again so long after there was no answer, ms. */
const AGAIN_MS = 4000;
/** The service has the document, but does not give it yet: without a valid key, overloaded, or while it starts. */
const PASSING: readonly number[] = [401, 429, 502, 503, 504];
/** A data time earlier by more is no picture of the same run, s. */
const BACK_S = 1;
const RETRIES = "The page retries automatically.";
/** A frame that is later by more lacks earlier positions, s. */
const GAP_S = 10;
/** Without an answer for this long the picture is out of date, ms. */
const LOST_MS = 5000;

export interface Sensor {
  id: string;
  kind: string;
  enabled?: boolean;
  latitude_deg: number | null;
  longitude_deg: number | null;
  range_max_m: number | null;
  rotation_period_s: number | null;
  /** By how much a wrong clock is ahead of the data time. */
  clock_lead_s?: number | null;
  /** More measurements than it can deliver, in words. */
  storm?: string | null;
  range_sigma_m: number | null;
  azimuth_sigma_deg: number | null;
  /** Null of a past time. */
  updates: number | null;
  age_s: number | null;
  last_update_s: number | null;
  health: Record<string, unknown> | null;
  biases: Record<string, unknown>[];
  diagnoses: { code?: string; sentence: string }[];
}

export interface Encounter {
  [name: string]: unknown;
}

export class Feed {
  sensors: Sensor[] = [];
  status: Record<string, unknown> = {};
  /** When it was read, as `performance.now`. */
  statusMs = 0;
  /** When the service last received a measurement, as `performance.now`; null where it is not known. */
  receivedMs: number | null = null;
  /** The time of `sensors`, s; null: the present. */
  sensorsAtS: number | null = null;
  private sensorsJumps = -1;
  /** The status when the time shown was chosen: on the map nothing changes while it stands. */
  statusShown: Record<string, unknown> = {};
  /** Why the last question of each loop was not answered. */
  private readonly problems = ["", ""];
  /** Whether the last question for a picture reached no service. */
  isUnreachable = false;
  /** Counts the documents read. */
  revision = 0;
  /** Area shown and selected track: what frames have of more tracks than a page can show. */
  area = "";
  track: number | null = null;
  /** Where the tracks of a recorded run are, degrees: west, south, east, north. */
  extent: number[] | null = null;
  /** The one of two recorded runs that is read as `store`. */
  run: 0 | 1 = 0;
  /** The tracks of the other of two runs. */
  readonly second = new Store();
  /** The last step back of the data time, until the user has read it. */
  wentBack: { fromS: number; toS: number } | null = null;
  private after: number | null = null;
  /** Area and track of which the last picture is. */
  private shownOf = "";
  private newestS: number | null = null;
  /** Of the last past picture: its time, when it was read, and the jumps of the clock before. */
  private pastS: number | null = null;
  /** What was asked for the last past picture. */
  private pastOf = "";
  private pastMs = 0;
  private jumps = 0;
  /** The jumps of the clock before the picture was read: until another one is, it stays. */
  private pictureJumps = 0;
  /** Of the loops that wait. */
  private readonly wakes = new Map<number, () => void>();
  private answeredMs = performance.now();
  /** Settled once the first picture was read, or could not be: then it is known whether there is a present. */
  private readonly firstRead: Promise<void>;
  private noteFirst!: () => void;

  constructor(
    private readonly store: Store,
    private readonly clock: Clock,
    private readonly tickMs: number,
    private readonly changed: () => void,
  ) {
    this.firstRead = new Promise((resolve) => (this.noteFirst = resolve));
  }

  /** What the service could not answer; empty: nothing. */
  get problem(): string {
    return this.problems.find((one) => one !== "") ?? "";
  }

  start(): void {
    void this.loop(() => this.frame(), this.tickMs, 0);
    void this.loop(() => this.documents(), SLOW_TICK_MS, 1);
  }

  /** Read another of two recorded runs: its tracks are `store`, those of the other one `second`. */
  choose(run: 0 | 1): void {
    this.run = run;
    readRun(run);
    for (const one of [this.store, this.second]) one.clear();
    this.clock.again();
  }

  /** The names of the runs, in the order given. */
  private runsOf(layers: string[] = []): string[] {
    return this.run === 0 ? layers : [...layers].reverse();
  }

  /** Read the next frame and the sensors at once: the clock was moved. */
  hurry(): void {
    for (const wake of this.wakes.values()) wake();
  }

  /** Whether the picture is that of the time chosen last. */
  get isCurrent(): boolean {
    return this.pictureJumps === this.clock.jumps && this.store.dataTimeS !== null;
  }

  /** Whether the service has been silent for too long. */
  isLost(nowMs: number): boolean {
    return nowMs - this.answeredMs > LOST_MS;
  }

  /** Whether the service has just said in which state it is. */
  isStatusFresh(nowMs: number): boolean {
    return !this.isUnreachable && nowMs - this.statusMs < SLOW_TICK_MS + LOST_MS;
  }

  /** Since how long no sensor has delivered, s; null while data come, and for a replay. */
  get silenceS(): number | null {
    const { alarms, silence_s: silence } = this.status;
    const ceased = Array.isArray(alarms) && alarms.includes("no_data");
    return ceased && typeof silence === "number" ? silence + (performance.now() - this.statusMs) / 1000 : null;
  }

  /** When the service answered last, as `performance.now`. */
  get lastAnswerMs(): number {
    return this.answeredMs;
  }

  private async loop(step: () => Promise<void>, everyMs: number, number: number): Promise<void> {
    for (;;) {
      const began = performance.now();
      const { jumps } = this.clock;
      try {
        await step();
        this.problems[number] = "";
        if (number === 0) this.reach(true);
      } catch (error) {
        if (number === 0) this.reach(!(error instanceof UnreachableError));
        this.problems[number] = error instanceof Error ? error.message : String(error);
      }
      this.noteFirst();
      this.changed();
      // The clock may be moved while an answer comes.
      if (this.clock.jumps !== jumps) continue;
      await new Promise<void>((done) => {
        setTimeout(done, Math.max(20, everyMs - (performance.now() - began)));
        this.wakes.set(number, done);
      });
    }
  }

  private reach(reached: boolean): void {
    this.isUnreachable = !reached;
    for (const one of [this.store, this.second]) one.stands = !reached;
  }

  private async frame(): Promise<void> {
    const { clock, store } = this;
    if (clock.jumps !== this.jumps) {
      this.jumps = clock.jumps;
      [this.after, this.pastS, this.pastOf] = [null, null, ""];
    }
    const at = clock.at(performance.now());
    [store.pace, this.second.pace] = [clock.pace, clock.pace];
    if (at === null) await this.present();
    else if (at !== this.pastS || performance.now() - this.pastMs > STANDING_MS) await this.past(at);
  }

  /** Read the picture of a past time, of each run. */
  private async past(at: number): Promise<void> {
    const { clock, jumps } = this;
    const asked = new URLSearchParams({ at: at.toFixed(3) });
    const shownOf = this.wanted();
    const of = `${at} ${shownOf}`;
    // A time after the end, as in an address, is set to the end: nothing of the frame before is kept.
    const isBack = this.pastS !== null && at < this.pastS;
    const isElsewhere = this.isElsewhere(shownOf);
    if (this.pastS !== null && !isBack && !isElsewhere) asked.set("since", this.pastS.toFixed(3));
    if (this.area !== "") asked.set("bbox", this.area);
    if (this.track !== null) asked.set("track", String(this.track));
    const frames = await Promise.all([this.store, this.second].slice(0, clock.runs.length > 1 ? 2 : 1)
      .map(async (_, layer) => {
        asked.set("layer", String(layer));
        return (await get(`v1/picture?${asked.toString()}`)).arrayBuffer();
      }));
    this.answeredMs = performance.now();
    // The clock was moved meanwhile.
    if (clock.jumps !== jumps) return;
    this.renew();
    if (isBack) for (const one of [this.store, this.second]) one.clear();
    else if (isElsewhere) for (const one of [this.store, this.second]) one.beginAgain();
    frames.forEach((buffer, layer) => {
      const frame = this.decoded(buffer);
      clock.learn(frame.header.span_s, frame.header.recorded === true, this.runsOf(frame.header.layers));
      this.extent = frame.header.extent_deg ?? null;
      // What is read again of a time that stands only says that the service answers: the picture stays.
      if (of !== this.pastOf) (layer === 0 ? this.store : this.second).update(frame, performance.now());
    });
    [this.pastS, this.pastMs, this.pastOf, this.shownOf] = [at, performance.now(), of, shownOf];
  }

  /** What frames have of more tracks than a page can show. */
  private wanted(): string {
    return `${this.area} ${this.track}`;
  }

  /** Whether something else is shown than what the last picture has plots and earlier positions of. */
  private isElsewhere(shownOf: string): boolean {
    return shownOf !== this.shownOf && (this.store.isPart || this.second.isPart);
  }

  /** Discard the picture of the time before the clock was moved: that of the time chosen is here. */
  private renew(): void {
    if (this.pictureJumps === this.clock.jumps) return;
    this.pictureJumps = this.clock.jumps;
    for (const one of [this.store, this.second]) one.clear();
  }

  private decoded(buffer: ArrayBuffer): Frame {
    try {
      return decode(buffer);
    } catch (error) {
      this.store.malformed += 1;
      throw error;
    }
  }

  private async present(): Promise<void> {
    const asked = new URLSearchParams();
    const shownOf = this.wanted();
    const after = this.isElsewhere(shownOf) ? null : this.after;
    if (after !== null) asked.set("after", String(after));
    if (this.area !== "") asked.set("bbox", this.area);
    if (this.track !== null) asked.set("track", String(this.track));
    const answer = await get(`v1/picture?${asked.toString()}`);
    const buffer = await answer.arrayBuffer();
    const frame = this.decoded(buffer);
    this.answeredMs = performance.now();
    const { clock, jumps } = this;
    clock.learn(frame.header.span_s, frame.header.recorded === true, this.runsOf(frame.header.layers));
    // The clock was moved meanwhile; a run has no present.
    if (clock.jumps !== jumps || clock.recorded) return;
    this.renew();
    const time = frame.header.data_time_s;
    const isBack = time !== null && this.newestS !== null && time < this.newestS - BACK_S;
    if (isBack) this.wentBack = { fromS: this.newestS ?? time, toS: time };
    if (time !== null) this.newestS = time;
    // A service that restarted without its journal numbers from zero.
    if (isBack || (this.after !== null && frame.header.next < this.after)) this.store.clear();
    if (after === null) this.store.beginAgain();
    // After a gap the next frame has the positions of the time between.
    const isGap = time !== null && time - (this.store.dataTimeS ?? time) > GAP_S;
    this.after = isGap && after !== null ? null : frame.header.next;
    this.shownOf = shownOf;
    this.store.update(frame, performance.now());
  }

  private async documents(): Promise<void> {
    await this.firstRead;
    const at = this.clock.at(performance.now());
    const stands = at !== null && at === this.sensorsAtS && this.sensorsJumps === this.clock.jumps;
    this.sensorsJumps = this.clock.jumps;
    this.status = (await (await get("v1/status")).json()) as Record<string, unknown>;
    this.statusMs = performance.now();
    const receivedS = this.status["received_age_s"];
    if (typeof receivedS === "number") this.receivedMs = this.statusMs - 1000 * receivedS;
    // While a service starts, it has no alarms and biases, or those of earlier times: the last ones stay, as the picture does.
    const starts = this.status["state"] === "stopped" || this.status["state"] === "recovering";
    const stays = stands || (starts && this.store.dataTimeS !== null);
    if (!stays) {
      this.sensors = sensorsOf(await (await get(`v1/sensors${at === null ? "" : `?at=${at.toFixed(3)}`}`)).json());
      this.sensorsAtS = at;
      this.statusShown = this.status;
    }
    this.revision += 1;
  }
}

/** The service answered with an error. */
export class AnswerError extends Error {
  constructor(readonly status: number, detail: string) {
    super(detail);
  }
}

/** The service did not answer at all. */
class UnreachableError extends Error {}

/** Get a document of the service. @throws Error with what the service says, or what to do if it says nothing. */
export async function get(address: string): Promise<Response> {
  const answer = await request(address, { signal: AbortSignal.timeout(TIMEOUT_MS), cache: "no-store" }).catch((error: unknown) => {
    throw new UnreachableError(error instanceof DOMException && error.name === "TimeoutError"
      ? `The service has not responded within ${TIMEOUT_MS / 1000} s: it is overloaded or stopped, or the network is interrupted. ${RETRIES}`
      : `The service cannot be reached. Check that it is running and can be reached from this computer. ${RETRIES}`);
  });
  if (!answer.ok) {
    const problem = (await answer.json().catch(() => ({}))) as { detail?: string };
    throw new AnswerError(answer.status, problem.detail ?? `the service responded with status ${answer.status}`);
  }
  return answer;
}

/** Read what does not change, again and again until the service answers. @throws Error if it has no such document. */
export async function readOnce<T>(read: () => Promise<T>): Promise<T> {
  for (;;) {
    try {
      return await read();
    } catch (error) {
      if (error instanceof SyntaxError || (error instanceof AnswerError && !PASSING.includes(error.status))) throw error;
      await new Promise<void>((done) => void setTimeout(done, AGAIN_MS));
    }
  }
}

function sensorsOf(document: unknown): Sensor[] {
  const listed = (document as { sensors?: Sensor[] }).sensors;
  return Array.isArray(listed) ? listed : [];
}
