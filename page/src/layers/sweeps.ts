/** The turning beam of each radar, as its plots show it. */

import { sensorColour } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import { destination, mercatorX, mercatorY } from "../drawing/mercator";
import type { Scans } from "../sky/scans";
import { RANGE_ASSUMED_M, type Sites } from "./sites";

const POINTS = 6;
const DEGREE = Math.PI / 180;
/** Fainter lines behind the beam: azimuth, degrees, and opacity. */
const BEAM = [[0, 0.55], [-1.5, 0.28], [-3, 0.16], [-4.5, 0.08]] as const;

export class SweepsLayer implements Layer {
  readonly plane = "sweep";
  /** Radars whose beam was drawn, for tests. */
  drawn: string[] = [];

  constructor(
    private readonly sites: Sites,
    private readonly scans: Scans,
  ) {}

  /** Whether a beam turns. */
  moves(scene: Scene): boolean {
    return scene.view.shown.sweeps
      && this.sites.all(scene).some((one) => this.scans.azimuth(one.sensor, scene.timeS) !== null);
  }

  draw(scene: Scene): void {
    const { context, palette, store, view, timeS } = scene;
    this.drawn.length = 0;
    if (!view.shown.sweeps) return;
    context.lineWidth = 1;
    for (const { sensor } of this.sites.all(scene)) {
      const azimuth = this.scans.azimuth(sensor, timeS);
      if (azimuth === null || view.hiddenSensors.has(sensor.id)) continue;
      context.strokeStyle = sensorColour(store.sensors.indexOf(sensor.id), palette);
      for (const [behind, opacity] of BEAM) {
        context.globalAlpha = opacity;
        context.beginPath();
        for (let at = 0; at <= POINTS; at++) {
          const [longitude, latitude] = destination(
            sensor.latitude_deg ?? 0, sensor.longitude_deg ?? 0, azimuth / DEGREE + behind,
            (at * (sensor.range_max_m ?? RANGE_ASSUMED_M)) / POINTS,
          );
          context.lineTo(scene.px(mercatorX(longitude)), scene.py(mercatorY(latitude)));
        }
        context.stroke();
      }
      this.drawn.push(sensor.id);
    }
    context.globalAlpha = 1;
  }
}
