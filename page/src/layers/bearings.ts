/** Bearings by sensor: thin lines to the track that they updated, between those as measured and without biases. */

import { sensorColour } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import { PLOTS_KEPT_S } from "../sky/plots";

/** Opacity falls with age in so many steps, from the first to the last. */
const STEPS = 4;
const OPACITY = [0.6, 0.15] as const;
const SELECTED_OPACITY = 1;

export class BearingsLayer implements Layer {
  readonly plane = "ground";
  /** Lines on the canvas by sensor, for tests: pixels of both ends. */
  lines: Record<string, [number, number, number, number][]> = {};

  draw(scene: Scene): void {
    const { context, corrected, store, view, timeS } = scene;
    this.lines = {};
    if (!view.shown.plots) return;
    const { bearings } = store;
    const paths = new Map<string, Path2D>();
    for (let number = bearings.first; number < bearings.last; number++) {
      const at = bearings.slot(number);
      const sensor = bearings.sensor[at] ?? 0;
      const id = store.sensors[sensor] ?? "";
      if (view.hiddenSensors.has(id)) continue;
      const [endX, endY] = [bearings.x[at] ?? NaN, bearings.y[at] ?? NaN];
      const line: [number, number, number, number] = [
        scene.px(bearings.sourceX[at] ?? NaN), scene.py(bearings.sourceY[at] ?? NaN),
        scene.px(endX + corrected * ((bearings.correctedX[at] ?? NaN) - endX)),
        scene.py(endY + corrected * ((bearings.correctedY[at] ?? NaN) - endY)),
      ];
      const age = (timeS - (bearings.timeS[at] ?? 0)) / PLOTS_KEPT_S;
      const step = Math.max(0, Math.min(STEPS - 1, Math.floor(STEPS * age)));
      const isSelected = bearings.track[at] === view.selected;
      const opacity = isSelected ? SELECTED_OPACITY : OPACITY[0] + ((OPACITY[1] - OPACITY[0]) * step) / (STEPS - 1);
      const key = `${sensor} ${opacity}`;
      let path = paths.get(key);
      if (path === undefined) paths.set(key, path = new Path2D());
      path.moveTo(line[0], line[1]);
      path.lineTo(line[2], line[3]);
      (this.lines[id] ??= []).push(line);
    }
    context.lineWidth = 1;
    for (const [key, path] of paths) {
      const [sensor, opacity] = key.split(" ").map(Number);
      context.strokeStyle = sensorColour(sensor ?? 0, scene.palette);
      context.globalAlpha = opacity ?? 1;
      context.stroke(path);
    }
    context.globalAlpha = 1;
  }
}
