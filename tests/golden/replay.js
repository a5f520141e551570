// Plays the golden hop with the built SDK, in Node and in the browser alike.

/**
 * @typedef {object} Golden Offsets that the native runtime gave, see crates/runtime/tests/models.rs.
 * @property {"hop"} motion
 * @property {number} duration_seconds
 * @property {number[]} vertices
 * @property {number[][]} offsets_rest_um `[frame][vertex * 3 + axis]`, micrometres
 */

/**
 * Steps an average body through the golden motion, 1/60 s a frame.
 *
 * @param {typeof import("dynaskin")} sdk
 * @param {import("dynaskin").Model} model
 * @param {Golden} golden
 * @returns {{ largestUm: number, worstUm: number, frames: number }} the largest offset, and the
 *   largest difference to the golden numbers, both along one axis, in micrometres
 */
export function replay(sdk, model, golden) {
  const avatar = model.createAvatar();
  const motion = sdk.Motion.procedural(golden.motion, avatar, {
    durationSeconds: golden.duration_seconds,
  });
  let largestUm = 0;
  let worstUm = 0;
  golden.offsets_rest_um.forEach((expectedUm, frame) => {
    avatar.step(motion.poseAt(frame / 60), 1 / 60);
    golden.vertices.forEach((vertex, slot) => {
      for (const axis of [0, 1, 2]) {
        const gotUm = 1e6 * (avatar.offsets[vertex * 3 + axis] ?? Number.NaN);
        const difference = Math.abs(gotUm - (expectedUm[slot * 3 + axis] ?? Number.NaN));
        largestUm = Math.max(largestUm, Math.abs(gotUm));
        worstUm = Math.max(worstUm, difference);
      }
    });
  });
  motion.dispose();
  avatar.dispose();
  return { largestUm, worstUm, frames: golden.offsets_rest_um.length };
}
