import type { Bundle } from "dynaskin";
import { byId } from "./dom.js";

/** Says honestly what moves here, what it learned from and how well it does on unseen data. */
export function describeModel(bundle: Bundle): void {
  const ratio = heldOutRatio(bundle);
  const measured =
    ratio === null
      ? ""
      : ` On motions it never saw, its error in the soft regions is ${Math.round(ratio * 100)} % of that of plain skinning.`;
  byId("about-text").textContent =
    "A recurrent network predicts where the skin is, sixty times a second, in this page. It " +
    "learned from simulated tissue on a CC0 body moved by CMU motion capture, not from " +
    `measurements of people.${measured}`;
}

/** One set of held-out clips in a bundle's `measured`. */
interface MeasuredSet {
  set: string;
  frames: number;
  soft: { error_mm: number; static_mm: number };
}

/** The sets with motions that were not trained on; one more holds known motions on new shapes. */
const UNSEEN_MOTIONS: readonly string[] = [
  "unseen-motion",
  "unseen-subject",
  "unseen-motion-and-shape",
];

/**
 * Error in the soft regions over that of plain skinning, over all frames of motions that were held
 * out, as in the model card; null for a bundle that was not measured.
 */
function heldOutRatio(bundle: Bundle): number | null {
  const sets = bundle.measured.sets as MeasuredSet[] | undefined;
  let [errorMm, staticMm] = [0, 0];
  for (const { set, frames, soft } of sets ?? []) {
    if (!UNSEEN_MOTIONS.includes(set)) continue;
    errorMm += soft.error_mm * frames;
    staticMm += soft.static_mm * frames;
  }
  return staticMm > 0 ? errorMm / staticMm : null;
}
