/** What the page knows: the last frame, trails and plots, with the clock of the data. */

import type { Frame } from "./frame";
import { mercatorX, mercatorY, scaleAt } from "./mercator";

const TRAIL_POINTS = 24;
const TRAIL_STEP_S = 5;
/** Plots are shown this long, s of data time. */
export const PLOTS_KEPT_S = 30;
const PLOTS_MAX = 20_000;
/** Positions are extrapolated at most this long, s. */
const AHEAD_MAX_S = 10;

export interface Track {
  id: number;
  timeS: number;
  latitude: number;
  longitude: number;
  x: number;
  y: number;
  /** Speed on the map, units/s. */
  vx: number;
  vy: number;
  /** Map units per metre. */
  scale: number;
  heightM: number;
  speedMps: number;
  headingDeg: number;
  climbMps: number;
  sigmaM: number;
  ageS: number;
  state: string;
  onGround: boolean;
  callsign: string | null;
  code: string | null;
  address: string | null;
  trail: { x: number; y: number; timeS: number }[];
}

/** The name of a track: the best that is known. */
export function nameOf(track: Track): string {
  return track.callsign ?? track.code ?? track.address ?? `#${track.id}`;
}

export interface Plot {
  timeS: number;
  track: number;
  sensor: number;
  x: number;
  y: number;
  correctedX: number;
  correctedY: number;
}

export class Store {
  tracks: Track[] = [];
  plots: Plot[] = [];
  sensors: string[] = [];
  dataTimeS: number | null = null;
  /** Frames received, plots that the service no longer had, and answers that were no frame. */
  frames = 0;
  skipped = 0;
  malformed = 0;
  private receivedMs = 0;
  /** Data seconds per second: 1 live, more in a fast replay. */
  private rate = 1;
  private readonly byId = new Map<number, Track>();

  track(id: number | null): Track | undefined {
    return id === null ? undefined : this.byId.get(id);
  }

  /** Take a frame; the clock of the data follows its steps. */
  update(frame: Frame, nowMs: number): void {
    const time = frame.header.data_time_s;
    if (time !== null && this.dataTimeS !== null && nowMs > this.receivedMs) {
      const rate = ((time - this.dataTimeS) * 1000) / (nowMs - this.receivedMs);
      if (rate >= 0 && rate < 1000) this.rate += 0.3 * (rate - this.rate);
    }
    this.dataTimeS = time;
    this.receivedMs = nowMs;
    this.frames += 1;
    this.skipped += frame.header.skipped;
    this.sensors = frame.header.sensors;
    this.updateTracks(frame);
    this.updatePlots(frame);
  }

  /** Forget everything: the service restarted. */
  clear(): void {
    this.tracks = [];
    this.plots = [];
    this.byId.clear();
    this.dataTimeS = null;
  }

  /** Data time at a moment, extrapolated by at most some seconds. */
  timeAt(nowMs: number): number {
    if (this.dataTimeS === null) return 0;
    const ahead = Math.min((nowMs - this.receivedMs) / 1000, 2) * this.rate;
    return this.dataTimeS + Math.min(ahead, AHEAD_MAX_S);
  }

  /** Seconds for which a track is extrapolated at a data time. */
  ahead(track: Track, timeS: number): number {
    return Math.max(0, Math.min(timeS - track.timeS, AHEAD_MAX_S));
  }

  private updateTracks(frame: Frame): void {
    const { tracks, header } = frame;
    const column = (name: string) => tracks.column(name);
    const [ids, times, latitudes, longitudes] =
      [column("track_id"), column("time_s"), column("latitude_deg"), column("longitude_deg")];
    const [heights, speeds, headings, climbs] =
      [column("height_m"), column("speed_mps"), column("heading_deg"), column("vertical_rate_mps")];
    const [sigmas, ages, states, ground] =
      [column("position_sigma_m"), column("age_s"), column("state"), column("on_ground")];
    const live = new Set<number>();
    const found: Track[] = [];
    for (let row = 0; row < tracks.rows; row++) {
      const at = (values: { readonly [index: number]: number | undefined }) => values[row] ?? NaN;
      const id = at(ids);
      const latitude = at(latitudes);
      const longitude = at(longitudes);
      const heading = (at(headings) * Math.PI) / 180;
      const speed = at(speeds);
      const scale = scaleAt(latitude);
      const moving = Number.isFinite(speed) && Number.isFinite(heading);
      const track: Track = {
        id,
        timeS: at(times),
        latitude,
        longitude,
        x: mercatorX(longitude),
        y: mercatorY(latitude),
        vx: moving ? speed * Math.sin(heading) * scale : 0,
        vy: moving ? speed * Math.cos(heading) * scale : 0,
        scale,
        heightM: at(heights),
        speedMps: speed,
        headingDeg: at(headings),
        climbMps: at(climbs),
        sigmaM: at(sigmas),
        ageS: at(ages),
        state: header.states[at(states)] ?? "unknown",
        onGround: at(ground) === 1,
        callsign: header.callsign[row] ?? null,
        code: header.mode_3a[row] ?? null,
        address: header.mode_s_address[row] ?? null,
        trail: this.byId.get(id)?.trail ?? [],
      };
      extendTrail(track);
      live.add(id);
      found.push(track);
      this.byId.set(id, track);
    }
    for (const id of this.byId.keys()) if (!live.has(id)) this.byId.delete(id);
    this.tracks = found;
  }

  private updatePlots(frame: Frame): void {
    const { plots } = frame;
    const column = (name: string) => plots.column(name);
    const [times, ids, sensors] = [column("time_s"), column("track_id"), column("sensor")];
    const [latitudes, longitudes] = [column("latitude_deg"), column("longitude_deg")];
    const corrected = [column("corrected_latitude_deg"), column("corrected_longitude_deg")] as const;
    for (let row = 0; row < plots.rows; row++) {
      const at = (values: { readonly [index: number]: number | undefined }) => values[row] ?? NaN;
      const latitude = at(latitudes);
      if (!Number.isFinite(latitude)) continue;
      this.plots.push({
        timeS: at(times),
        track: at(ids),
        sensor: at(sensors),
        x: mercatorX(at(longitudes)),
        y: mercatorY(latitude),
        correctedX: mercatorX(at(corrected[1])),
        correctedY: mercatorY(at(corrected[0])),
      });
    }
    const since = (this.dataTimeS ?? 0) - PLOTS_KEPT_S;
    this.plots = this.plots.filter((plot) => plot.timeS >= since).slice(-PLOTS_MAX);
  }
}

function extendTrail(track: Track): void {
  const last = track.trail[track.trail.length - 1];
  if (last === undefined || track.timeS - last.timeS >= TRAIL_STEP_S) {
    track.trail.push({ x: track.x, y: track.y, timeS: track.timeS });
    if (track.trail.length > TRAIL_POINTS) track.trail.shift();
  }
}
