/** Which time the page shows: the present, or a time of the history that stands or runs at any speed. */

export const SPEEDS: readonly number[] = [0.25, 0.5, 1, 2, 5, 10, 20, 60, 120, 300];
const FIRST_SPEED = 10;

export class Clock {
  /** First and last time with data, s; null before there are any. */
  span: [number, number] | null = null;
  /** Whether the page shows recorded runs: they have no present. */
  recorded = false;
  /** Names of the runs. */
  runs: string[] = [];
  playing = false;
  speed = 1;
  /** Counts the jumps: an answer to a question of before is of no use. */
  jumps = 0;
  /** Time at `baseMs`, s; null: the present. */
  private baseS: number | null = null;
  private baseMs = 0;

  constructor(private readonly changed: () => void) {}

  get isLive(): boolean {
    return this.baseS === null && !this.recorded;
  }

  /** The time shown, s; null: the present. */
  at(nowMs: number): number | null {
    if (this.baseS === null) return null;
    const time = this.baseS + (this.playing ? ((nowMs - this.baseMs) / 1000) * this.speed : 0);
    if (this.span === null) return time;
    const last = this.span[1];
    if (this.playing && time >= last) {
      // The history has caught up with the present; a run has ended.
      if (this.recorded) this.stand(last);
      else this.live();
      return this.baseS === null ? null : last;
    }
    return Math.max(this.span[0], Math.min(time, last));
  }

  /** Data seconds per second; null: as the data come. */
  get pace(): number | null {
    if (this.baseS === null) return null;
    return this.playing ? this.speed : 0;
  }

  /** Take what a frame says about the times that there are. */
  learn(span: [number, number] | null, recorded: boolean, runs: string[]): void {
    this.span = span;
    this.runs = runs;
    if (recorded && !this.recorded) {
      this.recorded = true;
      if (this.baseS === null && span !== null) {
        this.speed = FIRST_SPEED;
        this.start(span[0], true);
      }
    }
  }

  live(): void {
    if (this.recorded || this.baseS === null) return;
    this.baseS = null;
    this.playing = false;
    this.jump();
  }

  pause(): void {
    const now = this.now();
    if (now !== null) this.stand(now);
  }

  play(): void {
    const now = this.now();
    if (now === null || this.isLive) return;
    const ended = this.recorded && this.span !== null && now >= this.span[1];
    this.start(ended && this.span !== null ? this.span[0] : now, ended);
  }

  toggle(): void {
    if (this.isLive || this.playing) this.pause();
    else this.play();
  }

  /** Show a time; it runs on if it ran. */
  seek(time: number): void {
    const within = this.span === null ? time : Math.max(this.span[0], Math.min(time, this.span[1]));
    if (this.playing) this.start(within, true);
    else this.stand(within, true);
  }

  /** Read the time shown again. */
  again(): void {
    this.jump();
  }

  /** Move by some seconds of data time. */
  step(seconds: number): void {
    const now = this.now();
    if (now !== null) this.seek(now + seconds);
  }

  /** The next greater or smaller speed. */
  faster(by: 1 | -1): void {
    const now = this.now();
    const at = SPEEDS.indexOf(this.speed);
    this.speed = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at + by))] ?? 1;
    if (this.playing && now !== null) this.start(now, false);
    this.changed();
  }

  /** The time shown, also where it is the present. */
  private now(): number | null {
    return this.at(performance.now()) ?? this.span?.[1] ?? null;
  }

  private stand(time: number, jump = false): void {
    const entered = this.baseS === null;
    this.baseS = time;
    this.playing = false;
    if (jump || entered) this.jump();
    else this.changed();
  }

  private start(time: number, jump: boolean): void {
    this.baseS = time;
    this.baseMs = performance.now();
    this.playing = true;
    if (jump) this.jump();
    else this.changed();
  }

  private jump(): void {
    this.jumps += 1;
    this.changed();
  }
}
