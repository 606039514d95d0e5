/** The layers of the map, from below; a new one is a line here. */

import type { Layer, PixelLayer } from "../drawing/scene";
import type { Encounters } from "../service/encounters";
import type { Scans } from "../sky/scans";
import { SecondRun, SecondTrails } from "../time/second";
import { OverlayNames } from "../overlays/names";
import { Measure } from "../measure/measure";
import { BearingsLayer } from "./bearings";
import { BundleLayer } from "./bundle";
import { EncountersLayer } from "./encounters";
import { JoinedLayer } from "./joined";
import { LabelsLayer } from "./labels";
import { PlotsLayer } from "./plots";
import { ForecastLayer, PastLayer } from "./selected";
import { Sites, SitesLayer } from "./sites";
import { SweepsLayer } from "./sweeps";
import { SeenLayer, SelectedLayer, SymbolsLayer, UncertaintyLayer, VectorsLayer } from "./tracks";
import { TrailsLayer } from "./trails";

export interface Layers {
  measure: Measure;
  sites: Sites;
  labels: LabelsLayer;
  encounters: EncountersLayer;
  sweeps: SweepsLayer;
  bearings: BearingsLayer;
  bundle: BundleLayer;
  forecast: ForecastLayer;
  joined: JoinedLayer;
  overlayNames: OverlayNames;
  /** Written into the image under the other layers of their plane. */
  pixels: PixelLayer[];
  layers: Layer[];
}

export function allLayers(pairs: Encounters, scans: Scans): Layers {
  const [sites, labels] = [new Sites(), new LabelsLayer(pairs)];
  const [encounters, sweeps] = [new EncountersLayer(pairs), new SweepsLayer(sites, scans)];
  const [bundle, forecast] = [new BundleLayer(), new ForecastLayer()];
  const [measure, joined, overlayNames] = [new Measure(), new JoinedLayer(), new OverlayNames()];
  const bearings = new BearingsLayer();
  return {
    measure,
    sites,
    labels,
    encounters,
    sweeps,
    bearings,
    bundle,
    forecast,
    joined,
    overlayNames,
    pixels: [new TrailsLayer(), new SecondTrails(), new PlotsLayer(), new SeenLayer(), new SymbolsLayer()],
    layers: [
      bearings,
      new SitesLayer(sites),
      joined,
      new PastLayer(),
      forecast,
      bundle,
      overlayNames,
      sweeps,
      new SecondRun(),
      new UncertaintyLayer(),
      new VectorsLayer(),
      encounters,
      new SelectedLayer(),
      labels,
      measure,
    ],
  };
}
