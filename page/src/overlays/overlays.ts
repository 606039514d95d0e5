/** The user's own GeoJSON on the map. The service names the files by number; a wrong one is named here. */

import type OlMap from "ol/Map";
import VectorLayer from "ol/layer/Vector";
import VectorSource from "ol/source/Vector";
import GeoJSON from "ol/format/GeoJSON";
import CircleStyle from "ol/style/Circle";
import Fill from "ol/style/Fill";
import Stroke from "ol/style/Stroke";
import Style from "ol/style/Style";
import Text from "ol/style/Text";

import { get } from "../service/feed";
import type { ViewState } from "../view/view";

const COLOURS = { dark: "#9ec1ff", light: "#1d3f8a" } as const;
/** Names are drawn from this zoom on. */
const NAMES_FROM = 6;
/** The land is below. */
const ABOVE_LAND = 1;

export interface Overlay {
  number: number;
  name: string;
  features: number;
  /** Why it is not shown; empty where it is. */
  problem: string;
}

export class Overlays {
  listed: Overlay[] = [];
  private readonly layers = new Map<number, VectorLayer>();

  constructor(
    private readonly map: OlMap,
    private readonly view: ViewState,
    private readonly changed: () => void,
  ) {}

  /** Read the list and the files; without a service the feed announces it. */
  async load(): Promise<void> {
    try {
      const list = (await (await get("v1/overlays")).json()) as { overlays: Overlay[] };
      this.listed = list.overlays;
    } catch {
      return;
    }
    for (const one of this.listed) {
      if (one.problem !== "") continue;
      try {
        this.add(one, await (await get(`v1/overlays/${one.number}`)).json());
      } catch (error) {
        one.problem = error instanceof Error ? error.message : String(error);
      }
    }
    this.apply();
  }

  /** Show what is switched on, in the colours of the theme. */
  apply(): void {
    for (const one of this.listed) this.layers.get(one.number)?.setVisible(!this.view.hidden.has(keyOf(one)));
    for (const layer of this.layers.values()) layer.changed();
    this.changed();
  }

  private add(overlay: Overlay, document: unknown): void {
    const features = new GeoJSON().readFeatures(document, { featureProjection: "EPSG:3857" });
    const layer = new VectorLayer({ source: new VectorSource({ features }), declutter: true, style: (feature, resolution) => {
      const colour = COLOURS[this.view.theme];
      const named = feature.get("name") as unknown;
      const zoom = Math.log2(156543.03 / resolution);
      return new Style({
        stroke: new Stroke({ color: colour, width: 1.2 }),
        fill: new Fill({ color: `${colour}14` }),
        image: new CircleStyle({ radius: 3, stroke: new Stroke({ color: colour, width: 1.5 }) }),
        ...(typeof named === "string" && zoom >= NAMES_FROM
          ? { text: new Text({ text: named, font: "11px sans-serif", overflow: true, offsetY: -8, fill: new Fill({ color: colour }) }) }
          : {}),
      });
    } });
    this.layers.set(overlay.number, layer);
    this.map.getLayers().insertAt(ABOVE_LAND, layer);
  }
}

/** The name of an overlay among what is hidden. */
export function keyOf(overlay: Overlay): string {
  return `o${overlay.number}`;
}
