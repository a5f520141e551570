// Whether everything that an engine makes of a surface takes the tissue: the engines' pages add how they draw.
// A look is right where the tissue's picture is that of a geometry without tissue that has the same numbers.
import { load, Motion } from "dynaskin";
import { differingShare, MODEL_URL, TICKS } from "./stage.js";

/** Looks that are drawn: the surface, its outline alone, its shadow alone. */
const LOOKS = ["surface", "outline", "shadow"];
const STRENGTH = 3;
/** How much of a morph target is shown where one is. */
const MORPH = 0.4;

/**
 * What an engine does in these tests. Numbers are those of the geometry before morph targets and bones.
 *
 * @typedef {object} Stand
 * @property {typeof import("dynaskin/three").AvatarTissue} AvatarTissue
 * @property {typeof import("dynaskin/three").bindAvatar} bindAvatar
 * @property {any} root the avatar
 * @property {(look: string) => Promise<string>} draw what is seen, as a data URL
 * @property {() => { positions: Float32Array, normals: Float32Array }} shown what the mesh shows
 * @property {(arrays: { positions: Float32Array, normals: Float32Array }) => () => void} freeze gives the
 *   mesh a geometry of these numbers; what it returns gives back what it had
 * @property {(influence: number) => void} morph sets one of the mesh's morph targets
 * @property {((shown: any, still: any, influence: number) => any)} [whole] numbers of which the engine shows `shown`
 *   with that much of a morph target, where it takes some of them away
 * @property {() => number[]} pick distances along rays through the trunk, metres; -1 where there is none
 * @property {() => { root: any, show: (isShown: boolean) => void, remove: () => void }} clone
 * @property {(object: any) => any} wrap puts an object into an empty one
 * @property {(isShown: boolean) => void} show
 * @property {() => Record<string, number>} counts what the engine holds
 * @property {() => any} geometry
 * @property {string[]} kinds looks that a vertex stage is to draw as attributes are drawn
 * @property {() => any[]} materials all that draws the mesh: what it had before is to be there after
 * @property {(open: (write: any) => any) => Record<string, () => unknown>} unfit attempts that are refused
 */

/** @type {Stand & { model: import("dynaskin").Model }} */
let stand;

/**
 * Prepares an engine's page.
 *
 * @param {() => Promise<Stand>} open
 */
export async function start(open) {
  const model = await load({ model: MODEL_URL });
  stand = Object.assign(await open(), { model });
  // It has been drawn before: buffers are on the graphics card.
  for (const look of LOOKS) await stand.draw(look);
}

const bind = (/** @type {any} */ root = stand.root) =>
  stand.bindAvatar(stand.model, root, { depicts: "adult", worker: false });

/** Plays a hop up to the tick at which the offsets are the largest. */
function land(/** @type {any} */ tissue, strength = STRENGTH) {
  const motion = Motion.procedural("hop", tissue.avatar);
  const play = (/** @type {number} */ tick) => {
    tissue.writePose(motion.poseAt(tick / 60));
    tissue.update(1 / 60);
  };
  let [largest, moment] = [0, 0];
  for (let tick = 0; tick < TICKS; tick += 1) {
    play(tick);
    const farthest = tissue.avatar.offsets.reduce(
      (/** @type {number} */ most, /** @type {number} */ at) => Math.max(most, Math.abs(at)),
      0,
    );
    if (farthest > largest) [largest, moment] = [farthest, tick];
  }
  tissue.avatar.reset();
  for (let tick = 0; tick <= moment; tick += 1) play(tick);
  tissue.avatar.strength = strength;
  tissue.show();
}

const largestBetween = (/** @type {number[]} */ a, /** @type {number[]} */ b) =>
  a.reduce((most, at, idx) => Math.max(most, Math.abs(at - b[idx])), 0);

/** By look: how much of the picture the tissue changes, and how much is not as the same numbers give it. */
export async function compareLooks() {
  const tissue = new stand.AvatarTissue(stand.model, stand.root, await bind());
  land(tissue);
  /** @type {Record<string, string>} */
  const pictures = {};
  const drawAll = async (/** @type {string} */ name) => {
    for (const look of LOOKS) pictures[`${look}-${name}`] = await stand.draw(look);
    return stand.pick();
  };
  const picked = await drawAll("tissue");
  const moving = stand.shown();
  stand.morph(MORPH);
  pictures["morph-tissue"] = await stand.draw("surface");
  tissue.avatar.strength = 0;
  tissue.show();
  pictures["morph-plain"] = await stand.draw("surface");
  stand.morph(0);
  tissue.show();
  const pickedPlain = await drawAll("plain");
  tissue.dispose();
  const still = stand.shown();
  const thaw = stand.freeze(moving);
  const pickedFrozen = await drawAll("frozen");
  thaw();
  const thawMorphed = stand.freeze(stand.whole?.(moving, still, MORPH) ?? moving);
  stand.morph(MORPH);
  pictures["morph-frozen"] = await stand.draw("surface");
  stand.morph(0);
  thawMorphed();
  /** @type {Record<string, { moved: number, wrong: number }>} */
  const looks = {};
  for (const look of [...LOOKS, "morph"]) {
    const of = (/** @type {string} */ name) => pictures[`${look}-${name}`];
    const moved = await differingShare(of("plain"), of("tissue"));
    looks[look] = { moved, wrong: await differingShare(of("frozen"), of("tissue")) };
  }
  return {
    looks,
    pick: {
      hit: picked.filter((at) => at > 0).length,
      moved: largestBetween(picked, pickedPlain),
      wrong: largestBetween(picked, pickedFrozen),
    },
    pictures,
  };
}

/** What is seen where the vertex stage adds the tissue, against attributes that have it. */
export async function compareWrites() {
  const binding = await bind();
  /** @type {Record<string, string>} */
  const pictures = {};
  const drawAll = async (/** @type {string} */ name, /** @type {any} */ shown) => {
    for (const look of stand.kinds) pictures[`${look}-${name}`] = await stand.draw(look);
    stand.morph(MORPH);
    shown?.show();
    pictures[`morph-${name}`] = await stand.draw("surface");
    stand.morph(0);
    shown?.show();
  };
  const still = stand.shown();
  const materials = stand.materials();
  const open = (/** @type {any} */ root, /** @type {"attributes" | "texture"} */ write) =>
    new stand.AvatarTissue(stand.model, root, binding, { write });
  const written = open(stand.root, "attributes");
  land(written);
  await drawAll("attributes", written);
  written.avatar.strength = 0;
  written.show();
  await drawAll("plain", written);
  written.dispose();
  // The file's normals, which unlike the tissue's are units within a step only.
  await drawAll("given");
  const tissue = open(stand.root, "texture");
  land(tissue);
  await drawAll("texture", tissue);
  const untouched = stand.shown();
  // A clone beside it has textures of its own, though they share materials.
  const twin = stand.clone();
  const second = open(twin.root, "texture");
  land(second, 0);
  stand.show(false);
  pictures["clone-plain"] = await stand.draw("surface");
  second.avatar.strength = STRENGTH;
  second.show();
  pictures["clone-texture"] = await stand.draw("surface");
  stand.show(true);
  twin.show(false);
  tissue.avatar.strength = 0;
  tissue.show();
  pictures["surface-still"] = await stand.draw("surface");
  second.dispose();
  twin.remove();
  const { notes } = tissue;
  tissue.avatar.strength = STRENGTH;
  tissue.show();
  pictures["surface-again"] = await stand.draw("surface");
  pictures["shadow-again"] = await stand.draw("shadow");
  tissue.dispose();
  const after = stand.materials();
  await drawAll("after");
  const counts = stand.counts();
  const third = open(stand.root, "texture");
  third.show();
  for (const look of ["surface", "shadow"]) await stand.draw(look);
  third.dispose();
  for (const look of ["surface", "shadow"]) await stand.draw(look);
  /** @type {Record<string, { moved: number, wrong: number, left: number }>} */
  const looks = {};
  for (const look of [...stand.kinds, "morph"]) {
    const share = (/** @type {string} */ a, /** @type {string} */ b) =>
      differingShare(pictures[`${look}-${a}`], pictures[`${look}-${b}`]);
    looks[look] = {
      moved: await share("plain", "texture"),
      wrong: await share("attributes", "texture"),
      left: await share("given", "after"),
    };
  }
  return {
    looks,
    clone: {
      moved: await differingShare(pictures["clone-plain"], pictures["clone-texture"]),
      wrong: await differingShare(pictures["surface-texture"], pictures["clone-texture"]),
      // The first is still where the second left it.
      firstIsPlain: await differingShare(pictures["surface-still"], pictures["clone-plain"]),
      again: await differingShare(pictures["surface-texture"], pictures["surface-again"]),
      shadowAgain: await differingShare(pictures["shadow-texture"], pictures["shadow-again"]),
    },
    notes,
    isUntouched: still.positions.every((number, idx) => number === untouched.positions[idx]),
    isGivenBack: materials.every(
      (/** @type {any} */ one, /** @type {number} */ idx) => one === after[idx],
    ),
    counts: [counts, stand.counts()],
    pictures: Object.fromEntries(
      Object.entries(pictures).map(([name, url]) => [`write-${name}`, url]),
    ),
  };
}

/** What `write: "texture"` refuses, in which words; whether anything was changed. */
export async function refuseWrites() {
  const binding = await bind();
  const before = stand.materials();
  /** @type {Record<string, string>} */
  const said = {};
  for (const [name, attempt] of Object.entries(
    stand.unfit((/** @type {any} */ write) => {
      const tissue = new stand.AvatarTissue(stand.model, stand.root, binding, { write });
      tissue.update(1 / 60);
      return tissue;
    }),
  )) {
    try {
      await attempt();
      said[name] = "nothing";
    } catch (error) {
      said[name] = `${error.code}: ${error.message}`;
    }
  }
  const after = stand.materials();
  return {
    said,
    isSame: before.every((/** @type {any} */ one, /** @type {number} */ idx) => one === after[idx]),
  };
}

/** A clone beside the first moves by itself, and disposing of either leaves the other. */
export async function compareClones() {
  const binding = await bind();
  const first = new stand.AvatarTissue(stand.model, stand.root, binding);
  land(first);
  const alone = await stand.draw("surface");
  const twin = stand.clone();
  const second = new stand.AvatarTissue(stand.model, twin.root, binding);
  land(second, 1);
  twin.show(false);
  const beside = await stand.draw("surface");
  stand.show(false);
  twin.show(true);
  const weaker = await stand.draw("surface");
  second.avatar.strength = STRENGTH;
  second.show();
  const asFirst = await stand.draw("surface");
  first.dispose();
  const withoutFirst = await stand.draw("surface");
  second.dispose();
  twin.remove();
  stand.show(true);
  return {
    firstIsLeft: await differingShare(alone, beside),
    moved: await differingShare(alone, weaker),
    wrong: await differingShare(alone, asFirst),
    secondIsLeft: await differingShare(asFirst, withoutFirst),
    pictures: { "clone-first": alone, "clone-weaker": weaker, "clone-second": asFirst },
  };
}

/** What is refused, in which words; the picture and the geometry before and after. */
export async function refuse() {
  const { model, root } = stand;
  const before = await stand.draw("surface");
  const geometry = stand.geometry();
  /** @type {Record<string, string>} */
  const said = {};
  const attempt = async (/** @type {string} */ what, /** @type {() => unknown} */ work) => {
    try {
      await work();
      said[what] = "nothing";
    } catch (error) {
      said[what] = `${error.code}: ${error.message}`;
    }
  };
  const options = { depicts: "adult", worker: false };
  await attempt("undeclared", () => stand.bindAvatar(model, root, { worker: false }));
  await attempt("bones", () => stand.bindAvatar(model, root, { ...options, bones: { neck: "x" } }));
  const scale = root.scaling ?? root.scale;
  const child = stand.clone();
  const { x, y, z } = scale;
  (child.root.scaling ?? child.root.scale).set(0.7 * x, 0.7 * y, 0.7 * z);
  const wrapped = stand.wrap(child.root);
  await attempt("child", () => stand.bindAvatar(model, wrapped, options));
  child.remove();
  const binding = await bind();
  const { positions, normals } = stand.shown();
  const other = positions.slice();
  other[0] += 0.01;
  const thaw = stand.freeze({ positions: other, normals });
  await attempt("another", () => new stand.AvatarTissue(model, root, binding));
  other[7] = Number.NaN;
  const thawAgain = stand.freeze({ positions: other, normals });
  await attempt("numbers", () => bind());
  thawAgain();
  thaw();
  const left = await differingShare(before, await stand.draw("surface"));
  return { said, left, isSameGeometry: geometry === stand.geometry() };
}

/** The binding of the first cycle, stored. */
let stored = new Uint8Array(0);

/** Binds, or reads what was bound, plays, draws and disposes some times; gives what is then held. */
export async function cycle(/** @type {number} */ times, binds = true) {
  if (stored.length === 0) stored = (await bind()).toBytes();
  const { Binding } = await import("dynaskin/three");
  for (let time = 0; time < times; time += 1) {
    const binding = binds ? await bind() : Binding.fromBytes(stored, stand.model);
    const tissue = new stand.AvatarTissue(stand.model, stand.root, binding);
    tissue.update(1 / 60);
    await stand.draw("shadow");
    tissue.dispose();
    // WebGPURenderer keeps a texture where geometries with morph targets follow each other undrawn.
    await stand.draw("shadow");
  }
  const { startCore } = await import(`${location.origin}/web/sdk/dist/core.js`);
  const binder = await import(`${location.origin}/web/sdk/dist/wasm/bind.js`);
  return {
    ...stand.counts(),
    coreBytes: (await startCore(undefined)).memory.buffer.byteLength,
    // It has been started: this gives its exports.
    binderBytes: (await binder.default()).memory.buffer.byteLength,
  };
}
