/** Tracks as text of other programs: CSV (RFC 4180), GeoJSON (RFC 7946), KML 2.2. */

import { nameOf, type Track } from "../sky/store";
import { isoTime } from "../view/units";

/** Each column with its unit in the name, as in `tracks.parquet`. */
const COLUMNS: readonly [string, (track: Track) => string | number | boolean | null][] = [
  ["time_s", (one) => one.timeS],
  ["time_utc", (one) => isoTime(one.timeS)],
  ["track_id", (one) => one.id],
  ["callsign", (one) => one.callsign],
  ["mode_3a", (one) => one.code],
  ["mode_s_address", (one) => one.address],
  ["latitude_deg", (one) => rounded(one.latitude, 7)],
  ["longitude_deg", (one) => rounded(one.longitude, 7)],
  ["height_m", (one) => rounded(one.heightM, 1)],
  ["height_sigma_m", (one) => rounded(one.heightSigmaM, 1)],
  ["speed_mps", (one) => rounded(one.speedMps, 2)],
  ["velocity_sigma_mps", (one) => rounded(one.velocitySigmaMps, 2)],
  ["heading_deg", (one) => rounded(one.headingDeg, 2)],
  ["vertical_rate_mps", (one) => rounded(one.climbMps, 2)],
  ["position_sigma_m", (one) => rounded(one.sigmaM, 1)],
  ["age_s", (one) => rounded(one.ageS, 2)],
  ["state", (one) => one.state],
  ["on_ground", (one) => (one.isGroundKnown ? one.onGround : null)],
];

export interface Past {
  /** The track whose path it is. */
  id: number;
  /** Longitude, latitude, degrees, and time, s. */
  points: [number, number, number][];
}

export function csv(tracks: readonly Track[]): string {
  const rows = [COLUMNS.map(([name]) => name), ...tracks.map((one) => COLUMNS.map(([, value]) => value(one)))];
  return rows.map((row) => row.map(field).join(",")).join("\r\n") + "\r\n";
}

export function geojson(tracks: readonly Track[], past: Past | null): string {
  const features = tracks.map((one): object => ({
    type: "Feature",
    id: one.id,
    geometry: { type: "Point", coordinates: place(one) },
    properties: Object.fromEntries(COLUMNS.map(([name, value]) => [name, value(one)])),
  }));
  if (past !== null && past.points.length > 1) {
    const parts = partsOf(past.points);
    const lines = parts.map((part) => part.map(([x, y]) => [rounded(x, 7), rounded(y, 7)]));
    const times = parts.map((part) => part.map(([, , time]) => time));
    features.push({
      type: "Feature",
      geometry: parts.length > 1 ? { type: "MultiLineString", coordinates: lines } : { type: "LineString", coordinates: lines[0] },
      properties: { track_id: past.id, what: "path", times_s: parts.length > 1 ? times : times[0] },
    });
  }
  return JSON.stringify({ type: "FeatureCollection", features });
}

/** The parts of a path, cut at the antimeridian as RFC 7946, section 3.1.9, asks. */
function partsOf(points: Past["points"]): Past["points"][] {
  const [first] = points;
  if (first === undefined) return [];
  let part = [first];
  const parts = [part];
  for (const [to, from] of points.slice(1).map((one, before) => [one, points[before] ?? one] as const)) {
    const side = from[0] < 0 ? -180 : 180;
    // Straight on beyond the side.
    const beyond = to[0] + 2 * side;
    if (Math.abs(to[0] - from[0]) > 180) {
      const share = beyond === from[0] ? 0 : (side - from[0]) / (beyond - from[0]);
      const [y, time] = [from[1] + share * (to[1] - from[1]), from[2] + share * (to[2] - from[2])];
      part.push([side, y, time]);
      parts.push((part = [[-side, y, time]]));
    }
    part.push(to);
  }
  return parts;
}

export function kml(tracks: readonly Track[], past: Past | null, title: string): string {
  const marks = tracks.map((one) => `<Placemark><name>${escaped(nameOf(one))}</name>
<ExtendedData>${COLUMNS.map(([name, value]) => `<Data name="${name}"><value>${escaped(String(value(one) ?? ""))}</value></Data>`).join("")}</ExtendedData>
${isoTime(one.timeS) === null ? "" : `<TimeStamp><when>${isoTime(one.timeS)}</when></TimeStamp>\n`}<Point><altitudeMode>absolute</altitudeMode><coordinates>${place(one).join(",")}</coordinates></Point></Placemark>`);
  if (past !== null && past.points.length > 1) {
    const lines = partsOf(past.points).map((part) =>
      `<LineString><coordinates>${part.map(([x, y]) => `${rounded(x, 7)},${rounded(y, 7)}`).join(" ")}</coordinates></LineString>`);
    marks.push(`<Placemark><name>path of track ${past.id}</name>${lines.length > 1 ? `<MultiGeometry>${lines.join("")}</MultiGeometry>` : lines.join("")}</Placemark>`);
  }
  return `<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><name>${escaped(title)}</name>
${marks.join("\n")}
</Document></kml>
`;
}

function place(track: Track): number[] {
  const flat = [rounded(track.longitude, 7) ?? 0, rounded(track.latitude, 7) ?? 0];
  const height = rounded(track.heightM, 1);
  return height === null ? flat : [...flat, height];
}

function rounded(value: number, digits: number): number | null {
  return Number.isFinite(value) ? Number(value.toFixed(digits)) : null;
}

function field(value: string | number | boolean | null): string {
  const text = value === null ? "" : String(value);
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** Text within XML; characters that XML 1.0 cannot have are left out. */
function escaped(text: string): string {
  const names: Record<string, string> = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&apos;" };
  return text.replace(/[\u0000-\u0008\u000b\u000c\u000e-\u001f\ufffe\uffff]/g, "").replace(/[&<>"']/g, (one) => names[one] ?? one);
}
