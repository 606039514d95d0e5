/** Plots by sensor, between the positions as measured and those without biases. */

import { sensorColour, type Palette } from "../drawing/palette";
import { word, type Pixels } from "../drawing/pixels";
import type { PixelLayer, Scene } from "../drawing/scene";
import { PLOTS_KEPT_S } from "../sky/plots";

/** Opacity falls with age in so many steps. */
const STEPS = 4;
/** Plots of the selected track are larger. */
const SELECTED_SIZE = 2;

export class PlotsLayer implements PixelLayer {
  readonly plane = "ground";
  /** Word of the colour by sensor and step of age. */
  private words: number[][] = [];
  private of: Palette | null = null;

  paint(scene: Scene, pixels: Pixels): void {
    const { store, corrected, ratio, view, timeS } = scene;
    if (!view.shown.plots) return;
    const { plots } = store;
    if (scene.palette !== this.of) [this.of, this.words] = [scene.palette, []];
    const hidden = store.sensors.map((id) => view.hiddenSensors.has(id));
    for (let number = plots.first; number < plots.last; number++) {
      const at = plots.slot(number);
      if (hidden[plots.sensor[at] ?? 0] === true) continue;
      const measuredX = plots.x[at] ?? NaN;
      const measuredY = plots.y[at] ?? NaN;
      const x = scene.px(measuredX + corrected * ((plots.correctedX[at] ?? NaN) - measuredX));
      const y = scene.py(measuredY + corrected * ((plots.correctedY[at] ?? NaN) - measuredY));
      if (!scene.isInside(x, y, 0)) continue;
      const age = (timeS - (plots.timeS[at] ?? 0)) / PLOTS_KEPT_S;
      const step = Math.max(0, Math.min(STEPS - 1, Math.floor(STEPS * age)));
      const sensor = plots.sensor[at] ?? 0;
      const size = plots.track[at] === view.selected ? SELECTED_SIZE : 1;
      pixels.mark(sensor, x * ratio, y * ratio, this.colour(sensor, step, scene.palette), size);
    }
  }

  private colour(sensor: number, step: number, palette: Palette): number {
    const known = (this.words[sensor] ??= Array.from({ length: STEPS }, (_, one) =>
      word(sensorColour(sensor, palette), 1 - (0.65 * one) / (STEPS - 1))));
    return known[step] ?? 0;
  }
}
