/**
 * Largest distance of a body from the average one, in standard deviations over all coefficients together. It is where
 * the SDK stops, too, when it is asked for measures: nine in ten people lie within.
 */
const LARGEST_DISTANCE = 4;

/**
 * The shape as it is, or within the bound: all coefficients shrink alike, but the one of index `kept` stands as far as
 * the bound goes.
 */
export function withinBound(shape: readonly number[], kept?: number): number[] {
  const limit = LARGEST_DISTANCE;
  const own = Math.max(-limit, Math.min(limit, shape[kept ?? -1] ?? 0));
  const room = Math.sqrt(limit * limit - own * own);
  const size = Math.hypot(...shape.filter((_, idx) => idx !== kept));
  const share = size > room ? room / size : 1;
  return shape.map((beta, idx) => (idx === kept ? own : beta * share));
}
