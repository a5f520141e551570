import type { Bundle } from "dynaskin";

/** One set of held-out clips in a bundle's `measured`. */
interface MeasuredSet {
  set: string;
  frames: number;
  soft: { error_mm: number; static_mm: number };
  regions: [name: string, errors: { ratio: number; static_mm: number }][];
}

/** The sets with motions that were not trained on; one more holds known motions on new shapes. */
const UNSEEN_MOTIONS: readonly string[] = [
  "unseen-motion",
  "unseen-subject",
  "unseen-motion-and-shape",
];
/** Regions that move less than this, in millimetres, are no place where a failure shows. */
const NOTICEABLE_MM = 1;

const setsOf = (bundle: Bundle) => (bundle.measured.sets ?? []) as MeasuredSet[];

/** Mean distances in the soft regions over all frames of held-out motions, in millimetres. */
export interface HeldOut {
  /** From the simulation to what the networks predict. */
  errorMm: number;
  /** From the simulation to plain skinning. */
  staticMm: number;
}

/** What a bundle says of held-out motions, as its model card does; null where it was not measured. */
export function heldOut(bundle: Bundle): HeldOut | null {
  let [error, still, frames] = [0, 0, 0];
  for (const { set, frames: count, soft } of setsOf(bundle)) {
    if (!UNSEEN_MOTIONS.includes(set)) continue;
    error += soft.error_mm * count;
    still += soft.static_mm * count;
    frames += count;
  }
  return still > 0 ? { errorMm: error / frames, staticMm: still / frames } : null;
}

/** The region of a held-out set where the most of plain skinning's error is left. */
export function worstRegion(
  bundle: Bundle,
): { region: string; set: string; ratio: number; staticMm: number } | null {
  const all = setsOf(bundle).flatMap(({ set, regions }) =>
    regions.map(([region, { ratio, static_mm }]) => ({
      region: region.replaceAll("-", " "),
      set: set.replaceAll("-", " "),
      ratio,
      staticMm: static_mm,
    })),
  );
  const noticeable = all.filter(({ staticMm }) => staticMm >= NOTICEABLE_MM);
  return noticeable.sort((a, b) => b.ratio - a.ratio)[0] ?? null;
}
