/** The selected track beyond the picture: its past ten minutes and its forecast. */

import { atOf } from "./encounters";
import { get } from "./feed";
import { rowsOf } from "./pages";
import { mercatorX, mercatorY } from "../drawing/mercator";

const EVERY_MS = 3000;
const PAST_S = 600;
const HORIZON_S = 120;
const STEP_S = 20;
/** Forecasts of the past start from states that the service samples every 8 s: a younger track has none, s. */
const SAMPLED_S = 9;
const BUNDLE_S = 60;
const BUNDLE_STEP_S = 30;

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

/** The trajectory set: how the track may have flown, and where it may be. */
export interface Bundle {
  /** Weight of each hypothesis and its present motion, the heaviest first. */
  hypotheses: { weight: number; kind: string; sinceS: number }[];
  /** Path of the heaviest hypothesis over the last 90 s, and the weighted mean of all. */
  best: PastPoint[];
  weighted: PastPoint[];
  /** Possible positions at the times of the forecast. */
  members: (PastPoint & { weight: number })[];
}

interface Trajectories {
  time_s: number;
  trajectories: { weight: number; segments: { begin_s: number; end_s: number | null; kind: string }[] }[];
  best: Place[];
  weighted: Place[];
}

interface Member {
  weight: number;
  latitude_deg: number;
  longitude_deg: number;
}

interface Place {
  time_s: number;
  latitude_deg: number;
  longitude_deg: number;
}

/** An update of a track, as the service describes it. */
export interface Update extends Place {
  sensor_id: string;
  height_m: number | null;
  height_sigma_m: number | null;
  speed_mps: number;
  velocity_sigma_mps: number;
  vertical_rate_mps: number | null;
  turn_right_probability: number | null;
  turn_left_probability: number | null;
  speed_change_probability: number | null;
  mode_s_address: string | null;
  measured_mode_s_address: string | null;
  adsb_implausible: boolean;
}

interface Forecast {
  probability: number;
  points: (Place & {
    region_major_m: number;
    region_minor_m: number;
    region_azimuth_deg: number;
    members?: Member[] | null;
  })[];
}

export class Selection {
  past: PastPoint[] = [];
  /** The updates of the past, oldest first. */
  updates: Update[] = [];
  forecast: ForecastPoint[] = [];
  /** The trajectory set, where there is one. */
  bundle: Bundle | null = null;
  probability = 0;
  /** Counts the changes. */
  revision = 0;
  private id: number | null = null;
  /** Data time of what was read. */
  private readS: number | null = null;
  private busy = false;
  /** What is being read, or was read last. */
  private reading: Promise<void> = Promise.resolve();
  /** Whether it is to be read again after what is being read. */
  private again = false;

  constructor(
    private readonly dataTimeS: () => number | null,
    /** Whether a track is in the picture: the service has no forecast of others. */
    private readonly isShown: (id: number) => boolean,
    /** What is shown: a recorded run has no forecasts. */
    private readonly mode: () => "live" | "history" | "recorded",
    /** Whether the service makes trajectory sets, of which a track has one. */
    private readonly hasBundle: (id: number) => boolean,
  ) {
    setInterval(() => {
      // A past time that stands is read once.
      if (this.mode() === "live" || this.readS !== this.dataTimeS()) this.refresh();
    }, EVERY_MS);
  }

  /** Follow a track, or none. */
  follow(id: number | null): void {
    if (id === this.id) return;
    this.id = id;
    this.readS = null;
    this.past = [];
    this.updates = [];
    this.forecast = [];
    this.bundle = null;
    this.revision += 1;
    this.refresh();
  }

  /** Another time is shown: what is being read is that of the one before. */
  moved(): void {
    this.again = this.busy;
    this.refresh();
  }

  /** Wait until the past of the track that is selected has been read, or could not be. */
  async settled(): Promise<void> {
    for (let reading = null; reading !== this.reading;) await (reading = this.reading);
  }

  /** Read the past and the forecast again. */
  private refresh(): void {
    const [id, time] = [this.id, this.dataTimeS()];
    if (id === null || time === null || this.busy) return;
    this.busy = true;
    this.reading = this.read(id, time);
  }

  private async read(id: number, time: number): Promise<void> {
    this.again = false;
    try {
      // The service has no history of a track that has ended.
      if (!this.isShown(id)) {
        [this.forecast, this.bundle] = [[], null];
        if (this.mode() !== "live") [this.past, this.updates] = [[], []];
        return;
      }
      const untilS = this.mode() === "live" ? Infinity : time;
      const updates = await rowsOf<Update>(`v1/tracks/${id}/history?since=${time - PAST_S}`, "updates", untilS);
      const isLive = this.mode() === "live";
      const asked = `horizon_s=${HORIZON_S}&step_s=${STEP_S}${atOf(isLive ? null : time)}`;
      const isYoung = !isLive && !((updates[0]?.time_s ?? time) <= time - SAMPLED_S);
      const isKnown = this.isShown(id) && !isYoung;
      const forecast = !isKnown || this.mode() === "recorded" ? { probability: 0, points: [] } : await get(`v1/tracks/${id}/forecast?${asked}`)
        .then(async (answer) => (await answer.json()) as Forecast)
        .catch(() => ({ probability: 0, points: [] }) as Forecast);
      const bundle = isLive && isKnown && this.hasBundle(id) ? await bundleOf(id).catch(() => null) : null;
      if (id !== this.id) return;
      this.bundle = bundle;
      this.readS = time;
      this.updates = updates.filter((one) => isLive || one.time_s <= time);
      this.past = this.updates.map(placed);
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
      [this.forecast, this.bundle] = [[], null];
      this.readS = null;
    } finally {
      this.revision += 1;
      this.busy = false;
      // Another track was selected meanwhile, or another time.
      if (id !== this.id || this.again) this.refresh();
    }
  }
}

async function bundleOf(id: number): Promise<Bundle> {
  const made = (await (await get(`v1/tracks/${id}/trajectories`)).json()) as Trajectories;
  const asked = `horizon_s=${BUNDLE_S}&step_s=${BUNDLE_STEP_S}&by=bundle`;
  const forecast = (await (await get(`v1/tracks/${id}/forecast?${asked}`)).json()) as Forecast;
  return {
    hypotheses: made.trajectories.map(({ weight, segments }) => {
      const now = segments.find((one) => one.end_s === null || one.end_s > made.time_s);
      return { weight, kind: now?.kind ?? "straight", sinceS: now?.begin_s ?? made.time_s };
    }),
    best: made.best.map(placed),
    weighted: made.weighted.map(placed),
    members: forecast.points.slice(1).flatMap((point) =>
      (point.members ?? []).map((one) => ({ ...placed({ ...one, time_s: point.time_s }), weight: one.weight }))),
  };
}

function placed(update: Place): PastPoint {
  return { timeS: update.time_s, x: mercatorX(update.longitude_deg), y: mercatorY(update.latitude_deg) };
}
