import { checkNumber } from "./check.js";
import { DynaSkinError } from "./error.js";

/**
 * How much work an avatar's tissue is worth.
 *
 * - `full`: all of it, at every step.
 * - `half`: the surface follows every second tick, at 30 Hz, and is held in between. The network's
 *   memory ticks on at 60 Hz, so back at `full` it is at once what it would have been.
 * - `asleep`: none. The tissue comes to rest over 0.2 s and then costs nothing; waking, it starts
 *   settled in the pose of that moment and fades in over as long.
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
