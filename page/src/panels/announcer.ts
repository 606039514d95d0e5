/** Announcements for screen readers: lost and restored connections, and new alarms. */

import { alarmName, alarmsOf } from "../sky/severity";
import type { App } from "./panel";

/** Sentences that stay readable after they were announced. */
const KEPT = 10;

let lost = false;
let alarms = new Set<string>();

/** Announce what changed since the last call. */
export function announce({ feed }: App): void {
  const said: string[] = [];
  const isLost = feed.isLost(performance.now());
  if (lost && !isLost) said.push("The service is responding again.");
  lost = isLost;
  // Alarms of the time shown in a history are not news.
  const active = feed.sensorsAtS !== null ? alarms : new Set(feed.sensors.flatMap((one) => alarmsOf(one).map((alarm) => `${one.id}: ${alarmName(alarm)}`)));
  for (const one of active) if (!alarms.has(one)) said.push(`Alarm for sensor ${one}.`);
  for (const one of alarms) if (!active.has(one)) said.push(`Alarm for sensor ${one} cleared.`);
  alarms = active;
  const log = document.getElementById("announcer");
  for (const one of said) {
    const line = document.createElement("p");
    line.textContent = one;
    log?.append(line);
  }
  while (log !== null && log.children.length > KEPT) log.firstElementChild?.remove();
}
