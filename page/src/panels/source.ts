/** Documents that a panel needs while it is open: read when it is drawn and they are old. */

import { get } from "../feed";
import type { App } from "./panel";

/** What needs the state of the service: neither a run nor a past time has it. */
const PRESENT = /^v1\/(tracks\/[0-9]+\/plots|residuals|rejects)/;

export class Source<T> {
  private key = "";
  private value: T | null = null;
  private readMs = -Infinity;
  private busy = false;
  /** Why there is no value, in the words of the service. */
  problem = "";

  constructor(private readonly everyMs: number) {}

  /**
   * The document, or null while it is read for the first time.
   * @param key What it is about: with another one the value is discarded.
   */
  read(app: App, key: string, address: string): T | null {
    if (key !== this.key) {
      [this.key, this.value, this.problem, this.readMs] = [key, null, "", -Infinity];
    }
    if (!app.clock.isLive && PRESENT.test(address)) {
      this.problem = "Known of the present only.";
      return null;
    }
    if (!this.busy && performance.now() - this.readMs >= this.everyMs) void this.refresh(app, key, address);
    return this.value;
  }

  private async refresh(app: App, key: string, address: string): Promise<void> {
    this.busy = true;
    try {
      const value = (await (await get(address)).json()) as T;
      if (key === this.key) [this.value, this.problem] = [value, ""];
    } catch (error) {
      if (key === this.key) this.problem = error instanceof Error ? error.message : String(error);
    } finally {
      this.busy = false;
      if (key === this.key) this.readMs = performance.now();
      app.actions.redraw();
    }
  }
}
