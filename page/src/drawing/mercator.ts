/** Web Mercator, the plane of the map. */

export const RADIUS_M = 6378137;
/** Width of the world. */
export const WORLD_UNITS = 2 * Math.PI * RADIUS_M;
const DEGREE = Math.PI / 180;
/** The map ends here, degrees. */
const LATITUDE_MAX = 85.05;

export function mercatorX(longitudeDeg: number): number {
  return RADIUS_M * longitudeDeg * DEGREE;
}

export function mercatorY(latitudeDeg: number): number {
  const latitude = Math.max(-LATITUDE_MAX, Math.min(LATITUDE_MAX, latitudeDeg)) * DEGREE;
  return RADIUS_M * Math.log(Math.tan(Math.PI / 4 + latitude / 2));
}

/** Of a point, the x that is nearest to another one: the world repeats to the east and west. */
export function nearestX(x: number, other: number): number {
  return x - WORLD_UNITS * Math.round((x - other) / WORLD_UNITS);
}

/** Points with their least extent: those before the widest gap around the world are one world further east. */
export function together(xs: readonly number[]): number[] {
  const sorted = [...xs].sort((one, other) => one - other);
  let widest = (sorted[0] ?? 0) + WORLD_UNITS - (sorted[sorted.length - 1] ?? 0);
  let start = -Infinity;
  for (let at = 1; at < sorted.length; at++) {
    const gap = (sorted[at] ?? 0) - (sorted[at - 1] ?? 0);
    if (gap > widest) [widest, start] = [gap, sorted[at] ?? 0];
  }
  return xs.map((x) => (x < start ? x + WORLD_UNITS : x));
}

/** Units of the map per metre on the ground. */
export function scaleAt(latitudeDeg: number): number {
  return 1 / Math.cos(latitudeDeg * DEGREE);
}

export function latitudeOf(y: number): number {
  return (2 * Math.atan(Math.exp(y / RADIUS_M)) - Math.PI / 2) / DEGREE;
}

/** From −180° to 180°: tracks fly across the antimeridian. */
export function longitudeOf(x: number): number {
  return nearestX(x, 0) / RADIUS_M / DEGREE;
}

/** The azimuth from a point to another on a sphere, rad, clockwise from north. */
export function azimuthTo(latitudeDeg: number, longitudeDeg: number, toLatitudeDeg: number, toLongitudeDeg: number): number {
  const [from, to] = [latitudeDeg * DEGREE, toLatitudeDeg * DEGREE];
  const east = (toLongitudeDeg - longitudeDeg) * DEGREE;
  return Math.atan2(
    Math.sin(east) * Math.cos(to),
    Math.cos(from) * Math.sin(to) - Math.sin(from) * Math.cos(to) * Math.cos(east),
  );
}

/** A point at a distance and an azimuth from another, on a sphere: [longitude, latitude], degrees. */
export function destination(
  latitudeDeg: number, longitudeDeg: number, azimuthDeg: number, metres: number,
): [number, number] {
  const arc = metres / RADIUS_M;
  const latitude = latitudeDeg * DEGREE;
  const azimuth = azimuthDeg * DEGREE;
  const sine = Math.sin(latitude) * Math.cos(arc) + Math.cos(latitude) * Math.sin(arc) * Math.cos(azimuth);
  const east = Math.atan2(
    Math.sin(azimuth) * Math.sin(arc) * Math.cos(latitude), Math.cos(arc) - Math.sin(latitude) * sine,
  );
  return [longitudeDeg + east / DEGREE, Math.asin(sine) / DEGREE];
}
