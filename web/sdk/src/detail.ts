import { checkNumber } from "./check.js";
import { DynaSkinError } from "./error.js";

/**
 * Level of detail of an avatar's tissue.
 *
 * - `full`: the surface is updated at every step.
 * - `half`: the surface is updated every second tick, at 30 Hz, and held in between. The network's
 *   state still advances at 60 Hz, so back at `full` it is exact at once.
 * - `asleep`: no tissue. It fades out over 0.2 s and then costs nothing. When it wakes, it starts
 *   settled in the current pose and fades in over 0.2 s.
 */
export type Detail = "full" | "half" | "asleep";

const DETAILS: readonly Detail[] = ["asleep", "half", "full"];

/**
 * The number of a detail in the core.
 *
 * @internal
 */
export function detailIndex(detail: Detail): number {
  const idx = DETAILS.indexOf(detail);
  if (idx >= 0) return idx;
  const known = DETAILS.join(", ");
  throw new DynaSkinError("argument", `There is no detail ${String(detail)}; there are ${known}.`);
}

/**
 * The detail with that number.
 *
 * @internal
 */
export function detailOf(idx: number): Detail {
  return DETAILS[idx] ?? "full";
}

/**
 * Refuses what is no distance.
 *
 * @internal
 */
export function checkDistance(metres: number): void {
  checkNumber("distanceM", metres);
  if (metres >= 0) return;
  throw new DynaSkinError("argument", `distanceM must be 0 metres or more, got ${metres}.`);
}
