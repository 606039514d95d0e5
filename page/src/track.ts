/** A live track. */

import type { Column, Frame } from "./frame";
import { mercatorX, mercatorY, scaleAt } from "./mercator";

const TRAIL_POINTS = 24;
const TRAIL_STEP_S = 5;

export class Track {
  timeS = NaN;
  latitude = NaN;
  longitude = NaN;
  x = NaN;
  y = NaN;
  /** Speed on the map, units/s. */
  vx = 0;
  vy = 0;
  /** Map units per metre. */
  scale = 1;
  heightM = NaN;
  speedMps = NaN;
  headingDeg = NaN;
  climbMps = NaN;
  sigmaM = NaN;
  ageS = NaN;
  state = "unknown";
  onGround = false;
  callsign: string | null = null;
  code: string | null = null;
  address: string | null = null;
  readonly trail = new Trail();
  /** Number of the frame that had it last. */
  seenIn = 0;

  constructor(readonly id: number) {}

  /** Take a row of a frame. */
  update(frame: Frame, row: number): void {
    const { tracks, header } = frame;
    const at = (name: string): number => numberAt(tracks.column(name), row);
    this.timeS = at("time_s");
    this.latitude = at("latitude_deg");
    this.longitude = at("longitude_deg");
    this.x = mercatorX(this.longitude);
    this.y = mercatorY(this.latitude);
    this.scale = scaleAt(this.latitude);
    this.heightM = at("height_m");
    this.speedMps = at("speed_mps");
    this.headingDeg = at("heading_deg");
    this.climbMps = at("vertical_rate_mps");
    this.sigmaM = at("position_sigma_m");
    this.ageS = at("age_s");
    this.state = header.states[at("state")] ?? "unknown";
    this.onGround = at("on_ground") === 1;
    this.callsign = header.callsign[row] ?? null;
    this.code = header.mode_3a[row] ?? null;
    this.address = header.mode_s_address[row] ?? null;
    const heading = (this.headingDeg * Math.PI) / 180;
    const moving = Number.isFinite(this.speedMps) && Number.isFinite(heading);
    this.vx = moving ? this.speedMps * Math.sin(heading) * this.scale : 0;
    this.vy = moving ? this.speedMps * Math.cos(heading) * this.scale : 0;
    this.trail.extend(this.timeS, this.x, this.y);
  }

}

/** The name under which people know a track. */
export function nameOf(track: Track): string {
  return track.callsign ?? track.code ?? track.address ?? `#${track.id}`;
}

function numberAt(column: Column, row: number): number {
  return column[row] ?? NaN;
}

/** The last positions, in arrays of fixed size. */
export class Trail {
  readonly x = new Float64Array(TRAIL_POINTS);
  readonly y = new Float64Array(TRAIL_POINTS);
  /** Positions so far; that of number n is in slot n modulo the capacity. */
  private end = 0;
  private lastS = -Infinity;

  get length(): number {
    return Math.min(this.end, TRAIL_POINTS);
  }

  extend(timeS: number, x: number, y: number): void {
    if (!(timeS - this.lastS >= TRAIL_STEP_S)) return;
    this.x[this.end % TRAIL_POINTS] = x;
    this.y[this.end % TRAIL_POINTS] = y;
    this.lastS = timeS;
    this.end += 1;
  }
}
