import type { Bundle } from "dynaskin";
import { type ActorKind, actorLabel } from "./actors.js";
import { byId, create } from "./dom.js";

/** One set of held-out clips in a bundle's `measured`. */
interface MeasuredSet {
  set: string;
  frames: number;
  soft: { error_mm: number; static_mm: number };
  regions: [name: string, errors: { ratio: number; static_mm: number }][];
}

/** What a bundle says about its training. */
interface Training {
  networks?: string;
  data?: string;
  frames?: number;
  simulator?: { method?: number };
}

/** The sets with motions that were not trained on; one more holds known motions on new shapes. */
const UNSEEN_MOTIONS: readonly string[] = [
  "unseen-motion",
  "unseen-subject",
  "unseen-motion-and-shape",
];

/** An actor on the screen, and what its networks come from; null for those without any. */
export interface Described {
  kind: ActorKind;
  bundle: Bundle | null;
}

/**
 * Says of each actor what it learned, from what, how well, and where it fails. `clipMethod` is the
 * state of the simulator that made the ground truth on the screen; null: there is none.
 */
export function describeActors(actors: readonly Described[], clipMethod: string | null): void {
  const about = actors.flatMap(({ kind, bundle }) => [
    create("h3", { textContent: actorLabel(kind) }),
    create("p", { textContent: sentencesFor(kind, bundle, clipMethod).join(" ") }),
  ]);
  byId("about-text").replaceChildren(...about);
}

function sentencesFor(kind: ActorKind, bundle: Bundle | null, clipMethod: string | null): string[] {
  if (kind === "linear") return ["The skin follows the bones and nothing else: no tissue at all."];
  if (kind === "truth") {
    return [
      "What the project's own simulator computed for this motion, frame by frame, and what the " +
        "networks are measured against. It is a simulation, not a capture of a person.",
    ];
  }
  if (!bundle) return ["Its networks are being loaded."];
  const training = bundle.training as Training;
  const sentences = [
    training.networks ??
      "A recurrent network predicts where the skin is, sixty times a second, in this page.",
    `It learned from ${training.frames?.toLocaleString("en") ?? "many"} frames of simulated tissue on a ` +
      "CC0 body moved by CMU motion capture and by formula, not from measurements of people.",
  ];
  const ratio = heldOutRatio(bundle);
  if (ratio !== null) {
    sentences.push(
      `On motions it never saw, its error in the soft regions is ${Math.round(ratio * 100)} % of that ` +
        "of plain skinning.",
    );
  }
  const worst = worstRegion(bundle);
  if (worst) {
    sentences.push(
      `It fails most at the ${worst.region}${worst.set}: ${Math.round(worst.ratio * 100)} % of ` +
        `${worst.staticMm.toFixed(1)} mm remain. It knows no contact, no clothes and no muscle tension.`,
    );
  }
  const method = training.simulator?.method;
  if (clipMethod !== null && method !== undefined && `${method}` !== clipMethod) {
    sentences.push(
      "It learned from an earlier state of the simulator than the one that made this clip, so part " +
        "of its error here is the difference between the two.",
    );
  }
  return sentences;
}

const setsOf = (bundle: Bundle) => (bundle.measured.sets ?? []) as MeasuredSet[];

/**
 * Error in the soft regions over that of plain skinning, over all frames of motions that were held
 * out, as in the model card; null for a bundle that was not measured.
 */
function heldOutRatio(bundle: Bundle): number | null {
  let [errorMm, staticMm] = [0, 0];
  for (const { set, frames, soft } of setsOf(bundle)) {
    if (!UNSEEN_MOTIONS.includes(set)) continue;
    errorMm += soft.error_mm * frames;
    staticMm += soft.static_mm * frames;
  }
  return staticMm > 0 ? errorMm / staticMm : null;
}

/** Regions that move less than this, in millimetres, are no place where a failure shows. */
const NOTICEABLE_MM = 1;

function worstRegion(bundle: Bundle) {
  const all = setsOf(bundle).flatMap(({ set, regions }) =>
    regions.map(([region, { ratio, static_mm }]) => ({
      region: region.replaceAll("-", " "),
      set: ` (${set.replaceAll("-", " ")})`,
      ratio,
      staticMm: static_mm,
    })),
  );
  const noticeable = all.filter(({ staticMm }) => staticMm >= NOTICEABLE_MM);
  return noticeable.sort((a, b) => b.ratio - a.ratio)[0];
}
