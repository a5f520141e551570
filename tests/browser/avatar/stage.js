// What the tests of both engines do with an avatar that is somebody else's: the page is theirs.
import { load, Motion } from "dynaskin";
import { quantised } from "../../avatars/quantised.js";

export const MODEL_URL = "/models/female/";
/** Pixels of a picture, in each direction. */
export const SIZE = 320;
/** Ticks in which the hop's landing is looked for. */
export const TICKS = 120;

/** The body as a packer would write somebody's avatar: whole numbers, scaled by the inverse bind matrices. */
export async function quantisedBody() {
  const response = await fetch(`${MODEL_URL}body.glb`);
  return quantised(new Uint8Array(await response.arrayBuffer()));
}

/**
 * What an engine does in a test.
 *
 * @typedef {object} Staged
 * @property {import("dynaskin/three").AvatarTissue | import("dynaskin/babylon").AvatarTissue} tissue
 * @property {() => Promise<string>} draw what is shown, as a data URL
 * @property {() => boolean} isGivenBack whether the meshes have what they had
 */

/**
 * Binds, plays to a landing, and draws what is seen with tissue, without, and after dispose.
 *
 * @param {(model: import("dynaskin").Model, onProgress: (fraction: number) => void) => Promise<Staged>} stage
 */
export async function bindAndPlay(stage) {
  const model = await load({ model: MODEL_URL });
  /** @type {number[]} */
  const told = [];
  const start = performance.now();
  const { tissue, draw, isGivenBack } = await stage(model, (fraction) => told.push(fraction));
  const bindMs = performance.now() - start;
  const motion = Motion.procedural("hop", tissue.avatar);
  let [largestM, moment] = [0, 0];
  const play = (/** @type {number} */ tick) => {
    tissue.writePose(motion.poseAt(tick / 60));
    tissue.update(1 / 60);
  };
  for (let tick = 0; tick < TICKS; tick += 1) {
    play(tick);
    const farthest = tissue.avatar.offsets.reduce((most, at) => Math.max(most, Math.abs(at)), 0);
    if (farthest > largestM) [largestM, moment] = [farthest, tick];
  }
  tissue.avatar.reset();
  for (let tick = 0; tick <= moment; tick += 1) play(tick);
  tissue.avatar.strength = 2;
  tissue.show();
  const withTissue = await draw();
  tissue.avatar.strength = 0;
  tissue.show();
  const plain = await draw();
  const { report } = tissue.binding;
  tissue.dispose();
  const after = await draw();
  const differing = await Promise.all([
    differingShare(plain, withTissue),
    differingShare(plain, after),
  ]);
  return {
    ...{ report, told: told.length, bindMs, largestM, isGivenBack: isGivenBack() },
    ...{ moved: differing[0], left: differing[1] },
    pictures: { "with-tissue": withTissue, plain, after },
  };
}

/**
 * Share of the pixels that differ visibly.
 *
 * @param {string} a
 * @param {string} b
 */
export async function differingShare(a, b) {
  const [one, other] = await Promise.all([a, b].map(pixels));
  let differing = 0;
  for (let at = 0; at < one.length; at += 4) {
    const apart = Math.abs(one[at] - other[at]) + Math.abs(one[at + 1] - other[at + 1]);
    if (apart > 24) differing += 1;
  }
  return differing / (one.length / 4);
}

/** @param {string} url */
async function pixels(url) {
  const image = await createImageBitmap(await (await fetch(url)).blob());
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d");
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, image.width, image.height).data;
}
