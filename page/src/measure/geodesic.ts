/** The shortest line on the ellipsoid WGS 84 (T. Vincenty, Survey Review 23, 1975, inverse formula). */

const MAJOR_M = 6_378_137;
const FLATTENING = 1 / 298.257223563;
const MINOR_M = MAJOR_M * (1 - FLATTENING);
const DEGREE = Math.PI / 180;
const ROUNDS_MAX = 100;
const PRECISION = 1e-12;

export interface Line {
  metres: number;
  /** At the start, clockwise from true north, degrees from 0 to 360. */
  bearingDeg: number;
}

/** Distance and bearing between two places [longitude, latitude], degrees; NaN for nearly opposite ones. */
export function inverse(from: readonly [number, number], to: readonly [number, number]): Line {
  const reduced = (latitudeDeg: number): number => Math.atan((1 - FLATTENING) * Math.tan(latitudeDeg * DEGREE));
  const [u1, u2] = [reduced(from[1]), reduced(to[1])];
  const [sinU1, cosU1, sinU2, cosU2] = [Math.sin(u1), Math.cos(u1), Math.sin(u2), Math.cos(u2)];
  const difference = (((((to[0] - from[0] + 180) % 360) + 360) % 360) - 180) * DEGREE;
  let lambda = difference;
  for (let round = 0; round < ROUNDS_MAX; round++) {
    const [sinL, cosL] = [Math.sin(lambda), Math.cos(lambda)];
    const sinSigma = Math.hypot(cosU2 * sinL, cosU1 * sinU2 - sinU1 * cosU2 * cosL);
    if (sinSigma === 0) return { metres: 0, bearingDeg: NaN };
    const cosSigma = sinU1 * sinU2 + cosU1 * cosU2 * cosL;
    const sigma = Math.atan2(sinSigma, cosSigma);
    const sinAlpha = (cosU1 * cosU2 * sinL) / sinSigma;
    const cos2Alpha = 1 - sinAlpha * sinAlpha;
    // Along the equator the middle is everywhere.
    const middle = cos2Alpha === 0 ? 0 : cosSigma - (2 * sinU1 * sinU2) / cos2Alpha;
    const c = (FLATTENING / 16) * cos2Alpha * (4 + FLATTENING * (4 - 3 * cos2Alpha));
    const before = lambda;
    lambda = difference + (1 - c) * FLATTENING * sinAlpha
      * (sigma + c * sinSigma * (middle + c * cosSigma * (2 * middle * middle - 1)));
    if (Math.abs(lambda - before) > PRECISION) continue;
    const square = (cos2Alpha * (MAJOR_M * MAJOR_M - MINOR_M * MINOR_M)) / (MINOR_M * MINOR_M);
    const a = 1 + (square / 16384) * (4096 + square * (square * (320 - 175 * square) - 768));
    const b = (square / 1024) * (256 + square * (square * (74 - 47 * square) - 128));
    const correction = b * sinSigma * (middle + (b / 4) * (cosSigma * (2 * middle * middle - 1)
      - (b / 6) * middle * (4 * sinSigma * sinSigma - 3) * (4 * middle * middle - 3)));
    const bearing = Math.atan2(cosU2 * sinL, cosU1 * sinU2 - sinU1 * cosU2 * cosL) / DEGREE;
    return { metres: MINOR_M * a * (sigma - correction), bearingDeg: (bearing + 360) % 360 };
  }
  return { metres: NaN, bearingDeg: NaN };
}

/** Places on the great circle between two, both included. */
export function between(
  from: readonly [number, number], to: readonly [number, number], count: number,
): [number, number][] {
  const unit = ([longitude, latitude]: readonly [number, number]): [number, number, number] => [
    Math.cos(latitude * DEGREE) * Math.cos(longitude * DEGREE),
    Math.cos(latitude * DEGREE) * Math.sin(longitude * DEGREE),
    Math.sin(latitude * DEGREE),
  ];
  const [a, b] = [unit(from), unit(to)];
  const angle = Math.acos(Math.max(-1, Math.min(1, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])));
  if (!(angle > 1e-6)) return [[from[0], from[1]], [to[0], to[1]]];
  return Array.from({ length: count + 1 }, (_, step) => {
    const [p, q] = [Math.sin((1 - step / count) * angle), Math.sin((step / count) * angle)];
    const [x, y, z] = [p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2]];
    const longitude = Math.atan2(y, x) / DEGREE;
    // Beside the start, so that the line does not cross the map at the antimeridian.
    const near = longitude + 360 * Math.round((from[0] - longitude) / 360);
    return [near, Math.atan2(z, Math.hypot(x, y)) / DEGREE];
  });
}
