/** Tracks: position uncertainty, speed vectors and symbols. */

import type { Palette } from "../drawing/palette";
import { Form, word, type Pixels } from "../drawing/pixels";
import type { Layer, PixelLayer, Scene } from "../drawing/scene";
import { isShown } from "../view/shown";
import type { Track } from "../sky/store";
import { ADSB, MLAT } from "../sky/track";

const VECTOR_S = 60;
const UNCERTAINTY_SIGMAS = 3;
/** Smaller regions are covered by the symbol, pixels. */
const UNCERTAINTY_MIN_PX = 3;
const MARGIN_PX = 50;
const RADIUS_PX = 4;
const GROUND_PX = 2.5;
const SELECTED_PX = 11;
const TURN = 2 * Math.PI;

/** Finds the tracks on the canvas; the layers after it draw `scene.seen`. */
export class SeenLayer implements PixelLayer {
  readonly plane = "moving";

  paint(scene: Scene): void {
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
      const major = perSigma * (known ? track.majorM : track.sigmaNowM);
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

/**
 * The form says the source: circle for radars alone, diamond with ADS-B, square with multilateration;
 * the filling the state: confirmed filled, tentative open, coasting crossed. On the ground it is small.
 */
export class SymbolsLayer implements PixelLayer {
  readonly plane = "moving";
  private readonly forms = new Map<number, Form>();
  private readonly words = new Map<string, number>();
  private ratio = 0;

  paint(scene: Scene, pixels: Pixels): void {
    const { palette, seen, view, ratio } = scene;
    if (ratio !== this.ratio) this.forms.clear();
    this.ratio = ratio;
    for (let at = 0; at < seen.length; at++) {
      const track = seen.tracks[at] as Track;
      const colour = colourOf(track, track.id === view.selected, palette);
      pixels.form(this.form(track), (seen.x[at] ?? 0) * ratio, (seen.y[at] ?? 0) * ratio, this.word(colour));
    }
  }

  private form(track: Track): Form {
    const state = track.state === "coasting" ? 2 : track.state === "confirmed" ? 1 : 0;
    const source = (track.sources & ADSB) !== 0 ? 2 : (track.sources & MLAT) !== 0 ? 1 : 0;
    const key = state + 3 * source + (track.onGround ? 9 : 0);
    let form = this.forms.get(key);
    if (form === undefined) {
      const { ratio } = this;
      form = new Form(Math.ceil(8 * ratio), (context) => {
        context.scale(ratio, ratio);
        context.lineWidth = 1.25;
        symbol(context, state, source, track.onGround ? GROUND_PX : RADIUS_PX);
      });
      this.forms.set(key, form);
    }
    return form;
  }

  private word(colour: string): number {
    let found = this.words.get(colour);
    if (found === undefined) {
      found = word(colour, 0);
      this.words.set(colour, found);
    }
    return found;
  }
}

/** A circle around the selected track. */
export class SelectedLayer implements Layer {
  readonly plane = "moving";

  draw(scene: Scene): void {
    const { context, palette, seen, view } = scene;
    context.strokeStyle = palette.selected;
    context.lineWidth = 1;
    for (let at = 0; at < seen.length; at++) {
      if (seen.tracks[at]?.id !== view.selected) continue;
      context.beginPath();
      context.arc(seen.x[at] ?? 0, seen.y[at] ?? 0, SELECTED_PX, 0, TURN);
      context.stroke();
    }
  }
}

function colourOf(track: Track, selected: boolean, palette: Palette): string {
  if (selected) return palette.selected;
  if (track.emergency !== "") return palette.warning;
  return track.state === "confirmed" ? palette.track : track.state === "coasting" ? palette.stale : palette.faint;
}

function symbol(context: CanvasRenderingContext2D, state: number, source: number, radius: number): void {
  context.beginPath();
  if (source === 2) diamond(context, 1.35 * radius);
  else if (source === 1) context.rect(-0.9 * radius, -0.9 * radius, 1.8 * radius, 1.8 * radius);
  else context.arc(0, 0, radius, 0, TURN);
  if (state === 1) {
    context.fill();
    return;
  }
  context.stroke();
  if (state === 0) return;
  context.beginPath();
  context.moveTo(-radius - 2, -radius - 2);
  context.lineTo(radius + 2, radius + 2);
  context.moveTo(radius + 2, -radius - 2);
  context.lineTo(-radius - 2, radius + 2);
  context.stroke();
}

function diamond(context: CanvasRenderingContext2D, radius: number): void {
  context.moveTo(0, -radius);
  context.lineTo(radius, 0);
  context.lineTo(0, radius);
  context.lineTo(-radius, 0);
  context.closePath();
}
