/** Tables by time that the service gives page by page, the oldest rows first. */

import { get } from "./feed";

/** Rows of a page: as many as the service gives at once. */
const ROWS_MAX = 5000;
/** Pages read at most: more rows than a chart or a path can show. */
const PAGES_MAX = 20;

/**
 * Read the rows of a table, of which the newest are on the last page.
 * @param member The member of the answer that has the rows.
 * @param untilS Pages after this data time are not wanted, s.
 */
export async function rowsOf<T extends { time_s: number }>(address: string, member: string, untilS = Infinity): Promise<T[]> {
  const whole = `${address}${address.includes("?") ? "&" : "?"}limit=${ROWS_MAX}`;
  const rows: T[] = [];
  let cursor: string | null = null;
  for (let page = 0; page < PAGES_MAX; page++) {
    const next: string = cursor === null ? "" : `&cursor=${encodeURIComponent(cursor)}`;
    const answer = (await (await get(`${whole}${next}`)).json()) as Record<string, unknown>;
    for (const row of (answer[member] ?? []) as T[]) rows.push(row);
    cursor = (answer["next_cursor"] ?? null) as string | null;
    if (cursor === null || (rows[rows.length - 1]?.time_s ?? Infinity) > untilS) break;
  }
  return rows;
}
