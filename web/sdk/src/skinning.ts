import { DynaSkinError } from "./error.js";

/**
 * How the motions of several joints are blended at a vertex.
 *
 * - `linear`: the mean of their matrices, as game engines skin. Skin loses volume where joints twist or bend far.
 * - `dual-quaternion`: the mean of their dual quaternions, which is rigid. Twisted wrists stay thick, and bent
 *   elbows bulge a little.
 */
export type Skinning = "linear" | "dual-quaternion";

const SKINNINGS: readonly Skinning[] = ["linear", "dual-quaternion"];

/**
 * Whether dual quaternions are blended.
 *
 * @internal
 * @throws DynaSkinError `argument` for what is no way of skinning
 */
export function isDualQuaternion(skinning: Skinning): boolean {
  if (SKINNINGS.includes(skinning)) return skinning === "dual-quaternion";
  const known = SKINNINGS.join(", ");
  throw new DynaSkinError(
    "argument",
    `There is no skinning ${String(skinning)}; there are ${known}.`,
  );
}

/**
 * The way of skinning.
 *
 * @internal
 */
export function skinningOf(hasDualQuaternions: boolean): Skinning {
  return hasDualQuaternions ? "dual-quaternion" : "linear";
}
