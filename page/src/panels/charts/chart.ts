/** Curves over time: `<mr-chart>`, drawn by uPlot and made again when the theme or its curves change. */

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

import { markPath } from "../../drawing/marks";

export interface Curve {
  label: string;
  /** Name of a custom property of the page, or a colour. */
  colour: string;
  values: ArrayLike<number | null>;
  /** Marks without a line; its form distinguishes the curves, not only the colour. */
  mark?: number;
  dash?: number[];
  /** An end of a filled band: the upper one, and the lower one as the next curve. */
  band?: boolean;
}

export interface ChartData {
  /** What it shows, for those who do not see it. */
  label: string;
  unit: string;
  /** Seconds UTC, ascending. */
  times: ArrayLike<number>;
  curves: Curve[];
  /** The axis spans at least so much. */
  spanMin?: number;
  /** A line at zero. */
  zero?: boolean;
  digits?: number;
}

const HEIGHT_PX = 120;

export class ChartElement extends HTMLElement {
  private plot: uPlot | null = null;
  private kind = "";
  private latest: ChartData | null = null;
  private readonly observer = new ResizeObserver(() => this.resize());

  set data(data: ChartData) {
    this.latest = data;
    this.update();
  }

  connectedCallback(): void {
    this.observer.observe(this);
    this.update();
  }

  disconnectedCallback(): void {
    this.observer.disconnect();
    this.plot?.destroy();
    this.plot = null;
    this.kind = "";
  }

  private resize(): void {
    if (this.plot !== null && this.clientWidth > 0) this.plot.setSize({ width: this.clientWidth, height: HEIGHT_PX });
    else this.update();
  }

  private update(): void {
    const data = this.latest;
    if (data === null || !this.isConnected || this.clientWidth === 0) return;
    this.setAttribute("role", "img");
    this.setAttribute("aria-label", describe(data));
    const values = [data.times, ...data.curves.map((curve) => curve.values)] as unknown as uPlot.AlignedData;
    const curves = data.curves.map((one) => `${one.label} ${one.colour} ${one.mark}`).join();
    const kind = `${document.documentElement.dataset["theme"]} ${data.unit} ${curves}`;
    if (this.plot !== null && kind === this.kind) {
      this.plot.setData(values);
      return;
    }
    this.plot?.destroy();
    this.kind = kind;
    this.plot = new uPlot(options(data, this.clientWidth), values, this);
  }
}

customElements.define("mr-chart", ChartElement);

function options(data: ChartData, width: number): uPlot.Options {
  const [text, line] = [colourOf("--soft"), colourOf("--line")];
  const axis = { stroke: text, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 }, font: "11px system-ui, sans-serif" };
  return {
    width,
    height: HEIGHT_PX,
    tzDate: (seconds) => uPlot.tzDate(new Date(seconds * 1000), "Etc/UTC"),
    legend: { show: false },
    cursor: { show: false },
    padding: [8, 20, 0, 0],
    axes: [
      { ...axis, size: 26, space: 80, values: (_, splits) => splits.map(clock) },
      { ...axis, size: 56, space: 28, values: (_, splits, __, ___, step) => splits.map((one) => one.toFixed(decimals(step))) },
    ],
    scales: { x: { time: true }, y: { range: (_, low, high) => range(low, high, data) } },
    series: [{}, ...data.curves.map(series)],
    bands: data.curves.flatMap((curve, at): uPlot.Band[] =>
      curve.band === true && data.curves[at + 1]?.band === true ? [{ series: [at + 1, at + 2], fill: faded(colourOf(curve.colour)) }] : []),
    hooks: data.zero === true ? { drawAxes: [(plot) => zeroLine(plot, text)] } : {},
  };
}

function series(curve: Curve): uPlot.Series {
  const colour = colourOf(curve.colour);
  if (curve.mark === undefined) {
    return { stroke: colour, width: curve.band === true ? 0 : 1.5, points: { show: false }, spanGaps: true, ...(curve.dash ? { dash: curve.dash } : {}) };
  }
  const { mark } = curve;
  return { stroke: colour, paths: () => null, points: { show: true, paths: (plot, at) => marks(plot, at, mark), stroke: colour, width: 1.2 } };
}

/** The marks of a sensor's values: as on the map. */
function marks(plot: uPlot, at: number, mark: number): { stroke: Path2D } {
  const [path, form] = [new Path2D(), new Path2D(markPath(mark))];
  const size = 3 * devicePixelRatio;
  const [times, values] = [plot.data[0], plot.data[at] ?? []];
  times.forEach((time, row) => {
    const value = values[row];
    if (value === null || value === undefined) return;
    const [x, y] = [plot.valToPos(time, "x", true), plot.valToPos(value, "y", true)];
    path.addPath(form, new DOMMatrix([size, 0, 0, size, x, y]));
  });
  return { stroke: path };
}

function zeroLine(plot: uPlot, colour: string): void {
  const y = Math.round(plot.valToPos(0, "y", true)) + 0.5;
  const { ctx, bbox } = plot;
  if (y < bbox.top || y > bbox.top + bbox.height) return;
  ctx.save();
  ctx.strokeStyle = colour;
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.restore();
}

function range(low: number | null, high: number | null, { zero, spanMin = 0 }: ChartData): [number, number] {
  let [from, to] = [low ?? 0, high ?? 1];
  if (zero === true) [from, to] = [Math.min(from, 0), Math.max(to, 0)];
  const missing = Math.max(0, spanMin - (to - from)) / 2;
  [from, to] = [from - missing, to + missing];
  const margin = Math.max((to - from) * 0.08, Math.abs(to) * 1e-3, 1e-6);
  return [from - margin, to + margin];
}

/** Digits after the point of numbers so far apart. */
function decimals(step: number): number {
  return Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
}

/** The text of an axis: minutes, with seconds where the axis is finer. */
function clock(seconds: number): string {
  const text = new Date(seconds * 1000).toISOString();
  return seconds % 60 === 0 ? text.slice(11, 16) : text.slice(11, 19);
}

function describe({ label, unit, curves, digits = 0 }: ChartData): string {
  const parts = curves.flatMap((curve) => {
    const known = Array.from(curve.values).filter((one): one is number => typeof one === "number" && Number.isFinite(one));
    if (known.length === 0 || curve.band === true) return [];
    const last = known[known.length - 1] ?? NaN;
    return [`${curve.label} ${Math.min(...known).toFixed(digits)} to ${Math.max(...known).toFixed(digits)}, last ${last.toFixed(digits)} ${unit}`];
  });
  return `${label}: ${parts.join("; ") || "no values"}`;
}

function colourOf(name: string): string {
  return name.startsWith("--") ? getComputedStyle(document.documentElement).getPropertyValue(name).trim() : name;
}

function faded(colour: string): string {
  return /^#[0-9a-f]{6}$/i.test(colour) ? `${colour}38` : colour;
}
