// This build beside an earlier one in the same process: rounds take turns, also at being first, so that a
// slow moment of the machine meets both.
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

/** Stages of a frame as an avatar's timings name them, and their names in the table. */
export const STAGES = [
  ["featuresMs", "features"],
  ["predictMs", "predict"],
  ["decodeMs", "decode"],
  ["applyMs", "apply and normals"],
  ["tissueMs", "tissue, together"],
  ["skinMs", "skin on the CPU"],
];

/** Avatars that are stepped together. */
export const CROWDS = [1, 10, 100];

const WARM_UP_ROUNDS = 3;
const ROUNDS = 30;
const FRAMES_PER_ROUND = 60;
/** Avatars stepped in one round of a crowd. */
const STEPS_PER_ROUND = 200;
/** Avatars whose memory is counted: WebAssembly's memory grows by pages of 64 KiB. */
const MEASURED_AVATARS = 64;
/** Fresh processes in which a build loads a model. */
const LOADS = 8;

/**
 * Medians of a build over rounds, and the ratio to the baseline's.
 *
 * @typedef {{ name: string, beforeMs: number, afterMs: number, ratio: number, low: number, high: number }} Row
 * `ratio` is the median of the rounds' ratios, after over before; `low` and `high` are the first and the
 * third quartile
 */

/**
 * Steps the same hop through both builds of one model.
 *
 * @param {string} before a built checkout of the repository: the baseline
 * @param {string} after another one: this build
 * @param {string} model name of the model's folder
 * @returns {Promise<{ rows: Row[], sameNetworks: boolean }>}
 */
export async function compare(before, after, model) {
  const sides = await Promise.all([before, after].map((root) => open(root, model)));
  const rows = [
    ...rowsOf(
      STAGES,
      takeTurns(
        sides.map(
          ({ avatar, motion }) =>
            () =>
              frames(avatar, motion),
        ),
      ),
    ),
    ...CROWDS.flatMap((count) => crowdRows(sides, count)),
  ];
  for (const { motion, avatar, loaded } of sides) {
    for (const made of [motion, avatar, loaded]) made.dispose();
  }
  return { rows, sameNetworks: sameNetworks(before, after, model) };
}

/**
 * What one more avatar of a loaded model takes of the core's memory, in bytes.
 *
 * @param {string} root a built checkout of the repository
 * @param {string} model name of the model's folder
 */
export async function avatarBytes(root, model) {
  const { loaded, avatar } = await open(root, model);
  const { startCore } = await import(pathToFileURL(join(root, "web/sdk/dist/core.js")).href);
  const { memory } = await startCore(undefined);
  const before = memory.buffer.byteLength;
  const made = Array.from({ length: MEASURED_AVATARS }, () => loaded.createAvatar());
  const bytes = (memory.buffer.byteLength - before) / MEASURED_AVATARS;
  for (const one of [...made, avatar, loaded]) one.dispose();
  return Math.round(bytes);
}

/**
 * Milliseconds from the start of `load` to the first offsets, each in a process of its own, in turns.
 *
 * @param {string} before a built checkout of the repository: the baseline
 * @param {string} after another one: this build
 * @param {string} model name of the model's folder
 * @returns {Row}
 */
export function compareLoading(before, after, model) {
  const loads = takeTurns(
    [before, after].map((root) => () => ({ loadMs: loadMs(root, model) })),
    { warmUp: 1, rounds: LOADS },
  );
  return rowsOf([["loadMs", "load to first offset, a fresh process"]], loads)[0];
}

function loadMs(root, model) {
  const sdk = pathToFileURL(join(root, "web/sdk/dist/index.js")).href;
  const folder = pathToFileURL(join(root, "models", model, "/")).href;
  const program = `
    const { load, restPose } = await import(${JSON.stringify(sdk)});
    const start = performance.now();
    const model = await load({ model: ${JSON.stringify(folder)} });
    const avatar = model.createAvatar();
    avatar.step(restPose(), 1 / 60);
    process.stdout.write(String(performance.now() - start - avatar.offsets[0] * 0));
  `;
  return Number(execFileSync(process.execPath, ["--input-type=module", "--eval", program]));
}

async function open(root, model) {
  const { load, Motion } = await import(pathToFileURL(join(root, "web/sdk/dist/index.js")).href);
  const loaded = await load({ model: pathToFileURL(join(root, "models", model, "/")).href });
  const avatar = loaded.createAvatar();
  return { loaded, avatar, motion: Motion.procedural("hop", avatar) };
}

/** Medians of the stages of one round, in milliseconds. */
function frames(avatar, motion) {
  const pose = new Float64Array(99);
  const times = Object.fromEntries(STAGES.map(([key]) => [key, []]));
  for (let frame = 0; frame < FRAMES_PER_ROUND; frame += 1) {
    motion.poseAt((frame / 60) % motion.durationSeconds, pose);
    const start = performance.now();
    avatar.step(pose, 1 / 60);
    const stepped = performance.now();
    avatar.skinned();
    const skinned = performance.now();
    if (avatar.timings.ticks !== 1) continue;
    const row = { ...avatar.timings, tissueMs: stepped - start, skinMs: skinned - stepped };
    for (const [key] of STAGES) times[key].push(row[key]);
  }
  return Object.fromEntries(STAGES.map(([key]) => [key, median(times[key])]));
}

function crowdRows(sides, count) {
  const stages = [["tickMs", `${count} in a crowd, a tick`]];
  const crowds = sides.map(({ loaded, motion }) => {
    const crowd = loaded.createCrowd();
    const avatars = Array.from({ length: count }, () => loaded.createAvatar());
    for (const avatar of avatars) crowd.add(avatar);
    return { crowd, avatars, motion, poses: avatars.map(() => new Float64Array(99)) };
  });
  const rows = rowsOf(stages, takeTurns(crowds.map((side) => () => ticks(side))));
  for (const { crowd, avatars } of crowds) for (const made of [crowd, ...avatars]) made.dispose();
  return rows;
}

function ticks({ crowd, motion, poses }) {
  const times = [];
  for (let tick = 0; tick < Math.ceil(STEPS_PER_ROUND / poses.length); tick += 1) {
    for (const [idx, pose] of poses.entries()) {
      motion.poseAt((tick / 60 + 0.37 * idx) % motion.durationSeconds, pose);
    }
    const start = performance.now();
    crowd.stepAll(poses, 1 / 60);
    times.push(performance.now() - start);
  }
  return { tickMs: median(times) };
}

/** What each work reports, round by round. */
function takeTurns(works, { warmUp, rounds } = { warmUp: WARM_UP_ROUNDS, rounds: ROUNDS }) {
  const reports = works.map(() => []);
  for (let round = 0; round < warmUp + rounds; round += 1) {
    for (let turn = 0; turn < works.length; turn += 1) {
      const idx = (round + turn) % works.length;
      const report = works[idx]();
      if (round >= warmUp) reports[idx].push(report);
    }
  }
  return reports;
}

function rowsOf(stages, [before, after]) {
  return stages.map(([key, name]) => {
    const ratios = before.map((report, round) => after[round][key] / report[key]);
    return {
      name,
      beforeMs: median(before.map((report) => report[key])),
      afterMs: median(after.map((report) => report[key])),
      ratio: median(ratios),
      low: quantile(ratios, 0.25),
      high: quantile(ratios, 0.75),
    };
  });
}

/** Whether both builds bring the same weights: otherwise the ratio is of the networks as well. */
function sameNetworks(before, after, model) {
  return ["predictor.onnx", "decoder.onnx"].every((file) => {
    const [a, b] = [before, after].map((root) => readFileSync(join(root, "models", model, file)));
    return a.equals(b);
  });
}

const median = (values) => quantile(values, 0.5);

function quantile(values, share) {
  const sorted = values.toSorted((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.floor(sorted.length * share))];
}
