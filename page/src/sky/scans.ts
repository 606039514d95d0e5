/** Where the antenna of each radar points, from the azimuths and times of its plots and bearings. */

import type { Sensor } from "../service/feed";
import { azimuthTo } from "../drawing/mercator";
import type { Plots } from "./plots";
import type { Store } from "./store";

const TURN = 2 * Math.PI;
/** Plots after which an antenna may turn on the map, and how well they agree at least, 0 to 1. */
const PLOTS_MIN = 5;
const AGREEMENT_MIN = 0.9;
/**
 * A radar without plots for so many revolutions while others send, or all without plots for so long, s of data time, stand
 * still: nothing moves without data. Plots come with a delay, since the service brings them into order.
 */
const SILENT_TURNS = 1.5;
const SILENT_S = 20;
/** Weight of the plots of one revolution ago. */
const FADING = 0.5;
/** Plots that are older by more are of an earlier time: the user went back, s. */
const BACK_S = 60;

/** The phase of one antenna: a vector that turns with it, the mean of those of its plots. */
interface Phase {
  /** Data time of the newest plot. */
  timeS: number;
  x: number;
  y: number;
  weight: number;
}

export class Scans {
  private readonly phases = new Map<string, Phase>();
  private readonly read = [0, 0];
  /** Data time of the newest plot of all. */
  private newestS = -Infinity;

  constructor(private readonly store: Store) {}

  /** Take the plots since the last call. */
  update(sensors: readonly Sensor[]): void {
    const { plots, bearings, dataTimeS } = this.store;
    if (sensors.length === 0) return;
    // Another time is shown, or the service started again.
    if (dataTimeS === null || this.newestS > dataTimeS + SILENT_S) this.clear();
    const known = this.store.sensors.map((id) => sensors.find((one) => one.id === id));
    [plots, bearings].forEach((marks, kind) => this.take(marks, kind, known));
  }

  private take(plots: Plots, kind: number, known: readonly (Sensor | undefined)[]): void {
    const read = this.read[kind] ?? 0;
    const first = Math.max(read > plots.last ? 0 : read, plots.first);
    this.read[kind] = plots.last;
    for (let number = first; number < plots.last; number++) {
      const at = plots.slot(number);
      const sensor = known[plots.sensor[at] ?? -1];
      if (sensor === undefined || !turns(sensor)) continue;
      const azimuth = azimuthTo(
        sensor.latitude_deg, sensor.longitude_deg, plots.latitude(at), plots.longitude(at),
      );
      this.add(sensor.id, plots.timeS[at] ?? NaN, azimuth, sensor.rotation_period_s);
    }
  }

  /** The azimuth of an antenna at a data time, rad; null while it is not known. */
  azimuth(sensor: Sensor, timeS: number): number | null {
    const phase = this.phases.get(sensor.id);
    if (phase === undefined || !turns(sensor)) return null;
    const ahead = (timeS - phase.timeS) / sensor.rotation_period_s;
    const silent = (this.newestS - phase.timeS) / sensor.rotation_period_s;
    const length = Math.hypot(phase.x, phase.y);
    if (phase.weight < PLOTS_MIN || length < AGREEMENT_MIN * phase.weight || !(silent < SILENT_TURNS)) return null;
    if (!(timeS - this.newestS < SILENT_S)) return null;
    return Math.atan2(phase.y, phase.x) + TURN * ahead;
  }

  private clear(): void {
    this.phases.clear();
    this.newestS = -Infinity;
  }

  private add(id: string, timeS: number, azimuth: number, periodS: number): void {
    this.newestS = Math.max(this.newestS, timeS);
    let phase = this.phases.get(id);
    if (phase === undefined || timeS < phase.timeS - BACK_S) {
      phase = { timeS, x: 0, y: 0, weight: 0 };
      this.phases.set(id, phase);
    }
    const ahead = Math.max(0, timeS - phase.timeS) / periodS;
    const kept = FADING ** ahead;
    const [cosine, sine] = [Math.cos(TURN * ahead), Math.sin(TURN * ahead)];
    [phase.x, phase.y] = [kept * (cosine * phase.x - sine * phase.y), kept * (sine * phase.x + cosine * phase.y)];
    phase.weight *= kept;
    phase.timeS = Math.max(phase.timeS, timeS);
    // A plot that comes late is turned to the time of the newest.
    const now = azimuth + (TURN * (phase.timeS - timeS)) / periodS;
    phase.x += Math.cos(now);
    phase.y += Math.sin(now);
    phase.weight += 1;
  }
}

interface Turning extends Sensor {
  latitude_deg: number;
  longitude_deg: number;
  rotation_period_s: number;
}

function turns(sensor: Sensor): sensor is Turning {
  return sensor.kind === "radar" && sensor.latitude_deg !== null && sensor.longitude_deg !== null
    && sensor.rotation_period_s !== null && sensor.rotation_period_s > 0;
}
