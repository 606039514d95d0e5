/** The selected track beyond the picture: its past ten minutes and its forecast. */

import { get } from "./feed";
import { mercatorX, mercatorY } from "./mercator";

const EVERY_MS = 3000;
const PAST_S = 600;
const HORIZON_S = 120;
const STEP_S = 20;

export interface PastPoint {
  timeS: number;
  x: number;
  y: number;
}

export interface ForecastPoint extends PastPoint {
  latitude: number;
  /** Half axes of the region, m, and the azimuth of the greater one, degrees. */
  majorM: number;
  minorM: number;
  azimuthDeg: number;
}

interface Update {
  time_s: number;
  latitude_deg: number;
  longitude_deg: number;
}

interface Forecast {
  probability: number;
  points: (Update & {
    region_major_m: number;
    region_minor_m: number;
    region_azimuth_deg: number;
  })[];
}

export class Selection {
  past: PastPoint[] = [];
  forecast: ForecastPoint[] = [];
  probability = 0;
  /** Counts the changes. */
  revision = 0;
  private id: number | null = null;
  private busy = false;

  constructor(private readonly dataTimeS: () => number | null) {
    setInterval(() => void this.refresh(), EVERY_MS);
  }

  /** Follow a track, or none. */
  follow(id: number | null): void {
    if (id === this.id) return;
    this.id = id;
    this.past = [];
    this.forecast = [];
    this.revision += 1;
    void this.refresh();
  }

  private async refresh(): Promise<void> {
    const [id, time] = [this.id, this.dataTimeS()];
    if (id === null || time === null || this.busy) return;
    this.busy = true;
    try {
      const since = `since=${time - PAST_S}&limit=5000`;
      const history = (await (await get(`v1/tracks/${id}/history?${since}`)).json()) as { updates: Update[] };
      const past = history.updates.map(placed);
      const asked = `horizon_s=${HORIZON_S}&step_s=${STEP_S}`;
      const forecast = await get(`v1/tracks/${id}/forecast?${asked}`)
        .then(async (answer) => (await answer.json()) as Forecast)
        .catch(() => ({ probability: 0, points: [] }) as Forecast);
      if (id !== this.id) return;
      this.past = past;
      this.probability = forecast.probability;
      this.forecast = forecast.points.map((point) => ({
        ...placed(point),
        latitude: point.latitude_deg,
        majorM: point.region_major_m,
        minorM: point.region_minor_m,
        azimuthDeg: point.region_azimuth_deg,
      }));
    } catch {
      // The feed announces a service that does not answer; an ended track has no history.
      this.forecast = [];
    } finally {
      this.revision += 1;
      this.busy = false;
    }
  }
}

function placed(update: Update): PastPoint {
  return { timeS: update.time_s, x: mercatorX(update.longitude_deg), y: mercatorY(update.latitude_deg) };
}
