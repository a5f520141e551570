import methods from "virtual:methods";
import type { Sex } from "./settings.js";

/**
 * Who moves the skin of an actor: `linear` (nobody), `dynaskin`, `truth` (the simulator, where the
 * clip has it), or the name of another method's folder under the body's `methods`.
 */
export type ActorKind = string;

/** A side of the picture. */
export type Side = "left" | "right";

const LABELS: Readonly<Record<ActorKind, string>> = {
  linear: "Linear skinning",
  "spring-bones": "Spring bones",
  dmpl: "Dyna / DMPL",
  "casas-otaduy": "Casas & Otaduy",
  "casas-otaduy-unweighted": "Casas & Otaduy, unweighted",
  dsnet: "DSNet",
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

/** The actors that a body has, in the order of the list. */
export function actorsOf(sex: Sex, hasTruth: boolean): ActorKind[] {
  return ["linear", ...(methods[sex] ?? []), "dynaskin", ...(hasTruth ? ["truth"] : [])];
}
