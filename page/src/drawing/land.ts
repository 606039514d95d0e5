/** Land as polygons of a plane map: those of the data cross the antimeridian and enclose a pole. */

import type { Feature, FeatureCollection, Geometry, Polygon, Position } from "geojson";

const TURN_DEG = 360;
/** Where the map ends, degrees. */
const END_DEG = 85.06;

/** Polygons whose edges do not run around the world; one that reaches beyond the map is on both of its sides. */
export function unwrapped(land: FeatureCollection<Geometry | null>): FeatureCollection<Polygon> {
  const features: Feature<Polygon>[] = [];
  for (const { geometry } of land.features) {
    const polygons = geometry?.type === "Polygon" ? [geometry.coordinates] : geometry?.type === "MultiPolygon" ? geometry.coordinates : [];
    for (const polygon of polygons) {
      const rings = polygon.map(straight);
      const longitudes = rings.flatMap((ring) => ring.map(([longitude]) => longitude ?? 0));
      const shifts = [0, ...(Math.max(...longitudes) > TURN_DEG / 2 ? [-TURN_DEG] : []), ...(Math.min(...longitudes) < -TURN_DEG / 2 ? [TURN_DEG] : [])];
      for (const shift of shifts) {
        const coordinates = rings.map((ring) => ring.map(([longitude, latitude]): Position => [(longitude ?? 0) + shift, latitude ?? 0]));
        features.push({ type: "Feature", properties: {}, geometry: { type: "Polygon", coordinates } });
      }
    }
  }
  return { type: "FeatureCollection", features };
}

/** A ring whose longitudes do not jump; around a pole it is closed along the end of the map. */
function straight(ring: Position[]): Position[] {
  let [turns, last] = [0, ring[0]?.[0] ?? 0];
  const points = ring.map(([longitude = 0, latitude = 0]): Position => {
    if (longitude - last > TURN_DEG / 2) turns -= 1;
    else if (last - longitude > TURN_DEG / 2) turns += 1;
    last = longitude;
    return [longitude + TURN_DEG * turns, latitude];
  });
  if (turns === 0) return points;
  const [first, end] = [points[0], points[points.length - 1]];
  const pole = Math.sign(first?.[1] ?? 0) * END_DEG;
  return [...points, [end?.[0] ?? 0, pole], [first?.[0] ?? 0, pole], first ?? [0, 0]];
}
