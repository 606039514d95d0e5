/** The trajectory set of the selected track: how it may have flown, with weights, and where it may be. */

import { FONT } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import type { PastPoint } from "../service/selection";

const DASH = [5, 3];
const CROSS_PX = 3;
/** Opacity of a possible position: at least, and of the heaviest. */
const OPACITY_MIN = 0.2;
/** Hypotheses in the text, those of at least this weight. */
const LINES_MAX = 4;
const WEIGHT_MIN = 0.03;
const LINE_PX = 13;
const TEXT_PX = 26;
const LETTER_PX = 6.7;

/** Turns in words; other motions are called as the service does. */
const KINDS: Record<string, string> = { left: "left turn", right: "right turn" };

export class BundleLayer implements Layer {
  readonly plane = "ground";
  /** The text on the canvas, for tests. */
  lines: string[] = [];

  draw(scene: Scene): void {
    const { context, palette, selection, view } = scene;
    const { bundle } = selection;
    this.lines = [];
    if (bundle === null || !view.shown.trajectories) return;
    context.strokeStyle = palette.bundle;
    context.fillStyle = palette.bundle;
    context.lineWidth = 1;
    path(scene, bundle.best);
    context.setLineDash(DASH);
    path(scene, bundle.weighted);
    context.setLineDash([]);
    for (const member of bundle.members) {
      const [x, y] = [Math.round(scene.px(member.x)), Math.round(scene.py(member.y))];
      context.globalAlpha = Math.min(1, OPACITY_MIN + member.weight);
      context.fillRect(x - CROSS_PX, y, 2 * CROSS_PX + 1, 1);
      context.fillRect(x, y - CROSS_PX, 1, 2 * CROSS_PX + 1);
    }
    context.globalAlpha = 1;
    const last = bundle.best[bundle.best.length - 1];
    if (last === undefined) return;
    this.lines = bundle.hypotheses.filter((one) => one.weight >= WEIGHT_MIN).slice(0, LINES_MAX).map(
      ({ weight, kind, sinceS }) => `${Math.round(100 * weight)} % ${KINDS[kind] ?? kind} for ${Math.round(last.timeS - sinceS)} s`,
    );
    context.font = `11px ${FONT}`;
    const [x, y] = [Math.round(scene.px(last.x)) + TEXT_PX, Math.round(scene.py(last.y)) + TEXT_PX];
    this.lines.forEach((line, number) => context.fillText(line, x, y + LINE_PX * number));
    const width = LETTER_PX * Math.max(0, ...this.lines.map((line) => line.length));
    if (width > 0) scene.reserved.push(x - 2, y - LINE_PX, width + 4, LINE_PX * this.lines.length + 4);
  }
}

function path(scene: Scene, points: PastPoint[]): void {
  scene.context.beginPath();
  for (const point of points) scene.context.lineTo(scene.px(point.x), scene.py(point.y));
  scene.context.stroke();
}
