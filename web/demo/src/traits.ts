/** One attribute of a body's shape, as `dynaskin body build` writes it. */
export interface Trait {
  name: "stature" | "weight" | "chest" | "muscle" | "age";
  /** `cm`, `kg`, `%` or `years`. */
  unit: string;
  /** Value of the average body. */
  mean: number;
  range: [low: number, high: number];
  /** Change of the value with each shape coefficient. */
  per_coefficient: number[];
}

/** The value of an attribute for shape coefficients. */
export function traitOf(trait: Trait, shape: readonly number[]): number {
  return trait.per_coefficient.reduce(
    (value, step, idx) => value + step * (shape[idx] ?? 0),
    trait.mean,
  );
}
