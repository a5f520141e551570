import { checkNumber, kindOf } from "./check.js";
import { DynaSkinError } from "./error.js";

/** The 24 joints of the skeleton in SMPL's order, which is the order of every per-joint array. */
export const JOINT_NAMES = [
  "pelvis",
  "left_hip",
  "right_hip",
  "spine1",
  "left_knee",
  "right_knee",
  "spine2",
  "left_ankle",
  "right_ankle",
  "spine3",
  "left_foot",
  "right_foot",
  "neck",
  "left_collar",
  "right_collar",
  "head",
  "left_shoulder",
  "right_shoulder",
  "left_elbow",
  "right_elbow",
  "left_wrist",
  "right_wrist",
  "left_hand",
  "right_hand",
] as const;

/** A joint's name. */
export type JointName = (typeof JOINT_NAMES)[number];

/**
 * A pose: 99 numbers, `[tx, ty, tz, q0x, q0y, q0z, q0w, q1x, …]`.
 *
 * First the root's translation in metres: +Y up, the rest pose faces +Z, its left is +X; zero puts
 * the body's feet on y = 0. Then one unit quaternion x, y, z, w per joint in the order of
 * {@link JOINT_NAMES}, the rotation of the joint's frame in its parent's. The rest frames are
 * aligned with the model's axes, so the rest pose is all identity. Double precision, because the
 * features are second differences.
 */
export type Pose = Float64Array;

/** Numbers in a {@link Pose}: 3 + 24 × 4. */
export const POSE_LENGTH = 99;

/** Number of shape coefficients β, in standard deviations; the first is stature. */
export const SHAPE_LENGTH = 10;

/** The rest pose: no translation, every rotation the identity. */
export function restPose(): Pose {
  const pose = new Float64Array(POSE_LENGTH);
  for (let w = 6; w < POSE_LENGTH; w += 4) pose[w] = 1;
  return pose;
}

/**
 * Refuses what is no array of `expected` numbers.
 *
 * @internal
 */
export function checkLength(what: string, values: unknown, expected: number): void {
  const array = values as ArrayLike<unknown> | null | undefined;
  const isArray = typeof array === "object" && typeof array?.length === "number";
  if (!isArray) {
    throw new DynaSkinError(
      "argument",
      `${what} must be an array of ${expected} numbers, got ${kindOf(values)}.`,
    );
  }
  if (array.length !== expected) {
    throw new DynaSkinError(
      "argument",
      `${what} must hold ${expected} numbers, got ${array.length}.`,
    );
  }
  if (array instanceof Float64Array || array instanceof Float32Array) return;
  for (let idx = 0; idx < expected; idx += 1) checkNumber(`${what}[${idx}]`, array[idx]);
}

/**
 * Refuses what is not one pose for each of a crowd's avatars, and avatars that are gone.
 *
 * @internal
 */
export function checkPoses(poses: unknown, avatars: readonly { disposed: boolean }[]): void {
  if (!Array.isArray(poses) || poses.length !== avatars.length) {
    const got = Array.isArray(poses) ? `${poses.length}` : "no array";
    throw new DynaSkinError(
      "argument",
      `stepAll needs an array of ${avatars.length} poses, one for each avatar; got ${got}.`,
    );
  }
  for (const [idx, { disposed }] of avatars.entries()) {
    checkLength(`pose ${idx}`, poses[idx], POSE_LENGTH);
    if (!disposed) continue;
    throw new DynaSkinError(
      "disposed",
      `Avatar ${idx} of the crowd was disposed; remove() it from the crowd first.`,
    );
  }
}
