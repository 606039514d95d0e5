/** The map: coast and borders, and an own canvas with everything that moves. */

import OlMap from "ol/Map";
import View from "ol/View";
import type { FrameState } from "ol/Map";
import Layer from "ol/layer/Layer";
import VectorLayer from "ol/layer/Vector";
import VectorSource from "ol/source/Vector";
import GeoJSON from "ol/format/GeoJSON";
import { defaults as defaultControls } from "ol/control/defaults";
import { defaults as defaultInteractions } from "ol/interaction/defaults";
import Fill from "ol/style/Fill";
import Stroke from "ol/style/Stroke";
import Style from "ol/style/Style";
import { fromLonLat, toLonLat } from "ol/proj";
import { feature } from "topojson-client";
import type { GeometryCollection, Topology } from "topojson-specification";

import { unwrapped } from "./land";
import { PALETTES } from "./palette";
import { Pixels } from "./pixels";
import { Scene, type Layer as Drawn, type Plane } from "./scene";
import type { Encounters } from "../service/encounters";
import { AnswerError, readOnce, type Feed } from "../service/feed";
import { allLayers } from "../layers/index";
import type { Site } from "../layers/sites";
import { mercatorX, mercatorY, nearestX, scaleAt, together, WORLD_UNITS } from "./mercator";
import { Scans } from "../sky/scans";
import type { Selection } from "../service/selection";
import type { Store, Track } from "../sky/store";
import type { Clock } from "../time/clock";
import { presentOf, silentS, unheardS } from "../time/presence";
import { ZOOM_MAX, ZOOM_MIN, type ViewState } from "../view/view";

const PICK_PX = 14;
/** Time in which plots move between their measured and their corrected positions, ms. */
const SNAP_MS = 300;
/** Motion that is worth a drawing, pixels. */
const STEP_PX = 0.25;
const PLANES: readonly Plane[] = ["ground", "sweep", "moving"];

export class Picture {
  readonly map: OlMap;
  readonly scene: Scene;
  readonly layers;
  private readonly element = document.createElement("div");
  private readonly contexts: Record<Plane, CanvasRenderingContext2D>;
  private readonly byPlane: Record<Plane, Drawn[]>;
  readonly scans: Scans;
  private readonly pixels: Record<Plane, Pixels> = { ground: new Pixels(), sweep: new Pixels(), moving: new Pixels() };
  private readonly land: VectorLayer;
  /** Whether the user or the address chose the place. */
  private centred: boolean;
  /** How many of sites and tracks the page itself fitted the map to, and where it put it: they do not come together. */
  private fitted = 0;
  private fittedTo = "";
  /** Drawings of the moving plane, and processor time of all drawings, ms: for measurements. */
  drawn = 0;
  drawnMs = 0;
  /** When the first tracks were drawn, ms after the page was requested. */
  firstMs = 0;
  /** Draws each frame although nothing moved. */
  forced = false;
  /** What a click on the map does before it selects; true: nothing else. */
  clicked: ((coordinate: number[]) => boolean) | null = null;
  private stepMs = performance.now();
  /** State of the last drawings. */
  private ground = "";
  private touches = 0;
  private movingS = -Infinity;

  constructor(
    private readonly target: HTMLElement,
    private readonly store: Store,
    private readonly feed: Feed,
    private readonly view: ViewState,
    selection: Selection,
    private readonly encounters: Encounters,
    clock: Clock,
    select: (id: number | null, isOther: boolean) => void,
    moved: () => void,
  ) {
    this.scans = new Scans(store);
    this.layers = allLayers(encounters, this.scans);
    this.scene = new Scene(view, store, feed, selection);
    this.element.className = "picture";
    const made = PLANES.map((plane) => [plane, this.canvas(plane)] as const);
    this.contexts = Object.fromEntries(made) as Record<Plane, CanvasRenderingContext2D>;
    const drawn = PLANES.map((plane) => [plane, this.layers.layers.filter((one) => one.plane === plane)] as const);
    this.byPlane = Object.fromEntries(drawn) as Record<Plane, Drawn[]>;
    this.land = new VectorLayer({ source: new VectorSource(), updateWhileAnimating: true });
    const moving = new Layer({ render: (state) => this.render(state) });
    this.centred = view.centre !== null;
    this.scene.corrected = view.shown.biases ? 1 : 0;
    this.map = new OlMap({
      target,
      // The wheel zooms without a click before it.
      interactions: defaultInteractions({ onFocusOnly: false }),
      layers: [this.land, moving],
      controls: defaultControls({ attribution: false, rotate: false }),
      view: new View({
        center: fromLonLat(view.centre ?? [10, 50]),
        zoom: view.zoom ?? 5,
        enableRotation: false,
        minZoom: ZOOM_MIN,
        maxZoom: ZOOM_MAX,
      }),
    });
    this.map.on("click", (event) => {
      if (this.clicked?.(event.coordinate) !== true) select(...this.pick(event.pixel[0] ?? 0, event.pixel[1] ?? 0));
    });
    this.map.on("moveend", () => {
      const { center, zoom } = { center: this.map.getView().getCenter(), zoom: this.map.getView().getZoom() };
      if (center !== undefined) feed.area = areaOf(this.map.getView().calculateExtent());
      this.noteMoved();
      if (!this.centred || center === undefined) return;
      const [longitude, latitude] = toLonLat(center);
      view.centre = [longitude ?? 0, latitude ?? 0];
      view.zoom = zoom ?? null;
      moved();
    });
    this.theme();
    let isLandAsked = false;
    const draw = () => {
      this.centre();
      const now = performance.now();
      this.scene.unheardS = unheardS(feed, clock) ?? 0;
      this.scene.silentS = silentS(feed, clock);
      this.element.classList.toggle("lost", feed.isLost(now) || feed.isUnreachable || (clock.isLive && feed.silenceS !== null));
      this.element.classList.toggle("ended", clock.isLive && ["No data", "Delayed"].includes(presentOf(feed, now).word));
      this.draw(false);
      // The coast comes after the first tracks: reading it takes as long as drawing them.
      if (!isLandAsked && (this.store.frames > 0 || this.feed.problem !== "")) {
        isLandAsked = true;
        void this.loadLand();
      }
      requestAnimationFrame(draw);
    };
    requestAnimationFrame(draw);
  }

  /** Draw everything again: the user changed the view. */
  touch(): void {
    this.touches += 1;
  }

  /** 0: plots as measured, 1: without biases; between them while they move. */
  get corrected(): number {
    return this.scene.corrected;
  }

  /** Tracks on the canvas with their pixels. */
  get seenOnCanvas(): { id: number; x: number; y: number }[] {
    const { seen } = this.scene;
    return seen.tracks.slice(0, seen.length).map((one, at) => ({ id: one.id, x: seen.x[at] ?? 0, y: seen.y[at] ?? 0 }));
  }

  /** Apply the theme. */
  theme(): void {
    const palette = PALETTES[this.view.theme];
    this.scene.palette = palette;
    this.touch();
    document.documentElement.dataset["theme"] = this.view.theme;
    this.target.style.background = palette.background;
    this.land.setStyle(new Style({
      fill: new Fill({ color: palette.land }),
      stroke: new Stroke({ color: palette.border, width: 0.7 }),
    }));
  }

  /** Move the map so that a track is in its middle. */
  show(track: Track): void {
    this.goTo(this.store.placeOf(track, this.store.timeAt(performance.now())));
  }

  /** Move the map so that a point is in its middle. */
  goTo(point: [number, number]): void {
    this.centred = true;
    const [x, y] = point;
    this.map.getView().animate({ center: [nearestX(x, this.scene.middleX), y], duration: 250 });
  }

  /** Show the place that the view has, or everything. */
  goToView(): void {
    const { centre, zoom } = this.view;
    const shown = this.map.getView();
    shown.cancelAnimations();
    if (centre === null) return this.fit();
    this.centred = true;
    shown.setCenter(fromLonLat(centre));
    if (zoom !== null) shown.setZoom(zoom);
  }

  /** Latitude of the middle of the map, degrees. */
  get latitude(): number {
    return toLonLat(this.map.getView().getCenter() ?? [0, 0])[1] ?? 0;
  }

  /** Zoom to so many pixels per metre. */
  zoomTo(perMetre: number): void {
    this.centred = true;
    this.map.getView().setResolution(scaleAt(this.latitude) / perMetre);
    this.touch();
  }

  /** Whether a track lies in the part of the world that the map shows. */
  contains(track: Track): boolean {
    const { scene } = this;
    const [x, y] = this.store.placeOf(track, this.store.dataTimeS ?? NaN);
    return scene.isInside(scene.px(x), scene.py(y), 0);
  }

  /** Show all sensors and tracks. */
  fit(): void {
    const points = this.store.tracks.map((one): [number, number] => [one.x, one.y]);
    const [west, south, east, north] = this.feed.extent ?? [];
    if (west !== undefined && south !== undefined && east !== undefined && north !== undefined) {
      points.push([mercatorX(west), mercatorY(south)], [mercatorX(east), mercatorY(north)]);
    }
    const isEmpty = points.length === 0;
    for (const { x, y, rings } of this.sites()) {
      points.push([x, y]);
      // Without aircraft, what a radar covers; a site alone has no extent.
      const [ring] = isEmpty ? rings : [];
      for (let at = 0; at < (ring?.length ?? 0); at += 2) points.push([ring?.[at] ?? x, ring?.[at + 1] ?? y]);
    }
    if (points.length === 0) return;
    const [xs, ys] = [together(points.map((one) => one[0])), points.map((one) => one[1])];
    this.centred = true;
    this.map.getView().fit([Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)], {
      padding: [40, 40, 40, 40],
      maxZoom: 10,
    });
  }

  private centre(): void {
    const there = Number(this.sites().length > 0) + Number(this.store.tracks.length > 0);
    // It may have been moved in this frame: no event has said so yet.
    this.noteMoved();
    if (this.centred || there <= this.fitted) return;
    this.fit();
    [this.centred, this.fitted, this.fittedTo] = [there === 2, there, this.place()];
  }

  /** The user's place is kept: the page does not fit the map any more. */
  private noteMoved(): void {
    if (this.fitted > 0 && this.place() !== this.fittedTo) this.centred = true;
  }

  private place(): string {
    const view = this.map.getView();
    return `${view.getCenter()?.join()} ${view.getZoom()}`;
  }

  private async loadLand(): Promise<void> {
    const topology = await readOnce(async () => {
      const answer = await fetch("page/land.json");
      if (!answer.ok) throw new AnswerError(answer.status, "no coastlines");
      return (await answer.json()) as Topology;
    });
    const countries = topology.objects["countries"];
    if (countries === undefined) return;
    const features = new GeoJSON().readFeatures(unwrapped(feature(topology, countries as GeometryCollection)), {
      featureProjection: "EPSG:3857",
    });
    this.land.getSource()?.addFeatures(features);
  }

  private sites(): Site[] {
    return this.layers.sites.all(this.scene);
  }

  /** The track at a pixel, and whether it is one of the run for comparison. */
  private pick(x: number, y: number): [number | null, boolean] {
    let best: [number | null, boolean] = [null, false];
    let least = PICK_PX;
    for (const [seen, isOther] of [[this.scene.seen, false], [this.scene.seenSecond, true]] as const) {
      for (let at = 0; at < seen.length; at++) {
        const far = Math.hypot((seen.x[at] ?? 0) - x, (seen.y[at] ?? 0) - y);
        if (far < least) [best, least] = [[seen.tracks[at]?.id ?? null, isOther], far];
      }
    }
    return best;
  }

  private canvas(plane: Plane): CanvasRenderingContext2D {
    const canvas = document.createElement("canvas");
    canvas.className = plane;
    this.element.append(canvas);
    const context = canvas.getContext("2d");
    if (context === null) throw new Error("this browser does not support canvas");
    return context;
  }

  /** The map moved: take its place, and draw. */
  private render(state: FrameState): HTMLElement {
    const { scene } = this;
    [scene.width, scene.height] = [state.size[0] ?? 0, state.size[1] ?? 0];
    scene.ratio = state.pixelRatio;
    const zoom = this.target.querySelector<HTMLElement>(".ol-zoom");
    if (zoom !== null) [scene.controlX, scene.controlY] = [zoom.offsetLeft + zoom.offsetWidth, zoom.offsetTop + zoom.offsetHeight];
    const t = state.coordinateToPixelTransform;
    [scene.a, scene.d, scene.e, scene.f] = [t[0] ?? 1, t[3] ?? -1, t[4] ?? 0, t[5] ?? 0];
    scene.middleX = (scene.width / 2 - scene.e) / scene.a;
    const [width, height] = [Math.round(scene.width * scene.ratio), Math.round(scene.height * scene.ratio)];
    for (const plane of PLANES) {
      const { canvas } = this.contexts[plane];
      if (canvas.width === width && canvas.height === height) continue;
      canvas.width = width;
      canvas.height = height;
      canvas.style.width = `${scene.width}px`;
      canvas.style.height = `${scene.height}px`;
    }
    this.draw(true);
    return this.element;
  }

  /** Draw the planes on which something changed, or all. */
  private draw(all: boolean): void {
    const { scene, store } = this;
    const now = performance.now();
    const towards = this.view.shown.biases ? 1 : -1;
    scene.corrected = Math.max(0, Math.min(1, scene.corrected + (towards * (now - this.stepMs)) / SNAP_MS));
    this.stepMs = now;
    if (scene.width === 0) return;
    scene.timeS = store.timeAt(now);
    const ground = `${store.frames} ${this.feed.second.frames} ${this.feed.revision} ${scene.selection.revision} ${this.touches} ${this.encounters.revision} ${scene.corrected}`;
    const changed = all || ground !== this.ground;
    this.ground = ground;
    if (changed) this.scans.update(this.feed.sensors);
    this.turn(changed);
    if (changed) this.drawPlane("ground");
    const moved = store.fastest * scene.a * Math.abs(scene.timeS - this.movingS);
    if (changed || this.forced || !(moved < STEP_PX)) {
      this.movingS = scene.timeS;
      this.drawPlane("moving");
      this.drawn += 1;
      if (this.firstMs === 0 && scene.seen.length > 0) this.firstMs = performance.now();
    }
    this.drawnMs += performance.now() - now;
  }

  /** Draw the beams while one turns, and once after the last stood still. */
  private turn(changed: boolean): void {
    const moves = this.layers.sweeps.moves(this.scene);
    if (changed || moves || this.layers.sweeps.drawn.length > 0) this.drawPlane("sweep");
  }

  private drawPlane(plane: Plane): void {
    const { scene } = this;
    const context = this.contexts[plane];
    const pixels = this.pixels[plane];
    const marks = this.layers.pixels.filter((one) => one.plane === plane);
    if (marks.length > 0) {
      pixels.begin(context, scene.ratio);
      for (const layer of marks) layer.paint(scene, pixels);
      pixels.put(context);
    } else {
      context.clearRect(0, 0, scene.width, scene.height);
    }
    context.setTransform(scene.ratio, 0, 0, scene.ratio, 0, 0);
    scene.context = context;
    for (const layer of this.byPlane[plane]) layer.draw(scene);
  }
}

/** An extent of the map with a margin, in whole steps of its size: pages with similar views share frames. */
function areaOf(extent: number[]): string {
  const [west, south] = toLonLat([extent[0] ?? 0, extent[1] ?? 0]) as [number, number];
  const [east, north] = toLonLat([extent[2] ?? 0, extent[3] ?? 0]) as [number, number];
  // Across the antimeridian, west is the greater longitude.
  const width = east - west + (east < west ? 360 : 0);
  const step = 2 ** Math.ceil(Math.log2(Math.max(width, north - south) / 4));
  const isWorld = (extent[2] ?? 0) - (extent[0] ?? 0) > WORLD_UNITS || !(width > 0) || (east < west && width + 2 * step > 360);
  if (isWorld) return "-180,-90,180,90";
  const down = (value: number) => Math.floor(value / step) * step;
  const corners = [down(west), down(south), down(east) + step, down(north) + step];
  return corners.map((one, at) => {
    const limit = at % 2 === 0 ? 180 : 90;
    return Math.max(-limit, Math.min(limit, one));
  }).join(",");
}
