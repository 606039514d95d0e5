/** Bars around zero, one for each interval, with twice the standard error of their mean: inline SVG. */

import { svg, html, type TemplateResult } from "lit";

export interface Bar {
  /** Where it begins. */
  name: string;
  mean: number;
  /** Standard error of the mean. */
  error: number;
  count: number;
}

const [WIDTH, HEIGHT, LEFT, BOTTOM] = [190, 76, 36, 14];
/** Width of a letter, and room between names; each begins at its bar. */
const [LETTER, GAP] = [6.2, 8];

export function bars(label: string, unit: string, shown: readonly Bar[], digits: number): TemplateResult {
  const most = Math.max(1e-9, ...shown.map((one) => Math.abs(one.mean) + 2 * one.error));
  const middle = (HEIGHT - BOTTOM) / 2;
  const y = (value: number): number => middle - (value / most) * (middle - 8);
  const step = (WIDTH - LEFT) / Math.max(shown.length, 1);
  const worst = shown.reduce<Bar | null>((a, b) => (Math.abs(b.mean) > Math.abs(a?.mean ?? 0) ? b : a), null);
  const room = LETTER * Math.max(0, ...shown.map((one) => one.name.length)) + GAP;
  const every = Math.max(1, Math.ceil(room / step));
  const text = worst === null ? "no plots" : `largest mean ${worst.mean.toFixed(digits)} ${unit} at ${worst.name}`;
  return html`<figure><figcaption>${label}, ${unit}</figcaption>
    <svg class="bars" viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img" aria-label="${label}: ${text}">
      <line class="axis" x1=${LEFT} x2=${WIDTH} y1=${middle} y2=${middle}></line>
      <text x=${LEFT - 4} y=${y(most) + 6} text-anchor="end">${most.toFixed(digits)}</text>
      <text x=${LEFT - 4} y=${y(-most) + 3} text-anchor="end">${(-most).toFixed(digits)}</text>
      ${shown.map((one, at) => bar(one, LEFT + at * step, step, y, at % every === 0 && LEFT + at * step + room - GAP <= WIDTH, digits, unit))}
    </svg></figure>`;
}

function bar(one: Bar, x: number, step: number, y: (value: number) => number, named: boolean, digits: number, unit: string): TemplateResult {
  const [top, bottom] = [Math.min(y(one.mean), y(0)), Math.max(y(one.mean), y(0))];
  const centre = x + step / 2;
  if (one.count === 0) return svg`<g>${named ? svg`<text x=${x} y=${HEIGHT - 3}>${one.name}</text>` : ""}</g>`;
  // A mean within two standard errors of zero is nothing to look at.
  const notable = Math.abs(one.mean) > 2 * one.error;
  return svg`<g class=${notable ? "notable" : ""}><title>${one.name}: ${one.mean.toFixed(digits)} ± ${(2 * one.error).toFixed(digits)} ${unit}, ${one.count} plots</title>
    <rect x=${x + 1} y=${top} width=${Math.max(1, step - 2)} height=${Math.max(0.5, bottom - top)}></rect>
    <line class="error" x1=${centre} x2=${centre} y1=${y(one.mean + 2 * one.error)} y2=${y(one.mean - 2 * one.error)}></line>
    ${named ? svg`<text x=${x} y=${HEIGHT - 3}>${one.name}</text>` : ""}</g>`;
}
