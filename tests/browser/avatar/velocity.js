// Whether motion vectors are what the surface moved by: the engines' pages add how they draw and read.
import { load, Motion } from "dynaskin";
import { MODEL_URL, TICKS } from "./stage.js";

/** Pixels of a picture, in each direction. */
export const PIXELS = 512;
const STRENGTH = 3;
/** Pixels of a cell in which vertices hide each other. */
const CELL = 8;
/** Vertices that lie so far behind others of their cell may be hidden, in units of depth from 0 to 1. */
const HIDDEN = 0.004;

/**
 * What an engine does in these tests.
 *
 * @typedef {object} VelocityStand
 * @property {(model: import("dynaskin").Model, way: string, motionVectors: boolean) => Promise<any>} play makes a
 *   `DynaSkin` or an `AvatarTissue`
 * @property {() => Promise<void>} draw draws a frame and keeps its motion vectors
 * @property {() => Promise<(x: number, y: number) => [number, number]>} read the vectors of a pixel, in units of the
 *   picture from -1 to 1
 * @property {() => Float32Array} places of the vertices in the picture last drawn, `[vertex][x, y, depth]`, x and y
 *   from -1 to 1
 * @property {(influence: number) => void} morph sets a morph target
 */

/**
 * Plays to a landing, holds the pose, and compares.
 *
 * @param {VelocityStand} stand
 * @param {string} way `DynaSkin`, `DynaSkin on the card`, or what `write` is to be
 */
export async function compareVelocity(stand, way) {
  const model = await load({ model: MODEL_URL });
  if (way === "texture") return compareTexture(stand, model);
  const asked = await follow(stand, model, way, true);
  const unasked = await follow(stand, model, way, false);
  return { ...asked, unasked: unasked.held };
}

/**
 * The vertex stage moves vertices where nothing but the picture tells: they are where attributes put them.
 *
 * @param {VelocityStand} stand
 * @param {import("dynaskin").Model} model
 */
async function compareTexture(stand, model) {
  /** @type {Float32Array[]} */
  const places = [];
  const recording = {
    ...stand,
    places() {
      places.push(stand.places());
      return places[places.length - 1];
    },
  };
  const playing = { ...stand, places: () => /** @type {Float32Array} */ (places.shift()) };
  await follow(recording, model, "attributes", true);
  const asked = await follow(playing, model, "texture", true);
  await follow(recording, model, "attributes", false);
  const unasked = await follow(playing, model, "texture", false);
  return { ...asked, unasked: unasked.held };
}

/**
 * @param {VelocityStand} stand
 * @param {import("dynaskin").Model} model
 * @param {string} way
 * @param {boolean} motionVectors
 */
async function follow(stand, model, way, motionVectors) {
  // Whatever was played before, it begins in one pose.
  const isOnCard = way === "DynaSkin on the card";
  const how = isOnCard ? "DynaSkin" : way;
  const poser = await stand.play(model, how, motionVectors);
  const motion = Motion.procedural("hop", poser.avatar);
  poser.writePose(motion.poseAt(0));
  poser.dispose();
  const player = await stand.play(model, how, motionVectors);
  const { avatar } = player;
  if (isOnCard) avatar.decoding = "card";
  const step = (/** @type {number} */ tick) => {
    player.writePose(motion.poseAt(tick / 60));
    player.update(1 / 60);
  };
  let [largest, moment] = [0, 0];
  for (let tick = 0; tick < TICKS; tick += 1) {
    step(tick);
    const farthest = avatar.offsets.reduce(
      (/** @type {number} */ most, /** @type {number} */ at) => Math.max(most, Math.abs(at)),
      0,
    );
    if (farthest > largest) [largest, moment] = [farthest, tick];
  }
  avatar.reset();
  for (let tick = 0; tick < moment; tick += 1) step(tick);
  avatar.strength = STRENGTH;
  const compare = async (/** @type {number} */ tick) => {
    step(tick);
    await stand.draw();
    const before = stand.places();
    step(tick + 1);
    await stand.draw();
    return difference(before, stand.places(), await stand.read());
  };
  const moving = motionVectors ? await compare(moment) : undefined;
  // The pose is held: only tissue moves.
  const hold = async () => {
    player.update(1 / 60);
    await stand.draw();
  };
  await hold();
  await hold();
  const before = stand.places();
  await hold();
  const held = difference(before, stand.places(), await stand.read());
  if (!motionVectors) {
    player.dispose();
    return { held };
  }
  // Nothing moves.
  await stand.draw();
  const still = difference(stand.places(), stand.places(), await stand.read());
  stand.morph(0.8);
  player.show();
  await stand.draw();
  const morphedBefore = stand.places();
  await hold();
  const morphed = difference(morphedBefore, stand.places(), await stand.read());
  stand.morph(0);
  const { isDecodedOnCard = false } = player;
  // Back to the CPU and to the card again: the first frame that each decodes has vectors like others.
  const changed = isOnCard ? await change(player, hold, stand) : null;
  player.dispose();
  return { moving, held, morphed, still, changed, isDecodedOnCard };
}

/**
 * @param {any} player
 * @param {() => Promise<void>} hold
 * @param {VelocityStand} stand
 */
async function change(player, hold, stand) {
  player.avatar.decoding = "cpu";
  await hold();
  await hold();
  const before = stand.places();
  player.avatar.decoding = "card";
  await hold();
  return difference(before, stand.places(), await stand.read());
}

/**
 * Compares vectors with what vertices moved by; those that others may hide are left out.
 *
 * @param {Float32Array} before
 * @param {Float32Array} after
 * @param {(x: number, y: number) => [number, number]} read
 */
function difference(before, after, read) {
  const pixel = (/** @type {number} */ at) => ((at + 1) / 2) * PIXELS - 0.5;
  const nearest = new Map();
  const cells = (/** @type {number} */ vertex) => {
    const [x, y] = [0, 1].map((axis) => Math.floor(pixel(after[3 * vertex + axis]) / CELL));
    return [-1, 0, 1].flatMap((dx) => [-1, 0, 1].map((dy) => `${x + dx} ${y + dy}`));
  };
  const vertices = after.length / 3;
  for (let vertex = 0; vertex < vertices; vertex += 1) {
    for (const cell of cells(vertex)) {
      nearest.set(cell, Math.min(nearest.get(cell) ?? 1, after[3 * vertex + 2]));
    }
  }
  const errors = [];
  let [peak, seen] = [0, 0];
  for (let vertex = 0; vertex < vertices; vertex += 1) {
    const at = 3 * vertex;
    const [x, y] = [pixel(after[at]), pixel(after[at + 1])];
    const ahead = nearest.get(`${Math.floor(x / CELL)} ${Math.floor(y / CELL)}`);
    if (after[at + 2] > ahead + HIDDEN) continue;
    if (Math.min(x, y) < 0 || Math.max(x, y) >= PIXELS - 1) continue;
    const truth = [after[at] - before[at], after[at + 1] - before[at + 1]];
    const [left, low] = [Math.floor(x), Math.floor(y)];
    const found = [0, 0];
    for (const [dx, dy] of [
      [0, 0],
      [1, 0],
      [0, 1],
      [1, 1],
    ]) {
      const share = Math.abs(1 - dx - (x - left)) * Math.abs(1 - dy - (y - low));
      const vector = read(left + dx, low + dy);
      for (const axis of [0, 1]) found[axis] += share * vector[axis];
    }
    peak = Math.max(peak, Math.hypot(...truth));
    seen = Math.max(seen, Math.hypot(...found));
    errors.push(Math.hypot(found[0] - truth[0], found[1] - truth[1]));
  }
  errors.sort((a, b) => a - b);
  const quantile = (/** @type {number} */ share) => errors[Math.floor(share * (errors.length - 1))];
  return { vertices: errors.length, peak, seen, median: quantile(0.5), p90: quantile(0.9) };
}
