// Bones that move breasts or buttocks by themselves, where tissue moves them too.
import { DynaSkinError } from "../error.js";
import type { BindingReport } from "./binding.js";

/**
 * What becomes of bones that move breasts or buttocks by themselves, such as VRM's spring bones;
 * `report.doubleMotion` names them.
 *
 * - `"replace"`: the tissue takes their place; they are held as they were bound
 * - `"share"`: they move on, and the skin that follows them takes half of the tissue
 * - `"keep"`: they move on, and the skin that follows them takes no tissue
 */
export type SpringBones = "replace" | "share" | "keep";

/** How much of the tissue skin keeps that is theirs. */
const KEPT: Readonly<Record<SpringBones, number>> = { replace: 1, share: 0.5, keep: 0 };

/** Names of bones by what they do. */
export interface SpringNames {
  /** Bones that move by themselves. */
  readonly springs: ReadonlySet<string>;
  /** Bones that turn the body's joints: they and what hangs on them are no springs. */
  readonly mapped: ReadonlySet<string>;
}

/** Names of bones that move by themselves, and of those that turn joints. */
export function springNames({ bones, doubleMotion }: BindingReport): SpringNames {
  // A joint between two bones has both names.
  const mapped = new Set(bones.flatMap(({ bone }) => [bone, ...bone.split(" + ")]));
  return { springs: new Set(doubleMotion.filter((name) => !mapped.has(name))), mapped };
}

/**
 * How much of the tissue a vertex keeps, of which bones that move by themselves have this weight, 0 to 1.
 * From half of the weight on it is theirs.
 */
export function shareBeside(springBones: SpringBones, weight: number): number {
  return 1 - (1 - KEPT[springBones]) * Math.min(1, 2 * weight);
}

/** Refuses another word. */
export function checkSpringBones(word: unknown): void {
  if (word === undefined || Object.hasOwn(KEPT, word as string)) return;
  throw new DynaSkinError(
    "argument",
    `springBones must be "replace", "share" or "keep", got ${String(word)}.`,
  );
}
