/** A live track. */

import type { Column, Table } from "../service/frame";
import { mercatorX, mercatorY, scaleAt } from "../drawing/mercator";

const TRAIL_POINTS = 24;
const TRAIL_STEP_S = 5;

/** Sources of a track, as in frames. */
export const ADSB = 1;
export const MLAT = 2;
export const RADAR = 4;

/** A level less certain than this is not received but estimated, from ranges of several radars, m. */
const LEVEL_SIGMA_MAX_M = 30;
/** A speed less certain than this is marked, m/s: 50 kt. */
const SPEED_SIGMA_MAX_MPS = 25.7;
/** Codes that mean an emergency, in a word. */
const EMERGENCIES: Record<string, string> = { "7500": "HIJACK", "7600": "NO RADIO", "7700": "EMERGENCY" };

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
  heightSigmaM = NaN;
  speedMps = NaN;
  velocitySigmaMps = NaN;
  headingDeg = NaN;
  climbMps = NaN;
  /** Sigma of the position at the last plot, m. */
  sigmaM = NaN;
  /** At the time of the frame, grown since the last plot: sigma of the position, m. */
  sigmaNowM = NaN;
  /** At the same time: semi-axes of one sigma, m, and the azimuth of the greater one, degrees. */
  majorM = NaN;
  minorM = NaN;
  axisDeg = NaN;
  /** Sources of the last half minute: sum of `ADSB`, `MLAT` and `RADAR`. */
  sources = 0;
  ageS = NaN;
  state = "unknown";
  onGround = false;
  /** Whether it reports its ground status. */
  isGroundKnown = false;
  callsign: string | null = null;
  code: string | null = null;
  address: string | null = null;
  /** Time of the last plot by each sensor. */
  readonly heardS = new Map<string, number>();
  readonly trail = new Trail();
  /** Callsign, code and address as in the frame. */
  private readonly numbers = [-1, -1, -1];
  /** Number of the frame that had it last. */
  seenIn = 0;

  constructor(readonly id: number) {}

  /** Slots of the trail that are shown at a data time. */
  trailAt(timeS: number): Generator<number> {
    return this.trail.after(timeS - TRAIL_POINTS * TRAIL_STEP_S);
  }

  /** Take a row of a frame. */
  update(columns: TrackColumns, states: readonly string[], row: number): void {
    this.timeS = at(columns.time_s, row);
    this.latitude = at(columns.latitude_deg, row);
    this.longitude = at(columns.longitude_deg, row);
    this.x = mercatorX(this.longitude);
    this.y = mercatorY(this.latitude);
    this.scale = scaleAt(this.latitude);
    this.heightM = at(columns.height_m, row);
    this.heightSigmaM = at(columns.height_sigma_m, row);
    this.speedMps = at(columns.speed_mps, row);
    this.velocitySigmaMps = at(columns.velocity_sigma_mps, row);
    this.headingDeg = at(columns.heading_deg, row);
    this.climbMps = at(columns.vertical_rate_mps, row);
    this.sigmaM = at(columns.position_sigma_m, row);
    this.sigmaNowM = at(columns.sigma_now_m, row);
    this.majorM = at(columns.sigma_major_m, row);
    this.minorM = at(columns.sigma_minor_m, row);
    this.axisDeg = at(columns.sigma_azimuth_deg, row);
    this.ageS = at(columns.age_s, row);
    this.sources = at(columns.sources, row);
    this.state = states[at(columns.state, row)] ?? "unknown";
    this.onGround = at(columns.on_ground, row) === 1;
    this.isGroundKnown = at(columns.on_ground, row) >= 0;
    // After a single plot nothing is known of its motion.
    if (this.speedMps === 0 && this.state === "tentative") this.speedMps = this.headingDeg = NaN;
    this.identify(at(columns.callsign, row), at(columns.mode_3a, row), at(columns.mode_s_address, row));
    const heading = (this.headingDeg * Math.PI) / 180;
    const moving = Number.isFinite(this.speedMps) && Number.isFinite(heading);
    this.vx = moving ? this.speedMps * Math.sin(heading) * this.scale : 0;
    this.vy = moving ? this.speedMps * Math.cos(heading) * this.scale : 0;
    this.trail.extend(this.timeS, this.x, this.y);
  }

  /** Whether no height was received lately: such a level has no rate of climb either. */
  get isLevelEstimated(): boolean {
    return this.heightSigmaM > LEVEL_SIGMA_MAX_M && !Number.isFinite(this.climbMps);
  }

  get isSpeedUncertain(): boolean {
    return this.velocitySigmaMps > SPEED_SIGMA_MAX_MPS;
  }

  /** The emergency that its code means, in a word; empty: none. */
  get emergency(): string {
    return EMERGENCIES[this.code ?? ""] ?? "";
  }

  /** Write the texts of an identity that changed. */
  private identify(callsign: number, code: number, address: number): void {
    if (callsign !== this.numbers[0]) this.callsign = callsign < 0 ? null : callsignText(callsign);
    if (code !== this.numbers[1]) this.code = code < 0 ? null : code.toString(8).padStart(4, "0");
    if (address !== this.numbers[2]) this.address = address < 0 ? null : address.toString(16).padStart(6, "0");
    this.numbers[0] = callsign;
    this.numbers[1] = code;
    this.numbers[2] = address;
  }
}

/** Text of a callsign: eight characters of six bits, the first in the highest. */
export function callsignText(packed: number): string {
  let text = "";
  let rest = packed;
  for (let letter = 0; letter < 8; letter++) {
    const six = rest % 64;
    text = String.fromCharCode(six < 32 ? six + 64 : six) + text;
    rest = Math.floor(rest / 64);
  }
  return text.trim();
}

function at(column: Column, row: number): number {
  return column[row] ?? NaN;
}

const COLUMNS = [
  "track_id", "time_s", "latitude_deg", "longitude_deg", "height_m", "height_sigma_m", "speed_mps", "velocity_sigma_mps", "heading_deg", "vertical_rate_mps",
  "position_sigma_m", "sigma_now_m", "sigma_major_m", "sigma_minor_m", "sigma_azimuth_deg", "age_s", "sources", "state", "on_ground",
  "callsign", "mode_3a", "mode_s_address",
] as const;

/** The columns of the tracks of a frame. */
export type TrackColumns = Record<(typeof COLUMNS)[number], Column>;

export function trackColumns(table: Table): TrackColumns {
  return Object.fromEntries(COLUMNS.map((name) => [name, table.column(name)])) as TrackColumns;
}

/** The name under which people know a track. */
export function nameOf(track: Track): string {
  return track.callsign ?? track.code ?? track.address ?? `#${track.id}`;
}

/** The last positions, in arrays of fixed size. */
export class Trail {
  readonly x = new Float64Array(TRAIL_POINTS);
  readonly y = new Float64Array(TRAIL_POINTS);
  readonly timeS = new Float64Array(TRAIL_POINTS);
  /** Positions so far; that of number n is in slot n modulo the capacity. */
  private end = 0;
  private lastS = -Infinity;

  get length(): number {
    return Math.min(this.end, TRAIL_POINTS);
  }

  /** Discard all: older ones come again. */
  clear(): void {
    [this.end, this.lastS] = [0, -Infinity];
  }

  /** Slots of the positions after a time, oldest first. */
  *after(timeS: number): Generator<number> {
    for (let number = this.end - this.length; number < this.end; number++) {
      const slot = number % TRAIL_POINTS;
      if ((this.timeS[slot] ?? NaN) > timeS) yield slot;
    }
  }

  extend(timeS: number, x: number, y: number): void {
    if (!(timeS - this.lastS >= TRAIL_STEP_S)) return;
    // After a gap the positions before it are not those of the last two minutes.
    if (timeS - this.lastS > TRAIL_POINTS * TRAIL_STEP_S) this.end = 0;
    this.x[this.end % TRAIL_POINTS] = x;
    this.y[this.end % TRAIL_POINTS] = y;
    this.timeS[this.end % TRAIL_POINTS] = timeS;
    this.lastS = timeS;
    this.end += 1;
  }
}
