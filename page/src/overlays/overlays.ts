/** The user's own GeoJSON on the map. The service names the files by number; a wrong one is named here. */

import type OlMap from "ol/Map";
import type Feature from "ol/Feature";
import type { Coordinate } from "ol/coordinate";
import { getCenter } from "ol/extent";
import type Geometry from "ol/geom/Geometry";
import GeometryCollection from "ol/geom/GeometryCollection";
import LineString from "ol/geom/LineString";
import MultiLineString from "ol/geom/MultiLineString";
import MultiPolygon from "ol/geom/MultiPolygon";
import Polygon from "ol/geom/Polygon";
import VectorLayer from "ol/layer/Vector";
import VectorSource from "ol/source/Vector";
import GeoJSON from "ol/format/GeoJSON";
import CircleStyle from "ol/style/Circle";
import Fill from "ol/style/Fill";
import Stroke from "ol/style/Stroke";
import Style from "ol/style/Style";

import { get, readOnce } from "../service/feed";
import type { ViewState } from "../view/view";
import type { NamedPlace, OverlayNames } from "./names";

export const OVERLAY_COLOURS = { dark: "#9ec1ff", light: "#1d3f8a" } as const;
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
  private readonly places = new Map<number, NamedPlace[]>();

  constructor(
    private readonly map: OlMap,
    private readonly view: ViewState,
    private readonly names: OverlayNames,
    private readonly changed: () => void,
  ) {}

  /** Read the list and the files, once the service answers: the user may have to enter a key first. */
  async load(): Promise<void> {
    try {
      const list = await readOnce(async () => (await (await get("v1/overlays")).json()) as { overlays: Overlay[] });
      this.listed = list.overlays;
    } catch {
      return;
    }
    for (const one of this.listed) {
      if (one.problem !== "") continue;
      try {
        this.add(one, await readOnce(async () => (await (await get(`v1/overlays/${one.number}`)).json()) as unknown));
      } catch (error) {
        one.problem = error instanceof Error ? error.message : String(error);
      }
    }
    this.apply();
  }

  /** Show what is switched on, in the colours of the theme. */
  apply(): void {
    this.names.places = [];
    for (const one of this.listed) {
      const layer = this.layers.get(one.number);
      const isShown = !this.view.hidden.has(keyOf(one));
      layer?.setVisible(isShown);
      if (isShown) this.names.places.push(...(this.places.get(one.number) ?? []));
      layer?.changed();
    }
    this.changed();
  }

  private add(overlay: Overlay, document: unknown): void {
    const features = new GeoJSON().readFeatures(document, { featureProjection: "EPSG:3857" });
    for (const one of features) join(one.getGeometry());
    const layer = new VectorLayer({ source: new VectorSource({ features }), style: () => {
      const colour = OVERLAY_COLOURS[this.view.theme];
      return new Style({
        stroke: new Stroke({ color: colour, width: 1.2 }),
        fill: new Fill({ color: `${colour}14` }),
        image: new CircleStyle({ radius: 3, stroke: new Stroke({ color: colour, width: 1.5 }) }),
      });
    } });
    this.layers.set(overlay.number, layer);
    this.places.set(overlay.number, features.flatMap(placeOf));
    this.map.getLayers().insertAt(ABOVE_LAND, layer);
  }
}

/** Width of the world in map units. */
const WORLD = 2 * Math.PI * 6378137;

/** Lines that are not cut at the antimeridian go straight across it, and not around the world. */
function join(geometry: Geometry | undefined): void {
  if (geometry instanceof GeometryCollection) for (const one of geometry.getGeometriesArray()) join(one);
  if (geometry instanceof LineString) geometry.setCoordinates(joinedUp(geometry.getCoordinates()));
  if (geometry instanceof MultiLineString || geometry instanceof Polygon) {
    geometry.setCoordinates(geometry.getCoordinates().map(joinedUp));
  }
  if (geometry instanceof MultiPolygon) {
    geometry.setCoordinates(geometry.getCoordinates().map((rings) => rings.map(joinedUp)));
  }
}

function joinedUp(line: Coordinate[]): Coordinate[] {
  let worlds = 0;
  return line.map(([x = 0, ...rest], at) => {
    const apart = at === 0 ? 0 : x - (line[at - 1]?.[0] ?? x);
    // A frame around the whole world has its edges at both ends.
    if (Math.abs(apart) > 0.5 * WORLD && Math.abs(apart) < 0.999 * WORLD) worlds -= Math.sign(apart);
    return [x + worlds * WORLD, ...rest];
  });
}

/** Where the name of a feature stands, if it has one. */
function placeOf(feature: Feature): NamedPlace[] {
  const [given, geometry] = [feature.get("name") as unknown, feature.getGeometry()];
  const name = typeof given === "number" ? String(given) : given;
  if (typeof name !== "string" || name === "" || geometry == null) return [];
  const [x, y] = geometry instanceof Polygon ? geometry.getInteriorPoint().getCoordinates()
    : geometry instanceof MultiPolygon ? geometry.getInteriorPoints().getFlatCoordinates()
    : geometry instanceof LineString ? geometry.getCoordinateAt(0.5) : getCenter(geometry.getExtent());
  return x === undefined || y === undefined ? [] : [{ name, x, y }];
}

/** The name of an overlay among what is hidden. */
export function keyOf(overlay: Overlay): string {
  return `o${overlay.number}`;
}
