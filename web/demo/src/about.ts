import type { Bundle } from "dynaskin";
import { byId } from "./dom.js";

/** Says honestly what moves here, what it learned from and how well it does on unseen data. */
export function describeModel(bundle: Bundle): void {
  const ratio = heldOutRatio(bundle);
  const measured =
    ratio === null
      ? ""
      : ` On clips it never saw, its error in the soft regions is ${Math.round(ratio * 100)} % of that of plain skinning.`;
  byId("about-text").textContent =
    "A recurrent network predicts where the skin is, sixty times a second, in this page. It " +
    "learned from simulated tissue on a CC0 body moved by CMU motion capture, not from " +
    `measurements of people.${measured}`;
}

function heldOutRatio(bundle: Bundle): number | null {
  const ratio = bundle.measured.held_out_ratio;
  return typeof ratio === "number" ? ratio : null;
}
