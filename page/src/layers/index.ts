/** The layers of the map, from below; a new one is a line here. */

import type { Layer, PixelLayer } from "../drawing/scene";
import { LabelsLayer } from "./labels";
import { PlotsLayer } from "./plots";
import { ForecastLayer, PastLayer } from "./selected";
import { Sites, SitesLayer } from "./sites";
import { SeenLayer, SelectedLayer, SymbolsLayer, UncertaintyLayer, VectorsLayer } from "./tracks";
import { TrailsLayer } from "./trails";

export interface Layers {
  sites: Sites;
  labels: LabelsLayer;
  /** Written into the image under the other layers of their plane. */
  pixels: PixelLayer[];
  layers: Layer[];
}

export function allLayers(): Layers {
  const [sites, labels] = [new Sites(), new LabelsLayer()];
  return {
    sites,
    labels,
    pixels: [new TrailsLayer(), new PlotsLayer(), new SeenLayer(), new SymbolsLayer()],
    layers: [
      new SitesLayer(sites),
      new PastLayer(),
      new ForecastLayer(),
      new UncertaintyLayer(),
      new VectorsLayer(),
      new SelectedLayer(),
      labels,
    ],
  };
}
