/** Names of the user's own GeoJSON: where they find room, and labels of tracks leave it free. */

import { FONT } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import { touches } from "../layers/sites";
import { OVERLAY_COLOURS } from "./overlays";

/** Names are drawn from this zoom on, at most so many. */
const NAMES_FROM = 6;
const NAMES_MAX = 200;
const LETTER_PX = 6.7;
const HEIGHT_PX = 13;
/** Above the place, pixels. */
const ABOVE_PX = 4;
/** Map units per pixel at zoom 0. */
const WHOLE_UNITS = 156543.03;

export interface NamedPlace {
  name: string;
  x: number;
  y: number;
}

export class OverlayNames implements Layer {
  readonly plane = "ground";
  /** Of the overlays that are shown. */
  places: NamedPlace[] = [];
  /** Names on the canvas, for tests. */
  drawn: string[] = [];

  draw(scene: Scene): void {
    const { context, view } = scene;
    this.drawn.length = 0;
    if (Math.log2(WHOLE_UNITS * scene.a) < NAMES_FROM) return;
    context.font = `11px ${FONT}`;
    context.fillStyle = OVERLAY_COLOURS[view.theme];
    for (const { name, x, y } of this.places) {
      if (this.drawn.length === NAMES_MAX) return;
      const width = LETTER_PX * name.length + 4;
      const [left, bottom] = [Math.round(scene.px(x) - width / 2), Math.round(scene.py(y)) - ABOVE_PX];
      const top = bottom - HEIGHT_PX;
      if (!scene.isInside(left, top, width) || touches(scene.reserved, left, top, width, HEIGHT_PX)) continue;
      context.fillText(name, left + 2, bottom - 3);
      scene.reserved.push(left, top, width, HEIGHT_PX);
      this.drawn.push(name);
    }
  }
}
