import type { Trait } from "virtual:traits";
import { SHAPE_LIMIT } from "./settings.js";

/** The value of an attribute for shape coefficients. */
export function traitOf(trait: Trait, shape: readonly number[]): number {
  return trait.per_coefficient.reduce(
    (value, step, idx) => value + step * (shape[idx] ?? 0),
    trait.mean,
  );
}

/** The shape with another value of an attribute, as far as the coefficients reach. */
export function withTrait(trait: Trait, shape: readonly number[], value: number): number[] {
  const change = value - traitOf(trait, shape);
  return shape.map((beta, idx) => {
    const next = beta + change * (trait.coefficients_per_unit[idx] ?? 0);
    return Math.max(-SHAPE_LIMIT, Math.min(SHAPE_LIMIT, next));
  });
}
