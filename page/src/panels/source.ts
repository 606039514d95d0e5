/** Documents that a panel needs while it is open: read when it is drawn and they are old. */

import { AnswerError, get } from "../service/feed";
import { rowsOf } from "../service/pages";
import type { App } from "./panel";

/** What a past time has, too; a recorded run has none of it. */
const OF_PAST = /^v1\/(tracks\/[0-9]+\/plots|residuals)/;

const NOT_FOUND = 404;

export class Source<T> {
  private key = "";
  private value: T | null = null;
  private readMs = -Infinity;
  private busy = false;
  private jumps = 0;
  /** The address of the value: a past time that stands is read once. */
  private of = "";
  /** The address of what the service does not have: it is not asked again. */
  private missing = "";
  /** Why there is no value, in the words of the service. */
  problem = "";

  /** @param table Of a table that is read page by page: the member of the answer that has the rows. */
  constructor(private readonly everyMs: number, private readonly table: string | null = null) {}

  /**
   * The document, or null while it is read for the first time.
   * @param about What it is about: with another one the value is discarded.
   * @param isThere Whether the picture shows that it exists: a service that reads its journal after a start will have it.
   * @param untilS Of a table: rows after this data time are not wanted, s.
   */
  read(app: App, about: string, address: string, isThere = false, untilS = Infinity): T | null {
    const key = `${app.feed.run} ${about}`;
    if (key !== this.key) {
      [this.key, this.value, this.problem, this.readMs] = [key, null, "", -Infinity];
      [this.of, this.missing] = ["", ""];
    }
    const past = OF_PAST.test(address);
    if (past && app.clock.recorded) {
      this.problem = "A recorded run does not contain the innovations of its plots; only the service can show them.";
      return null;
    }
    // Of the picture that is shown, of whose tracks the service knows.
    const at = past && !app.clock.isLive ? app.store.dataTimeS : null;
    // A jump to another time makes the answer that of another question.
    if (past && app.clock.jumps !== this.jumps) [this.jumps, this.readMs, this.of] = [app.clock.jumps, -Infinity, ""];
    const whole = at === null ? address : `${address}${address.includes("?") ? "&" : "?"}at=${at.toFixed(3)}`;
    if (past && !app.feed.isCurrent) return this.value;
    if (isThere && at === null) this.missing = "";
    if ((at !== null && whole === this.of) || whole === this.missing) return this.value;
    if (!this.busy && performance.now() - this.readMs >= this.everyMs) void this.refresh(app, key, whole, untilS);
    return this.value;
  }

  private async refresh(app: App, key: string, address: string, untilS: number): Promise<void> {
    this.busy = true;
    const { jumps } = this;
    const isWanted = (): boolean => key === this.key && jumps === this.jumps;
    try {
      const { table } = this;
      const value = (table === null ? await (await get(address)).json() : { [table]: await rowsOf(address, table, untilS) }) as T;
      if (isWanted()) [this.value, this.problem, this.of] = [value, "", address];
    } catch (error) {
      if (isWanted()) [this.value, this.problem] = [null, error instanceof Error ? error.message : String(error)];
      if (error instanceof AnswerError && error.status === NOT_FOUND) this.missing = address;
    } finally {
      this.busy = false;
      if (isWanted()) this.readMs = performance.now();
      app.actions.redraw();
    }
  }
}
