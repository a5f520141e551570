import methods from "virtual:methods";

/** Which body. */
export type Sex = "female" | "male";

/**
 * Who moves the skin of an actor: `linear` (nobody), `dynaskin`, `truth` (the simulator, where the
 * clip has it), or the name of another method's folder under the body's `methods`.
 */
export type ActorKind = string;

/** The places of the settings that an actor can stand at, from the picture's left to its right. */
export const SLOTS = ["left", "right", "third", "fourth"] as const;
export type Slot = (typeof SLOTS)[number];

/** Narrow: with fewer weights than published, which would take another machine to train. */
const LABELS: Readonly<Record<ActorKind, string>> = {
  linear: "Linear skinning",
  "spring-bones": "Spring bones",
  dmpl: "Dyna / DMPL",
  "casas-otaduy": "Casas & Otaduy (narrow)",
  "casas-otaduy-unweighted": "Casas & Otaduy, unweighted (narrow)",
  dsnet: "DSNet (narrow)",
  "dsnet-rbf": "DSNet, RBF start (narrow)",
  dynaskin: "dynaskin",
  truth: "Ground truth",
};

/** What the page calls an actor; a method that it does not know by its folder's name. */
export function actorLabel(kind: ActorKind): string {
  const words = kind.replaceAll("-", " ");
  return LABELS[kind] ?? words.charAt(0).toUpperCase() + words.slice(1);
}

/** The name of an actor, which says where what usually moves its skin is switched off. */
export function nameOf(kind: ActorKind, isMoved: boolean): string {
  const plain = !isMoved && kind !== "linear" && kind !== "truth";
  return plain ? `${actorLabel(kind)}, off: plain skinning` : actorLabel(kind);
}

/** Whether a method was trained here with fewer weights than its paper has. */
export function isNarrow(kind: ActorKind): boolean {
  return kind.startsWith("dsnet") || kind.startsWith("casas-otaduy");
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
