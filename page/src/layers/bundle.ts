/** The trajectory set of the selected track: how it may have flown, with weights, and where it may be. */

import { FONT } from "../drawing/palette";
import type { Layer, Scene } from "../drawing/scene";
import type { PastPoint } from "../service/selection";
import { touches } from "./sites";

const DASH = [5, 3];
const CROSS_PX = 3;
/** Opacity of a possible position: at least, and of the heaviest. */
const OPACITY_MIN = 0.2;
/** Hypotheses in the text, those of at least this weight. */
const LINES_MAX = 4;
const WEIGHT_MIN = 0.03;
const LINE_PX = 13;
/** Distances of the text from the track: the next one if there is no room. */
const FAR_PX = [26, 52, 78, 104];
const LETTER_PX = 6.7;

/** Turns in words; other motions are called as the service does. */
const KINDS: Record<string, string> = { left: "left turn", right: "right turn" };

type Box = [number, number, number, number];

export class BundleLayer implements Layer {
  readonly plane = "ground";
  /** The text on the canvas, for tests. */
  lines: string[] = [];
  /** Where it stands: left, top, width, height. */
  box: Box = [0, 0, 0, 0];

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
    const width = LETTER_PX * Math.max(0, ...this.lines.map((line) => line.length)) + 4;
    this.box = placed(scene, scene.px(last.x), scene.py(last.y), width, LINE_PX * this.lines.length + 4);
    const [left, top] = this.box;
    this.lines.forEach((line, number) => context.fillText(line, left + 2, top + LINE_PX * (number + 1)));
    if (this.lines.length > 0) scene.reserved.push(...this.box);
  }
}

/** Where a text around a point covers no other: near it if possible. */
function placed(scene: Scene, x: number, y: number, width: number, height: number): Box {
  const boxes = FAR_PX.flatMap((far) => [[1, 1], [1, -1], [-1, 1], [-1, -1]].map(([right, down]): Box => [
    Math.round(right === 1 ? x + far : x - far - width), Math.round(down === 1 ? y + far - LINE_PX : y - far - height), width, height,
  ]));
  return boxes.find((one) => !touches(scene.reserved, ...one)) ?? boxes[0] ?? [x, y, width, height];
}

function path(scene: Scene, points: PastPoint[]): void {
  scene.context.beginPath();
  for (const point of points) scene.context.lineTo(scene.px(point.x), scene.py(point.y));
  scene.context.stroke();
}
