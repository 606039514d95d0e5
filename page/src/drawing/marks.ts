/** The form of the plots of each sensor as a path around the origin, within 1 to each side; on the map in `pixels.ts`. */

const FORMS: readonly string[] = [
  "M-1 0H1M0-1V1",
  "M-.8-.8H.8V.8H-.8Z",
  "M0-1L1 .9H-1Z",
  "M.9 0A.9 .9 0 1 1-.9 0A.9 .9 0 1 1 .9 0Z",
  "M-.8-.8L.8 .8M.8-.8L-.8 .8",
  "M0-1L.8 0L0 1L-.8 0Z",
  "M0 1L1-.9H-1Z",
  "M0-1V1",
];

export function markPath(sensor: number): string {
  return FORMS[Math.max(sensor, 0) % FORMS.length] ?? "";
}
