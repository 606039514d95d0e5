/** The map: coast and borders, and an own canvas with everything that moves. */

import OlMap from "ol/Map";
import View from "ol/View";
import type { FrameState } from "ol/Map";
import Layer from "ol/layer/Layer";
import VectorLayer from "ol/layer/Vector";
import VectorSource from "ol/source/Vector";
import GeoJSON from "ol/format/GeoJSON";
import { defaults as defaultControls } from "ol/control/defaults";
import Fill from "ol/style/Fill";
import Stroke from "ol/style/Stroke";
import Style from "ol/style/Style";
import { fromLonLat, toLonLat } from "ol/proj";
import { feature } from "topojson-client";
import type { Topology } from "topojson-specification";

import type { Feed } from "./feed";
import { Drawing, PALETTES, type SitePlace } from "./drawing";
import { Labels } from "./labels";
import { mercatorX, mercatorY } from "./mercator";
import type { Selection } from "./selection";
import type { Store, Track } from "./store";
import type { ViewState } from "./view";

const PICK_PX = 14;
/** Time in which plots move between their measured and their corrected positions, ms. */
const SNAP_MS = 400;

export class Picture {
  readonly map: OlMap;
  private readonly canvas = document.createElement("canvas");
  private readonly labels = new Labels();
  private readonly land: VectorLayer;
  private readonly seenOnCanvas: { id: number; x: number; y: number }[] = [];
  private centred: boolean;
  /** Frames drawn, for measurements. */
  drawn = 0;
  /** 0: plots as measured, 1: without biases; between them while they move. */
  private corrected: number;
  private stepMs = performance.now();

  constructor(
    private readonly target: HTMLElement,
    private readonly store: Store,
    private readonly feed: Feed,
    private readonly view: ViewState,
    private readonly selection: Selection,
    select: (id: number | null) => void,
    moved: () => void,
  ) {
    this.canvas.className = "picture";
    this.land = new VectorLayer({ source: new VectorSource(), updateWhileAnimating: true });
    const moving = new Layer({ render: (state) => this.render(state) });
    this.centred = view.centre !== null;
    this.corrected = view.shown.biases ? 1 : 0;
    this.map = new OlMap({
      target,
      layers: [this.land, moving],
      controls: defaultControls({ attribution: false, rotate: false }),
      view: new View({
        center: fromLonLat(view.centre ?? [10, 50]),
        zoom: view.zoom ?? 5,
        enableRotation: false,
        minZoom: 2,
        maxZoom: 18,
      }),
    });
    this.map.on("click", (event) => select(this.pick(event.pixel[0] ?? 0, event.pixel[1] ?? 0)));
    this.map.on("moveend", () => {
      const { center, zoom } = { center: this.map.getView().getCenter(), zoom: this.map.getView().getZoom() };
      if (!this.centred || center === undefined) return;
      const [longitude, latitude] = toLonLat(center);
      view.centre = [longitude ?? 0, latitude ?? 0];
      view.zoom = zoom ?? null;
      moved();
    });
    this.theme();
    void this.loadLand();
    const draw = () => {
      this.centre();
      this.map.render();
      requestAnimationFrame(draw);
    };
    requestAnimationFrame(draw);
  }

  /** Apply the theme. */
  theme(): void {
    const palette = PALETTES[this.view.theme];
    document.documentElement.dataset["theme"] = this.view.theme;
    this.target.style.background = palette.background;
    this.land.setStyle(new Style({
      fill: new Fill({ color: palette.land }),
      stroke: new Stroke({ color: palette.border, width: 0.7 }),
    }));
  }

  /** Move the map so that a track is in its middle. */
  show(track: Track): void {
    this.centred = true;
    this.map.getView().animate({ center: [track.x, track.y], duration: 250 });
  }

  /** Show all sensors and tracks. */
  fit(): void {
    const points = [
      ...this.sites().map((one) => [one.x, one.y] as const),
      ...this.store.tracks.map((one) => [one.x, one.y] as const),
    ];
    if (points.length === 0) return;
    const [xs, ys] = [points.map((one) => one[0]), points.map((one) => one[1])];
    this.centred = true;
    this.map.getView().fit([Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)], {
      padding: [40, 40, 40, 40],
      maxZoom: 10,
    });
  }

  private centre(): void {
    if (!this.centred && this.sites().length + this.store.tracks.length > 0) this.fit();
  }

  private async loadLand(): Promise<void> {
    const topology = (await (await fetch("page/land.json")).json()) as Topology;
    const countries = topology.objects["countries"];
    if (countries === undefined) return;
    const features = new GeoJSON().readFeatures(feature(topology, countries), {
      featureProjection: "EPSG:3857",
    });
    this.land.getSource()?.addFeatures(features);
  }

  private sites(): SitePlace[] {
    return this.feed.sensors.flatMap((sensor) =>
      sensor.latitude_deg === null || sensor.longitude_deg === null || sensor.kind !== "radar"
        ? []
        : [{
            x: mercatorX(sensor.longitude_deg),
            y: mercatorY(sensor.latitude_deg),
            sensor,
            number: this.store.sensors.indexOf(sensor.id),
          }],
    );
  }

  private pick(x: number, y: number): number | null {
    let best: number | null = null;
    let least = PICK_PX;
    for (const one of this.seenOnCanvas) {
      const far = Math.hypot(one.x - x, one.y - y);
      if (far < least) [best, least] = [one.id, far];
    }
    return best;
  }

  private render(state: FrameState): HTMLElement {
    const [width, height] = [state.size[0] ?? 0, state.size[1] ?? 0];
    const ratio = state.pixelRatio;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
      this.canvas.style.width = `${width}px`;
      this.canvas.style.height = `${height}px`;
    }
    const context = this.canvas.getContext("2d");
    if (context === null) return this.canvas;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const t = state.coordinateToPixelTransform;
    const [a, , , d, e, f] = [t[0] ?? 1, 0, 0, t[3] ?? -1, t[4] ?? 0, t[5] ?? 0];
    const now = performance.now();
    const towards = this.view.shown.biases ? 1 : -1;
    this.corrected = Math.max(0, Math.min(1, this.corrected + (towards * (now - this.stepMs)) / SNAP_MS));
    this.stepMs = now;
    new Drawing(context, { a, d, e, f, width, height }, PALETTES[this.view.theme], this.view, this.store)
      .all(this.sites(), this.labels, this.seenOnCanvas, this.selection, this.corrected);
    this.drawn += 1;
    return this.canvas;
  }
}
