/** The other of two recorded runs, for comparison: its own tracks, with symbols of another form. */

import type { Layer, PixelLayer, Scene } from "../drawing/scene";
import { word, type Pixels } from "../drawing/pixels";
import { isShown } from "../view/shown";

/** Wider than the symbols of the chosen run, which remain visible inside. */
const SIZE_PX = 7;
const VECTOR_S = 60;
const DOT_PX = 2;
const OPACITY = 0.6;
export const SECOND_COLOURS = { dark: "#ff9bd2", light: "#8a0f5c" } as const;

export class SecondRun implements Layer {
  readonly plane = "moving";
  draw(scene: Scene): void {
    const { context, seenSecond: seen, view } = scene;
    const store = scene.feed.second;
    seen.clear();
    context.strokeStyle = SECOND_COLOURS[view.theme];
    context.lineWidth = 1.3;
    for (const track of store.tracks) {
      if (!isShown(track, view, true)) continue;
      const [east, north] = store.placeOf(track, scene.timeS);
      const [x, y] = [scene.px(east), scene.py(north)];
      if (!scene.isInside(x, y, SIZE_PX)) continue;
      seen.add(track, x, y);
      triangle(context, x, y, track.state);
      if (!view.shown.vectors || (track.vx === 0 && track.vy === 0)) continue;
      context.setLineDash([3, 3]);
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + scene.a * track.vx * VECTOR_S, y + scene.d * track.vy * VECTOR_S);
      context.stroke();
      context.setLineDash([]);
    }
  }
}

/** Its earlier positions. */
export class SecondTrails implements PixelLayer {
  readonly plane = "ground";

  paint(scene: Scene, pixels: Pixels): void {
    const { ratio, view } = scene;
    if (!view.shown.trails) return;
    const colour = word(SECOND_COLOURS[view.theme], OPACITY);
    for (const track of scene.feed.second.tracks) {
      if (!isShown(track, view, true)) continue;
      const { trail } = track;
      for (const at of track.trailAt(scene.timeS)) {
        const [x, y] = [scene.px(trail.x[at] ?? NaN), scene.py(trail.y[at] ?? NaN)];
        if (scene.isInside(x, y, 0)) pixels.dot(x * ratio, y * ratio, DOT_PX, colour);
      }
    }
  }
}

/**
 * With the point down: no symbol of the chosen run or of a site has this form. It is broken of a tentative and crossed
 * of a coasting track.
 */
function triangle(context: CanvasRenderingContext2D, x: number, y: number, state: string): void {
  context.beginPath();
  context.moveTo(x - SIZE_PX, y - SIZE_PX);
  context.lineTo(x + SIZE_PX, y - SIZE_PX);
  context.lineTo(x, y + SIZE_PX);
  context.closePath();
  if (state === "tentative") context.setLineDash([2, 2]);
  if (state === "coasting") {
    context.moveTo(x - SIZE_PX - 1, y - SIZE_PX - 1);
    context.lineTo(x + SIZE_PX + 1, y + SIZE_PX + 1);
    context.moveTo(x + SIZE_PX + 1, y - SIZE_PX - 1);
    context.lineTo(x - SIZE_PX - 1, y + SIZE_PX + 1);
  }
  context.stroke();
  context.setLineDash([]);
}
