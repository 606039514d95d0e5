/** The plots of each sensor joined to the path that it alone has of each aircraft. */

import { sensorColour } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";

/** Tracks are numbered below this. */
const TRACKS = 2 ** 40;

export class JoinedLayer implements Layer {
  readonly plane = "ground";
  /** Lines on the canvas by sensor, for tests. */
  lines: number[] = [];

  draw(scene: Scene): void {
    const { context, corrected, store, view } = scene;
    this.lines = store.sensors.map(() => 0);
    if (!view.shown.joined || !view.shown.plots) return;
    const { plots } = store;
    const paths = store.sensors.map(() => new Path2D());
    const last = new Map<number, [number, number]>();
    for (let number = plots.first; number < plots.last; number++) {
      const at = plots.slot(number);
      const [sensor, track] = [plots.sensor[at] ?? 0, plots.track[at] ?? 0];
      const path = paths[sensor];
      // A plot that updated no track belongs to no path.
      if (path === undefined || !(track > 0) || view.hiddenSensors.has(store.sensors[sensor] ?? "")) continue;
      const [mx, my] = [plots.x[at] ?? NaN, plots.y[at] ?? NaN];
      const here: [number, number] = [
        scene.px(mx + corrected * ((plots.correctedX[at] ?? NaN) - mx)),
        scene.py(my + corrected * ((plots.correctedY[at] ?? NaN) - my)),
      ];
      const before = last.get(sensor * TRACKS + track);
      if (before !== undefined) {
        path.moveTo(...before);
        path.lineTo(...here);
        this.lines[sensor] = (this.lines[sensor] ?? 0) + 1;
      }
      last.set(sensor * TRACKS + track, here);
    }
    context.lineWidth = 1;
    paths.forEach((path, sensor) => {
      context.strokeStyle = sensorColour(sensor, scene.palette);
      context.stroke(path);
    });
  }
}
