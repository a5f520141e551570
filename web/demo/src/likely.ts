/**
 * Largest distance of a body from the average one, in standard deviations over all coefficients together. It is where
 * the SDK stops, too, when it is asked for measures: nine in ten people lie within.
 */
const LARGEST_DISTANCE = 4;

/** The shape as it is, or the nearest on the way to the average body that is within the bound. */
export function withinBound(shape: readonly number[]): number[] {
  const size = Math.hypot(...shape);
  return shape.map((beta) => (size > LARGEST_DISTANCE ? (beta * LARGEST_DISTANCE) / size : beta));
}
