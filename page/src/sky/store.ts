/** What the page knows: the tracks of the last frame, trails and plots, with the clock of the data. */

import { Table, type Frame } from "../service/frame";
import { mercatorX, mercatorY } from "../drawing/mercator";
import { PLOTS_KEPT_S, Plots } from "./plots";
import { nameOf, Track, trackColumns } from "./track";

/** Beyond the data time the picture runs on at most this long, s. */
const AHEAD_MAX_S = 10;
/** Data seconds per second are those of so long: frames come in bunches when service or network are busy, ms. */
const RATE_MS = 10_000;
const RATE_MIN_MS = 1000;
/** At a greater rate the data are a replay; it has ended after so long without data, ms. */
const REPLAY_RATE_MIN = 1.5;
const ENDED_MS = 8000;

const NONE = new Table(0, new Map());

export { nameOf, Track };

export class Store {
  /** Live tracks by ascending number; the objects stay those of the tracks. */
  tracks: Track[] = [];
  readonly plots = new Plots();
  readonly bearings = new Plots();
  /** Live tracks of the service, of which `tracks` may be those of the area shown. */
  total = 0;
  sensors: string[] = [];
  /** Tracks that have a trajectory set. */
  bundles: number[] = [];
  dataTimeS: number | null = null;
  /** Whether there is a frame since all was discarded. */
  isRead = false;
  /** Frames received, plots that the service no longer had, and answers that were no frame. */
  frames = 0;
  skipped = 0;
  /** Plots skipped of the last seconds: the data times of the frames that lack them. */
  private readonly lacking: { timeS: number; count: number }[] = [];
  malformed = 0;
  /** Speed of the fastest track on the map, units/s. */
  fastest = 0;
  /** Data seconds per second of a history; null: as the data come. */
  pace: number | null = null;
  /** Nothing moves beyond the last data: the service is out of reach. */
  stands = false;
  /** When the data time came that is the newest. */
  private receivedMs = 0;
  /** The time shown when the last frame came: the present stands there until its data are as late. */
  private shownS = -Infinity;
  /** Data seconds per second: 1 live, more in a fast replay; nothing moves before it is known. */
  private rate = 0;
  /** Data times of the last frames, and when they came. */
  private readonly steps: { ms: number; timeS: number }[] = [];
  /** Time of the last plot of each sensor, and of its last bearing with the position of the sensor then. */
  private readonly plottedS = new Map<string, number>();
  private readonly bearingOf = new Map<string, { timeS: number; x: number; y: number }>();
  private readonly byId = new Map<number, Track>();
  private other: Track[] = [];

  /** The plots shown, and of how many, if not all. */
  get plotCount(): string {
    const [shown, lacking] = [this.plots.length, this.lacking.reduce((sum, one) => sum + one.count, 0)];
    return lacking > 0 ? `${shown} of ${shown + lacking}` : `${this.plots.isFull ? "≥ " : ""}${shown}`;
  }

  /** Whether only the tracks of the area shown were received, with their plots. */
  get isPart(): boolean {
    return this.total > this.tracks.length;
  }

  track(id: number | null): Track | undefined {
    return id === null ? undefined : this.byId.get(id);
  }

  /** Take a frame; the clock of the data follows its steps. */
  update(frame: Frame, nowMs: number): void {
    const time = frame.header.data_time_s;
    this.shownS = this.timeAt(nowMs);
    // A frame of the same data says nothing of their rate: where they end, the picture stands and does not slide back.
    if (time !== this.dataTimeS) {
      this.receivedMs = nowMs;
      if (time !== null && this.pace === null) this.measure(time, nowMs);
    }
    this.dataTimeS = time;
    this.isRead = true;
    this.frames += 1;
    this.skipped += frame.header.skipped;
    if (frame.header.skipped > 0) this.lacking.push({ timeS: time ?? 0, count: frame.header.skipped });
    while ((this.lacking[0]?.timeS ?? Infinity) < (time ?? 0) - PLOTS_KEPT_S) this.lacking.shift();
    this.total = frame.header.total;
    this.sensors = frame.header.sensors;
    this.bundles = frame.header.bundles ?? [];
    this.extendTrails(frame);
    this.updateTracks(frame);
    this.noteHeard(frame.heard ?? NONE);
    for (const [marks, table] of [[this.plots, frame.plots], [this.bearings, frame.bearings ?? NONE]] as const) {
      const before = marks.last;
      marks.update(table, (time ?? 0) - PLOTS_KEPT_S);
      this.noteSensors(marks, before);
    }
  }

  /** Before a frame that has all earlier positions and plots. */
  beginAgain(): void {
    for (const track of this.tracks) track.trail.clear();
    this.plots.clear();
    this.bearings.clear();
    this.lacking.length = 0;
  }

  /** Discard everything: the service restarted. */
  clear(): void {
    this.tracks = [];
    this.total = 0;
    this.plots.clear();
    this.lacking.length = 0;
    this.bearings.clear();
    this.plottedS.clear();
    this.bearingOf.clear();
    this.byId.clear();
    this.dataTimeS = null;
    this.shownS = -Infinity;
    this.isRead = false;
    this.steps.length = 0;
    this.rate = 0;
  }

  private measure(timeS: number, ms: number): void {
    const { steps } = this;
    if (timeS < (this.dataTimeS ?? -Infinity)) steps.length = 0;
    steps.push({ ms, timeS });
    while (steps.length > 2 && (steps[1]?.ms ?? ms) <= ms - RATE_MS) steps.shift();
    const [first] = steps;
    if (first !== undefined && ms - first.ms >= RATE_MIN_MS) this.rate = ((timeS - first.timeS) * 1000) / (ms - first.ms);
  }

  /** The time of the map and of its clocks: data time, extrapolated by at most some seconds. */
  timeAt(nowMs: number): number {
    if (this.dataTimeS === null) return 0;
    if (this.stands) return this.dataTimeS;
    const waitedMs = nowMs - this.receivedMs;
    // Of a fast replay that has ended, the last data are shown.
    if (this.pace === null && this.rate > REPLAY_RATE_MIN && waitedMs > ENDED_MS) return this.dataTimeS;
    const ahead = Math.min(waitedMs / 1000, 2) * (this.pace ?? this.rate);
    const time = this.dataTimeS + Math.min(ahead, AHEAD_MAX_S);
    return this.pace === null && this.shownS - time < AHEAD_MAX_S ? Math.max(time, this.shownS) : time;
  }

  /** Seconds for which a track is extrapolated at a data time: as long as it lives. */
  ahead(track: Track, timeS: number): number {
    return Math.max(0, timeS - track.timeS);
  }

  /** The position of a track at a data time, in map units. */
  placeOf(track: Track, timeS: number): [number, number] {
    const ahead = this.ahead(track, timeS);
    return [track.x + track.vx * ahead, track.y + track.vy * ahead];
  }

  /** Whether plots of a sensor are drawn. */
  hasPlots(sensor: string): boolean {
    return this.isRecent(this.plottedS.get(sensor));
  }

  /** Whether bearings of a sensor are drawn. */
  hasBearings(sensor: string): boolean {
    return this.isRecent(this.bearingOf.get(sensor)?.timeS);
  }

  /** Whether a sensor delivers bearings and no plots; not known where the frames have the plots of an area only. */
  hasOnlyBearings(sensor: string): boolean {
    return this.hasBearings(sensor) && !this.hasPlots(sensor) && !this.isPart;
  }

  /** Where a sensor was at its last bearing, in map units. */
  sourceOf(sensor: string): { x: number; y: number } | undefined {
    return this.bearingOf.get(sensor);
  }

  private isRecent(timeS = -Infinity): boolean {
    return timeS >= (this.dataTimeS ?? Infinity) - PLOTS_KEPT_S;
  }

  /** Note in the tracks which sensors saw them, from the plots or bearings since a number. */
  private noteSensors(plots: Plots, since: number): void {
    for (let number = Math.max(since, plots.first); number < plots.last; number++) {
      const at = plots.slot(number);
      const sensor = this.sensors[plots.sensor[at] ?? -1];
      if (sensor === undefined) continue;
      const time = plots.timeS[at] ?? NaN;
      if (plots === this.bearings) this.noteBearing(sensor, time, plots.sourceX[at] ?? NaN, plots.sourceY[at] ?? NaN);
      else this.plottedS.set(sensor, Math.max(time, this.plottedS.get(sensor) ?? -Infinity));
      this.track(plots.track[at] ?? null)?.heardS.set(sensor, time);
    }
  }

  /** Note them where there are no plots to take them from. */
  private noteHeard(table: Table): void {
    const [ids, sensors, times] = [table.column("track_id"), table.column("sensor"), table.column("time_s")];
    for (let row = 0; row < table.rows; row++) {
      const sensor = this.sensors[sensors[row] ?? -1];
      if (sensor !== undefined) this.track(ids[row] ?? null)?.heardS.set(sensor, times[row] ?? NaN);
    }
  }

  private noteBearing(sensor: string, timeS: number, x: number, y: number): void {
    if (timeS >= (this.bearingOf.get(sensor)?.timeS ?? -Infinity)) this.bearingOf.set(sensor, { timeS, x, y });
  }

  /** Earlier positions come with past pictures. */
  private extendTrails(frame: Frame): void {
    const [ids, times] = [frame.path.column("track_id"), frame.path.column("time_s")];
    const [latitudes, longitudes] = [frame.path.column("latitude_deg"), frame.path.column("longitude_deg")];
    for (let row = 0; row < frame.path.rows; row++) {
      const track = this.made(ids[row] ?? NaN);
      track.trail.extend(times[row] ?? NaN, mercatorX(longitudes[row] ?? NaN), mercatorY(latitudes[row] ?? NaN));
    }
  }

  private made(id: number): Track {
    let track = this.byId.get(id);
    if (track === undefined) {
      track = new Track(id);
      this.byId.set(id, track);
    }
    return track;
  }

  private updateTracks(frame: Frame): void {
    const columns = trackColumns(frame.tracks);
    const { states } = frame.header;
    const found = this.other;
    found.length = 0;
    this.fastest = 0;
    for (let row = 0; row < frame.tracks.rows; row++) {
      const id = columns.track_id[row] ?? NaN;
      const track = this.made(id);
      track.update(columns, states, row);
      track.seenIn = this.frames;
      this.fastest = Math.max(this.fastest, Math.abs(track.vx), Math.abs(track.vy));
      found.push(track);
    }
    for (const track of this.tracks) if (track.seenIn !== this.frames) this.byId.delete(track.id);
    this.other = this.tracks;
    this.tracks = found;
  }
}
