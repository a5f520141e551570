import type { Trait } from "./likely.js";

/** The value of an attribute for shape coefficients. */
export function traitOf(trait: Trait, shape: readonly number[]): number {
  return trait.per_coefficient.reduce(
    (value, step, idx) => value + step * (shape[idx] ?? 0),
    trait.mean,
  );
}
