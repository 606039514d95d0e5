/** The plots of the last seconds, or the bearings, in arrays of fixed size: the oldest are overwritten. */

import type { Table } from "../service/frame";
import { latitudeOf, longitudeOf, mercatorX, mercatorY } from "../drawing/mercator";

/** Plots are shown this long, s of data time. */
export const PLOTS_KEPT_S = 30;
const PLOTS_MAX = 32_768;

export interface Plot {
  timeS: number;
  track: number;
  sensor: number;
  x: number;
  y: number;
  correctedX: number;
  correctedY: number;
}

export class Plots {
  readonly timeS = new Float64Array(PLOTS_MAX);
  readonly track = new Float64Array(PLOTS_MAX);
  readonly sensor = new Int32Array(PLOTS_MAX);
  readonly x = new Float64Array(PLOTS_MAX);
  readonly y = new Float64Array(PLOTS_MAX);
  readonly correctedX = new Float64Array(PLOTS_MAX);
  readonly correctedY = new Float64Array(PLOTS_MAX);
  /** Of bearings, whose positions are the ends of their lines: where their sensor was. */
  readonly sourceX = new Float64Array(PLOTS_MAX);
  readonly sourceY = new Float64Array(PLOTS_MAX);
  /** Plots since the page was opened; the plot of number n is in slot n modulo the capacity. */
  private end = 0;
  private begin = 0;

  get length(): number {
    return this.end - this.begin;
  }

  /** Whether older ones may have been overwritten. */
  get isFull(): boolean {
    return this.length === PLOTS_MAX;
  }

  /** Plots of a sensor. */
  count(sensor: number): number {
    let found = 0;
    for (let number = this.begin; number < this.end; number++) if (this.sensor[number % PLOTS_MAX] === sensor) found += 1;
    return found;
  }

  /** Number of the oldest plot, and one more than that of the newest. */
  get first(): number {
    return this.begin;
  }

  get last(): number {
    return this.end;
  }

  /** The slot of a plot in the arrays. */
  slot(number: number): number {
    return number % PLOTS_MAX;
  }

  /** The measured position of a slot, degrees. */
  latitude(slot: number): number {
    return latitudeOf(this.y[slot] ?? NaN);
  }

  longitude(slot: number): number {
    return longitudeOf(this.x[slot] ?? NaN);
  }

  clear(): void {
    this.begin = this.end;
  }

  /** Add the plots of a frame, and drop those before a time. */
  update(table: Table, sinceS: number): void {
    const [times, tracks, sensors] = [table.column("time_s"), table.column("track_id"), table.column("sensor")];
    const [latitudes, longitudes] = [table.column("latitude_deg"), table.column("longitude_deg")];
    const correctedLatitudes = table.column("corrected_latitude_deg");
    const correctedLongitudes = table.column("corrected_longitude_deg");
    const [sourceLatitudes, sourceLongitudes] = [table.column("source_latitude_deg"), table.column("source_longitude_deg")];
    for (let row = 0; row < table.rows; row++) {
      const latitude = latitudes[row] ?? NaN;
      if (!Number.isFinite(latitude)) continue;
      const at = this.end % PLOTS_MAX;
      this.timeS[at] = times[row] ?? NaN;
      this.track[at] = tracks[row] ?? NaN;
      this.sensor[at] = sensors[row] ?? 0;
      this.x[at] = mercatorX(longitudes[row] ?? NaN);
      this.y[at] = mercatorY(latitude);
      this.correctedX[at] = mercatorX(correctedLongitudes[row] ?? NaN);
      this.correctedY[at] = mercatorY(correctedLatitudes[row] ?? NaN);
      this.sourceX[at] = mercatorX(sourceLongitudes[row] ?? NaN);
      this.sourceY[at] = mercatorY(sourceLatitudes[row] ?? NaN);
      this.end += 1;
    }
    this.begin = Math.max(this.begin, this.end - PLOTS_MAX);
    // Nearly in order of time: an old one behind a newer one goes with that.
    while (this.begin < this.end && !((this.timeS[this.begin % PLOTS_MAX] ?? 0) >= sinceS)) this.begin += 1;
  }

  /** The plots, oldest first. */
  *[Symbol.iterator](): Generator<Plot> {
    for (let number = this.begin; number < this.end; number++) {
      const at = number % PLOTS_MAX;
      yield {
        timeS: this.timeS[at] ?? NaN, track: this.track[at] ?? NaN, sensor: this.sensor[at] ?? 0,
        x: this.x[at] ?? NaN, y: this.y[at] ?? NaN,
        correctedX: this.correctedX[at] ?? NaN, correctedY: this.correctedY[at] ?? NaN,
      };
    }
  }
}
