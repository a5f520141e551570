import type { Bundle } from "dynaskin";
import { type ActorKind, actorLabel, isNarrow } from "./actors.js";
import { byId, create } from "./dom.js";
import { heldOut, worstRegion } from "./measured.js";

/** What a bundle says about its training. */
export interface Training {
  networks?: string;
  data?: string;
  /** Frames that it learned from. */
  frames?: number;
  /** Numbers that were learned. */
  parameters?: number;
  simulator?: { method?: number };
}

/** Reads what a bundle says about its training. */
export function trainingOf(bundle: Bundle): Training {
  return bundle.training;
}

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
      "The result of the project's own simulator for this motion, frame by frame: the reference for the " +
        "networks. It is a simulation, not a capture of a person.",
    ];
  }
  if (!bundle) return ["Its networks are being loaded."];
  const training = trainingOf(bundle);
  const sentences = [
    training.networks ??
      "A recurrent network predicts the skin's displacement, sixty times a second, in this page.",
    `It learned from ${training.frames?.toLocaleString("en") ?? "many"} frames of simulated tissue on a ` +
      "CC0 body in CMU motion captures and procedural motions, not from measurements of people.",
  ];
  if (isNarrow(kind)) {
    sentences.push(
      "Narrow: it has fewer weights here than in its paper, so it says nothing about what the " +
        "published one can do.",
    );
  }
  const unseen = heldOut(bundle);
  if (unseen) {
    const percent = Math.round((100 * unseen.errorMm) / unseen.staticMm);
    sentences.push(
      `On motions it never saw, its error in the soft regions is ${percent} % of that of plain skinning.`,
    );
  }
  const worst = worstRegion(bundle);
  if (worst) {
    sentences.push(
      `It fails most at the ${worst.region} (${worst.set}): ${Math.round(worst.ratio * 100)} % of ` +
        `${worst.staticMm.toFixed(1)} mm remain. It does not model contact with objects, clothes or muscle tension.`,
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
