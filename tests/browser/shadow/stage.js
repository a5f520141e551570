// A body in the air above a white floor, seen straight from above by a camera whose near plane leaves
// the body out: what is dark is its shadow. The same shadow is drawn from the surface that the avatar
// skins on the CPU.
import { load, Motion } from "dynaskin";

export const SIZE = 600;
/** Half of the square of floor that is seen, metres, and its middle, x and z. */
export const HALF_M = 0.75;
export const MIDDLE_M = [0.4, 0.4];
/** The camera's height above the floor and its near plane, metres. */
export const CAMERA_M = 5;
export const NEAR_M = 4.99;
/** Where the light goes; by one metre down. */
export const LIGHT = [0.5, -1, 0.3];
export const MODEL_URL = new URL("/models/female/", location.href).href;

/** A moment of the hop, with tissue that moves far enough to be told apart. */
const MOMENT_SECONDS = 76 / 60;
const STRENGTH = 4;
/** Pixels of a quarter of a centimetre by which a shadow's edge may be off. */
const BLUR = 3;

/**
 * @param start - takes the avatar and gives `skin`, an adapter's, and `draw`, which renders once and
 *   gives the canvas
 */
export async function compareShadows(start) {
  const model = await load({ model: MODEL_URL });
  const avatar = model.createAvatar({ shape: [0, 1.5, 0, 0, 0, 0, 0, 0, 0, 0] });
  const { skin, draw } = await start(avatar);
  const motion = Motion.procedural("hop", avatar);
  for (let tick = 0; tick <= MOMENT_SECONDS * 60; tick += 1) {
    skin.writePose(motion.poseAt(tick / 60));
    skin.update(1 / 60);
  }
  const show = async (strength) => {
    avatar.strength = strength;
    skin.update(0);
    const expected = shadowMask(avatar.skinned().positions, model.body.faces);
    const canvas = await draw();
    return { expected, drawn: darkMask(canvas), url: canvas.toDataURL() };
  };
  const still = await show(0);
  const moving = await show(STRENGTH);
  return {
    moving: mismatch(moving.drawn, moving.expected),
    still: mismatch(still.drawn, still.expected),
    mixedUp: mismatch(moving.drawn, still.expected),
    pictures: { still: still.url, moving: moving.url },
  };
}

/**
 * Pixels of either mask that lie more than `BLUR` from the other, as a share of the first: edges are
 * as soft as the shadow map is coarse.
 */
function mismatch(a, b) {
  const count = (mask) => mask.reduce((sum, value) => sum + value, 0);
  const beyond = (mask, other) => count(mask.map((value, idx) => value & ~other[idx] & 1));
  return (beyond(a, widened(b)) + beyond(b, widened(a))) / count(b);
}

/** The mask with all that is at most `BLUR` pixels beside it. */
function widened(mask) {
  const wide = new Uint8Array(mask.length);
  for (const [idx, value] of mask.entries()) {
    if (!value) continue;
    for (let row = -BLUR; row <= BLUR; row += 1) {
      wide.fill(1, idx + row * SIZE - BLUR, idx + row * SIZE + BLUR + 1);
    }
  }
  return wide;
}

function readDark(context) {
  const { data } = context.getImageData(0, 0, SIZE, SIZE);
  return Uint8Array.from({ length: SIZE * SIZE }, (_, idx) =>
    Number((data[idx * 4 + 1] ?? 0) < 96),
  );
}

function newContext() {
  const context = new OffscreenCanvas(SIZE, SIZE).getContext("2d");
  context.fillStyle = "white";
  context.fillRect(0, 0, SIZE, SIZE);
  return context;
}

function darkMask(canvas) {
  const context = newContext();
  context.drawImage(canvas, 0, 0, SIZE, SIZE);
  return readDark(context);
}

/** All triangles, thrown on the floor along the light. */
function shadowMask(positionsM, faces) {
  const context = newContext();
  context.fillStyle = "black";
  const pixel = (metres, axis) => ((metres - MIDDLE_M[axis] + HALF_M) / (2 * HALF_M)) * SIZE;
  const corner = (vertex) => {
    const [x, y, z] = positionsM.subarray(vertex * 3, vertex * 3 + 3);
    return [pixel(x + LIGHT[0] * y, 0), pixel(z + LIGHT[2] * y, 1)];
  };
  for (let at = 0; at < faces.length; at += 3) {
    context.beginPath();
    for (const vertex of faces.subarray(at, at + 3)) context.lineTo(...corner(vertex));
    context.fill();
  }
  return readDark(context);
}
