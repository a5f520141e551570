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

/** Error in the soft regions over that of plain skinning, on motions that were held out. */
function heldOutRatio(bundle: Bundle): number | null {
  const sets = bundle.measured.sets as { set: string; soft?: { ratio?: number } }[] | undefined;
  const ratio = sets?.find((entry) => entry.set === "unseen-motion")?.soft?.ratio;
  return typeof ratio === "number" ? ratio : null;
}
