/** Tracks: position uncertainty, speed vectors and symbols. */

import type { Palette } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import { isShown } from "../shown";
import type { Track } from "../store";

const VECTOR_S = 60;
const UNCERTAINTY_SIGMAS = 3;
/** Smaller regions are covered by the symbol, pixels. */
const UNCERTAINTY_MIN_PX = 3;
const MARGIN_PX = 50;
const RADIUS_PX = 4;
const TURN = 2 * Math.PI;

/** Finds the tracks on the canvas; the layers after it draw `scene.seen`. */
export class SeenLayer implements Layer {
  readonly plane = "moving";

  draw(scene: Scene): void {
    const { seen, store, view, timeS } = scene;
    seen.clear();
    for (const track of store.tracks) {
      const ahead = store.ahead(track, timeS);
      const x = scene.px(track.x + track.vx * ahead);
      const y = scene.py(track.y + track.vy * ahead);
      if (scene.isInside(x, y, MARGIN_PX) && isShown(track, view)) seen.add(track, x, y);
    }
  }
}

export class UncertaintyLayer implements Layer {
  readonly plane = "moving";

  draw(scene: Scene): void {
    const { context, palette, seen } = scene;
    if (!scene.view.shown.uncertainty) return;
    context.fillStyle = palette.uncertainty;
    for (let at = 0; at < seen.length; at++) {
      const track = seen.tracks[at] as Track;
      const radius = UNCERTAINTY_SIGMAS * track.sigmaM * track.scale * scene.a;
      if (!(radius > UNCERTAINTY_MIN_PX)) continue;
      context.beginPath();
      context.arc(seen.x[at] ?? 0, seen.y[at] ?? 0, radius, 0, TURN);
      context.fill();
    }
  }
}

export class VectorsLayer implements Layer {
  readonly plane = "moving";

  draw(scene: Scene): void {
    const { context, palette, seen } = scene;
    if (!scene.view.shown.vectors) return;
    context.strokeStyle = palette.faint;
    context.lineWidth = 1;
    context.beginPath();
    for (let at = 0; at < seen.length; at++) {
      const track = seen.tracks[at] as Track;
      if (track.vx === 0 && track.vy === 0) continue;
      const [x, y] = [seen.x[at] ?? 0, seen.y[at] ?? 0];
      context.moveTo(x, y);
      context.lineTo(x + scene.a * track.vx * VECTOR_S, y + scene.d * track.vy * VECTOR_S);
    }
    context.stroke();
  }
}

export class SymbolsLayer implements Layer {
  readonly plane = "moving";

  draw(scene: Scene): void {
    const { context, palette, seen, view } = scene;
    context.lineWidth = 1.2;
    let colour = "";
    for (let at = 0; at < seen.length; at++) {
      const track = seen.tracks[at] as Track;
      const [x, y] = [seen.x[at] ?? 0, seen.y[at] ?? 0];
      const wanted = colourOf(track, track.id === view.selected, palette);
      if (wanted !== colour) {
        colour = wanted;
        context.strokeStyle = colour;
        context.fillStyle = colour;
      }
      symbol(context, track, x, y);
      if (track.id === view.selected) {
        context.beginPath();
        context.arc(x, y, 11, 0, TURN);
        context.stroke();
      }
    }
  }
}

function colourOf(track: Track, selected: boolean, palette: Palette): string {
  if (selected) return palette.selected;
  return track.state === "confirmed" ? palette.track : track.state === "coasting" ? palette.stale : palette.faint;
}

/** Confirmed: filled; tentative: open; coasting: a cross; on the ground: a square. */
function symbol(context: CanvasRenderingContext2D, track: Track, x: number, y: number): void {
  context.beginPath();
  if (track.state === "coasting") {
    context.moveTo(x - 5, y - 5);
    context.lineTo(x + 5, y + 5);
    context.moveTo(x + 5, y - 5);
    context.lineTo(x - 5, y + 5);
    context.stroke();
    return;
  }
  if (track.onGround) context.rect(x - RADIUS_PX, y - RADIUS_PX, 2 * RADIUS_PX, 2 * RADIUS_PX);
  else context.arc(x, y, RADIUS_PX, 0, TURN);
  if (track.state === "confirmed") context.fill();
  else context.stroke();
}
