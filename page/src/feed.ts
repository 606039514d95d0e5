/** Reads the service: frames each second, sensors and status less often; announces interruptions. */

import { decode } from "./frame";
import type { Store } from "./store";

const SLOW_TICK_MS = 4000;
const TIMEOUT_MS = 10_000;
/** Without an answer for this long the picture is out of date, ms. */
const LOST_MS = 5000;

export interface Sensor {
  id: string;
  kind: string;
  latitude_deg: number | null;
  longitude_deg: number | null;
  range_max_m: number | null;
  rotation_period_s: number | null;
  /** By how much a wrong clock is ahead of the data time. */
  clock_lead_s?: number | null;
  range_sigma_m: number | null;
  azimuth_sigma_deg: number | null;
  updates: number;
  age_s: number | null;
  health: Record<string, unknown> | null;
  biases: Record<string, unknown>[];
  diagnoses: { sentence: string }[];
}

export interface Encounter {
  [name: string]: unknown;
}

export class Feed {
  sensors: Sensor[] = [];
  status: Record<string, unknown> = {};
  problem = "";
  /** Counts the documents read. */
  revision = 0;
  /** Area shown and selected track: what frames have of more tracks than a page can show. */
  area = "";
  track: number | null = null;
  private after: number | null = null;
  private answeredMs = performance.now();

  constructor(
    private readonly store: Store,
    private readonly tickMs: number,
    private readonly changed: () => void,
  ) {}

  start(): void {
    void this.loop(() => this.frame(), this.tickMs);
    void this.loop(() => this.documents(), SLOW_TICK_MS);
  }

  /** Whether the service has been silent for too long. */
  isLost(nowMs: number): boolean {
    return nowMs - this.answeredMs > LOST_MS;
  }

  /** When the service answered last, as `performance.now`. */
  get lastAnswerMs(): number {
    return this.answeredMs;
  }

  private async loop(step: () => Promise<void>, everyMs: number): Promise<void> {
    for (;;) {
      const began = performance.now();
      try {
        await step();
        this.problem = "";
      } catch (error) {
        this.problem = error instanceof Error ? error.message : String(error);
      }
      this.changed();
      await new Promise((done) => setTimeout(done, Math.max(20, everyMs - (performance.now() - began))));
    }
  }

  private async frame(): Promise<void> {
    const asked = new URLSearchParams();
    if (this.after !== null) asked.set("after", String(this.after));
    if (this.area !== "") asked.set("bbox", this.area);
    if (this.track !== null) asked.set("track", String(this.track));
    const answer = await get(`v1/picture?${asked.toString()}`);
    const buffer = await answer.arrayBuffer();
    try {
      const frame = decode(buffer);
      // A service that restarted without its journal numbers from zero.
      if (this.after !== null && frame.header.next < this.after) this.store.clear();
      this.after = frame.header.next;
      this.store.update(frame, performance.now());
    } catch (error) {
      this.store.malformed += 1;
      throw error;
    }
    this.answeredMs = performance.now();
  }

  private async documents(): Promise<void> {
    this.sensors = sensorsOf(await (await get("v1/sensors")).json());
    this.status = (await (await get("v1/status")).json()) as Record<string, unknown>;
    this.revision += 1;
  }
}

/** Get a document of the service. @throws Error with what the service says. */
export async function get(address: string): Promise<Response> {
  const answer = await fetch(address, { signal: AbortSignal.timeout(TIMEOUT_MS), cache: "no-store" });
  if (!answer.ok) {
    const problem = (await answer.json().catch(() => ({}))) as { detail?: string };
    throw new Error(problem.detail ?? `the service answered ${answer.status}`);
  }
  return answer;
}

function sensorsOf(document: unknown): Sensor[] {
  const listed = (document as { sensors?: Sensor[] }).sensors;
  return Array.isArray(listed) ? listed : [];
}
