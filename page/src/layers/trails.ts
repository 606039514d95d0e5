/** Dots at earlier positions of the tracks. */

import { word, type Pixels } from "../drawing/pixels";
import type { PixelLayer, Scene } from "../drawing/scene";
import { isShown } from "../view/shown";

const DOT_PX = 2;
const OPACITY = 0.75;

export class TrailsLayer implements PixelLayer {
  readonly plane = "ground";
  paint(scene: Scene, pixels: Pixels): void {
    const { store, view, ratio } = scene;
    if (!view.shown.trails) return;
    const colour = word(scene.palette.faint, OPACITY);
    for (const track of store.tracks) {
      if (!isShown(track, view)) continue;
      const { trail } = track;
      for (const at of track.trailAt(scene.timeS)) {
        const x = scene.px(trail.x[at] ?? NaN);
        const y = scene.py(trail.y[at] ?? NaN);
        if (scene.isInside(x, y, 0)) pixels.dot(x * ratio, y * ratio, DOT_PX, colour);
      }
    }
  }
}
