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
  /** Change of the coefficients that raises the value by 1. */
  coefficients_per_unit: number[];
}

/**
 * Largest distance of a body from the average one, in standard deviations over all coefficients together
 * (Mahalanobis). The coefficients are independent and standard normal by construction, so 99 of 100 people
 * lie within: the root of the 99 % quantile of χ² with ten degrees of freedom.
 */
export const LIKELY_RADIUS = 4.82;

const dot = (a: readonly number[], b: readonly number[]) =>
  a.reduce((sum, value, idx) => sum + value * (b[idx] ?? 0), 0);
const sum = (a: readonly number[], b: readonly number[], factor = 1) =>
  a.map((value, idx) => value + factor * (b[idx] ?? 0));

/** The shape as it is, or the nearest on the way to the average body that is within the bound. */
export function withinBound(shape: readonly number[], radius = LIKELY_RADIUS): number[] {
  const size = Math.hypot(...shape);
  return shape.map((beta) => (size > radius ? (beta * radius) / size : beta));
}

/** An orthonormal basis of what attributes depend on (Gram and Schmidt). */
function basisOf(rows: readonly (readonly number[])[]): number[][] {
  const basis: number[][] = [];
  for (const row of rows) {
    const rest = basis.reduce<number[]>(
      (left, axis) => sum(left, axis, -dot(left, axis)),
      [...row],
    );
    const size = Math.hypot(...rest);
    if (size > 1e-6 * Math.hypot(...row)) basis.push(rest.map((value) => value / size));
  }
  return basis;
}

/** The part of a shape that lies along a basis. */
const along = (basis: readonly number[][], shape: readonly number[]) =>
  basis.reduce<number[]>(
    (part, axis) => sum(part, axis, dot(shape, axis)),
    shape.map(() => 0),
  );

/**
 * The likeliest shape with these values of attributes: the mean of all bodies that have them, which is
 * the shortest vector of coefficients that gives them.
 */
export function likeliest(wanted: readonly (readonly [trait: Trait, value: number])[]): number[] {
  const length = wanted[0]?.[0].per_coefficient.length ?? 0;
  const basis: number[][] = [];
  let shape = new Array<number>(length).fill(0);
  for (const [trait, value] of wanted) {
    const before = basis.length;
    basis.splice(0, basis.length, ...basisOf([...basis, trait.per_coefficient]));
    const axis = basis[before];
    if (!axis) continue;
    const missing = value - trait.mean - dot(trait.per_coefficient, shape);
    shape = sum(shape, axis, missing / dot(trait.per_coefficient, axis));
  }
  return shape;
}

/** Share of a standard deviation by which random bodies of the same weight and age differ. */
const RANDOM_REST = 0.5;

/** A random body: of any likely weight, age and stature alike, so that two of them are seen to differ. */
export function randomShape(traits: readonly Trait[], random = Math.random): number[] {
  const wanted = (["stature", "weight", "age"] as const).flatMap((name) =>
    traits
      .filter((trait) => trait.name === name)
      .map((trait) => {
        const [low, high] = trait.range;
        return [trait, low + (high - low) * random()] as const;
      }),
  );
  const mean = likeliest(wanted);
  const basis = basisOf(wanted.map(([trait]) => trait.per_coefficient));
  const noise = mean.map(() => RANDOM_REST * randomNormal(random));
  return withinBound(sum(mean, sum(noise, along(basis, noise), -1))).map(
    (beta) => Math.round(beta * 100) / 100,
  );
}

/** A standard normal number (Box and Muller 1958). */
function randomNormal(random: () => number): number {
  return Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
}
