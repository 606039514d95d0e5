/** The second of two recorded runs: its own tracks, with symbols of another form. */

import type { Layer, Scene } from "../drawing/scene";
import { RUN_KEYS } from "../overlays/panel";

const SIZE_PX = 5;
const VECTOR_S = 60;
const COLOURS = { dark: "#ff9bd2", light: "#8a0f5c" } as const;

export class SecondRun implements Layer {
  readonly plane = "moving";
  draw(scene: Scene): void {
    const { context, view } = scene;
    const store = scene.feed.second;
    if (store.tracks.length === 0 || view.hidden.has(RUN_KEYS[1])) return;
    context.strokeStyle = COLOURS[view.theme];
    context.lineWidth = 1.3;
    for (const track of store.tracks) {
      if (track.state === "tentative" && !view.shown.tentative) continue;
      const ahead = store.ahead(track, scene.timeS);
      const [x, y] = [scene.px(track.x + track.vx * ahead), scene.py(track.y + track.vy * ahead)];
      if (!scene.isInside(x, y, SIZE_PX)) continue;
      triangle(context, x, y, SIZE_PX);
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

/** Open and with the point down: no symbol of the first run or of a site has this form. */
function triangle(context: CanvasRenderingContext2D, x: number, y: number, size: number): void {
  context.beginPath();
  context.moveTo(x - size, y - size);
  context.lineTo(x + size, y - size);
  context.lineTo(x, y + size);
  context.closePath();
  context.stroke();
}
