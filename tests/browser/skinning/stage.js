// What an engine or the renderer draws of a body with a bent elbow and a twisted wrist, beside the same surface as the
// CPU skins it, which is drawn without a skeleton.
import { load, restPose } from "dynaskin";
import { differingShare } from "../avatar/stage.js";

/** Pixels of a picture, in each direction. */
export const SIZE = 480;
/** Where the camera stands and looks, metres. */
export const EYE_M = [1.1, 1.3, 2.3];
export const TARGET_M = [0.26, 1.1, 0.15];
export const FOV_Y_RADIANS = 0.22;
export const MODEL_URL = new URL("/models/female/", location.href).href;

const ELBOW = 18;
const WRIST = 20;

/** The left elbow bent and the left wrist twisted, in radians. */
function bentPose() {
  const pose = restPose();
  const turn = (joint, [x, y, z], radians) => {
    const size = Math.sin(radians / 2);
    pose.set([x * size, y * size, z * size, Math.cos(radians / 2)], 3 + 4 * joint);
  };
  turn(ELBOW, [0, -1, 0], 2.2);
  // About the forearm, which hangs a little at rest.
  turn(WRIST, [Math.cos(0.7), -Math.sin(0.7), 0], 2.6);
  return pose;
}

/**
 * @param start - takes an avatar and its model and gives `skin(pose)`, which shows the avatar in it, `draw()`, which
 *   gives a picture as a data URL, `drawPlain(positions, normals)`, which draws that surface instead, and maybe
 *   `read()`, positions as the graphics card skinned them
 */
export async function compareSkinnings(start) {
  const model = await load({ model: MODEL_URL });
  const avatar = model.createAvatar({ skinning: "dual-quaternion" });
  const { skin, draw, drawPlain, read } = await start(avatar, model);
  const pose = bentPose();
  const pictures = {};
  const wrong = {};
  let readM = 0;
  // The way is changed between frames.
  for (const skinning of ["dual-quaternion", "linear", "dual-quaternion"]) {
    avatar.skinning = skinning;
    skin(pose);
    pictures[skinning] = await draw();
    const { positions, normals } = avatar.skinned();
    for (const [idx, at] of ((await read?.()) ?? []).entries()) {
      readM = Math.max(readM, Math.abs(at - positions[idx]));
    }
    const plain = await drawPlain(positions.slice(), normals.slice());
    wrong[skinning] = await differingShare(pictures[skinning], plain);
  }
  const apart = await differingShare(pictures.linear, pictures["dual-quaternion"]);
  return { pictures, wrong, apart, readM };
}
