/** Tracks: position uncertainty, speed vectors and symbols. */

import type { Palette } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import { isShown } from "../shown";
import type { Track } from "../store";
import { ADSB, MLAT } from "../track";

const VECTOR_S = 60;
const UNCERTAINTY_SIGMAS = 3;
/** Smaller regions are covered by the symbol, pixels. */
const UNCERTAINTY_MIN_PX = 3;
const MARGIN_PX = 50;
const RADIUS_PX = 4;
const GROUND_PX = 2.5;
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

/** The region of three sigmas: the axes of the covariance, not a circle. */
export class UncertaintyLayer implements Layer {
  readonly plane = "moving";

  draw(scene: Scene): void {
    const { context, palette, seen } = scene;
    if (!scene.view.shown.uncertainty) return;
    context.fillStyle = palette.uncertainty;
    context.strokeStyle = palette.uncertaintyEdge;
    context.lineWidth = 1;
    for (let at = 0; at < seen.length; at++) {
      const track = seen.tracks[at] as Track;
      const perSigma = UNCERTAINTY_SIGMAS * track.scale * scene.a;
      const known = Number.isFinite(track.majorM);
      const major = perSigma * (known ? track.majorM : track.sigmaM);
      if (!(major > UNCERTAINTY_MIN_PX)) continue;
      const minor = known ? perSigma * track.minorM : major;
      context.beginPath();
      context.ellipse(seen.x[at] ?? 0, seen.y[at] ?? 0, major, minor, known ? ((track.axisDeg - 90) * Math.PI) / 180 : 0, 0, TURN);
      context.fill();
      context.stroke();
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

/**
 * The form says the source: circle for radars alone, diamond with ADS-B, square with multilateration;
 * the filling the state: confirmed filled, tentative open, coasting crossed. On the ground it is small.
 */
function symbol(context: CanvasRenderingContext2D, track: Track, x: number, y: number): void {
  context.beginPath();
  if (track.state === "coasting") {
    context.moveTo(x - RADIUS_PX, y - RADIUS_PX);
    context.lineTo(x + RADIUS_PX, y + RADIUS_PX);
    context.moveTo(x + RADIUS_PX, y - RADIUS_PX);
    context.lineTo(x - RADIUS_PX, y + RADIUS_PX);
    context.stroke();
    return;
  }
  const radius = track.onGround ? GROUND_PX : RADIUS_PX;
  if ((track.sources & ADSB) !== 0) diamond(context, x, y, 1.3 * radius);
  else if ((track.sources & MLAT) !== 0) context.rect(x - 0.9 * radius, y - 0.9 * radius, 1.8 * radius, 1.8 * radius);
  else context.arc(x, y, radius, 0, TURN);
  if (track.state === "confirmed") context.fill();
  else context.stroke();
}

function diamond(context: CanvasRenderingContext2D, x: number, y: number, radius: number): void {
  context.moveTo(x, y - radius);
  context.lineTo(x + radius, y);
  context.lineTo(x, y + radius);
  context.lineTo(x - radius, y);
  context.closePath();
}
