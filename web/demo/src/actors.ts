import methods from "virtual:methods";
import type { Sex } from "./settings.js";

/**
 * Who moves the skin of an actor: `linear` (nobody), `dynaskin`, `truth` (the simulator, where the
 * clip has it), or the name of another method's folder under the body's `methods`.
 */
export type ActorKind = string;

/** The places of the settings that an actor can stand at, from the picture's left to its right. */
export const SLOTS = ["left", "right", "third", "fourth"] as const;
export type Slot = (typeof SLOTS)[number];

const LABELS: Readonly<Record<ActorKind, string>> = {
  linear: "Linear skinning",
  "spring-bones": "Spring bones",
  dmpl: "Dyna / DMPL",
  "casas-otaduy": "Casas & Otaduy",
  "casas-otaduy-unweighted": "Casas & Otaduy, unweighted",
  dsnet: "DSNet",
  "dsnet-rbf": "DSNet, RBF start",
  dynaskin: "dynaskin",
  truth: "Ground truth",
};

/** What the page calls an actor; a method that it does not know by its folder's name. */
export function actorLabel(kind: ActorKind): string {
  const words = kind.replaceAll("-", " ");
  return LABELS[kind] ?? words.charAt(0).toUpperCase() + words.slice(1);
}

/** Whether an actor needs networks of its own, and so a download. */
export function isMethod(kind: ActorKind): boolean {
  return !["linear", "dynaskin", "truth"].includes(kind);
}

/** The compared methods whose bundles were there when the page was built. */
export function methodsOf(sex: Sex): readonly ActorKind[] {
  return methods[sex] ?? [];
}

/** The actors that a body has, in the order of the list. */
export function actorsOf(sex: Sex, hasTruth: boolean): ActorKind[] {
  return ["linear", ...methodsOf(sex), "dynaskin", ...(hasTruth ? ["truth"] : [])];
}
