// What is done to the SDK in a page, and whether all that waits comes to an end. Every function gives
// `{ forced, told, hanging, problems }`: faults that were forced, faults that were told to who waited, what
// was neither told nor done in time, and what else was wrong.

/** After this time something that waits counts as left hanging, in milliseconds. */
const HANGING_MS = 20_000;

/** A worker that is silent for so long is given up. */
const SILENT_MS = 4000;

let sdk;
let workers;
let renderers;
let model;
let places;

/** Loads what the page needs. */
export async function begin(where) {
  places = where;
  [sdk, workers, renderers] = await Promise.all([
    import(`${where.sdk}/index.js`),
    import(`${where.sdk}/worker/index.js`),
    import(`${where.sdk}/renderer.js`),
  ]);
  model = await sdk.load({ model: where.model });
}

const newTally = () => ({ forced: 0, told: 0, hanging: 0, problems: [] });

const HANGS = Symbol("hangs");

/** What a promise comes to: a value, an error, or {@link HANGS}. */
async function outcome(promise, limitMs = HANGING_MS) {
  let timer;
  const late = new Promise((resolve) => {
    timer = setTimeout(() => resolve({ hangs: HANGS }), limitMs);
  });
  const settled = Promise.resolve(promise).then(
    (value) => ({ value }),
    (error) => ({ error }),
  );
  const first = await Promise.race([settled, late]);
  clearTimeout(timer);
  return first;
}

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

const areFinite = (floats) => floats.every(Number.isFinite);

/** Draws, loses the graphics card, gets it back and draws again. */
async function losses(rounds, backend, lose) {
  const tally = newTally();
  const canvas = document.createElement("canvas");
  document.body.append(canvas);
  const renderer = await renderers.createRenderer(canvas, { backend });
  renderer.resize(64, 64);
  const avatar = model.createAvatar();
  avatar.step(sdk.restPose(), 0);
  const body = renderer.addBody(model.body);
  for (let round = 0; round < rounds; round += 1) {
    body.update(avatar);
    renderer.render();
    const { lost } = renderer;
    const giveBack = await lose(canvas);
    tally.forced += 1;
    const reason = await outcome(lost);
    if (reason.hangs) tally.hanging += 1;
    else if (typeof reason.value === "string") tally.told += 1;
    else tally.problems.push(`round ${round}: lost because of ${reason.value ?? reason.error}`);
    // What is set meanwhile is remembered.
    body.update(avatar);
    giveBack();
    const back = await outcome(renderer.recover());
    if (back.hangs) tally.hanging += 1;
    if (back.error) tally.problems.push(`round ${round}: ${back.error.message}`);
    if (renderer.isLost) tally.problems.push(`round ${round}: it is still lost`);
  }
  renderer.render();
  renderer.dispose();
  avatar.dispose();
  canvas.remove();
  return tally;
}

/** The browser takes the WebGL2 context away. */
export function contexts(rounds) {
  return losses(rounds, "webgl2", async (canvas) => {
    const extension = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
    extension.loseContext();
    // It gives a context back only after the page was told of the loss.
    return () => setTimeout(() => extension.restoreContext(), 0);
  });
}

/** The WebGPU device is destroyed. Null where the browser has none. */
export async function devices(rounds) {
  if (!navigator.gpu || !(await navigator.gpu.requestAdapter())) return null;
  const made = [];
  const { prototype } = globalThis.GPUAdapter;
  const request = prototype.requestDevice;
  prototype.requestDevice = async function (...args) {
    const device = await request.apply(this, args);
    made.push(device);
    return device;
  };
  try {
    return await losses(rounds, "webgpu", async () => {
      made.pop().destroy();
      return () => {};
    });
  } finally {
    prototype.requestDevice = request;
  }
}

/** Loads that are aborted at any moment, in the page and in a worker. */
export async function aborts(rounds) {
  const tally = newTally();
  for (let round = 0; round < rounds; round += 1) {
    const controller = new AbortController();
    const reason = new Error(`aborted in round ${round}`);
    const options = { model: places.model, signal: controller.signal };
    const isWorker = round % 4 === 3;
    const loading = isWorker ? workers.createWorkerModel(options) : sdk.load(options);
    const settled = outcome(loading);
    await pause((round * 7) % 60);
    controller.abort(reason);
    tally.forced += 1;
    const { hangs, value, error } = await settled;
    if (hangs) tally.hanging += 1;
    // It was done before.
    else if (value) value.dispose();
    if (error === reason || value) tally.told += 1;
    else if (error) tally.problems.push(`round ${round}: rejected with ${error.message}`);
  }
  return tally;
}

/** Workers that end by themselves while they load, make avatars, step and save. */
export async function killedWorkers(rounds) {
  const tally = newTally();
  const AT_ONCE = 6;
  for (let round = 0; round < rounds; round += AT_ONCE) {
    const lives = Array.from({ length: Math.min(AT_ONCE, rounds - round) }, (_, idx) =>
      killed(round + idx, tally),
    );
    await Promise.all(lives);
  }
  return tally;
}

async function killed(round, tally) {
  let worker;
  const createWorker = () => {
    worker = new Worker(new URL(`${places.sdk}/worker/thread.js`), { type: "module" });
    return worker;
  };
  const options = { model: places.model, timeoutMs: SILENT_MS, createWorker };
  const loading = workers.createWorkerModel(options);
  tally.forced += 1;
  if (round % 5 === 0) {
    // In the middle of the download.
    await pause((round * 3) % 50);
    worker.terminate();
    return told(round, tally, [loading]);
  }
  const loaded = await outcome(loading, 4 * HANGING_MS);
  if (!loaded.value) {
    // A machine that stands still for longer than a worker may be silent.
    tally.problems.push(`round ${round}: could not be loaded: ${loaded.error?.message}`);
    return;
  }
  const avatar = await loaded.value.createAvatar();
  avatar.step(sdk.restPose(), 1 / 60);
  if (round % 2 === 0) await avatar.whenAnswered();
  if (round % 3 === 0) avatar.step(sdk.restPose(), 1 / 60);
  worker.terminate();
  const waiting = [avatar.save(), loaded.value.createAvatar(), loaded.value.createCrowd()];
  await told(round, tally, waiting);
  avatar.dispose();
  loaded.value.dispose();
}

/** Whether all that waits for a worker is rejected with the code `worker`. */
async function told(round, tally, waiting) {
  const outcomes = await Promise.all(waiting.map((promise) => outcome(promise)));
  const hanging = outcomes.filter(({ hangs }) => hangs).length;
  tally.hanging += hanging;
  const wrong = outcomes.find(({ hangs, error }) => !hangs && error?.code !== "worker");
  // It was loaded before it was ended.
  if (wrong?.value?.dispose && waiting.length === 1) {
    wrong.value.dispose();
    tally.told += 1;
  } else if (wrong) {
    tally.problems.push(`round ${round}: ${wrong.error?.message ?? "it was answered"}`);
  } else if (hanging === 0) {
    tally.told += 1;
  }
}

let showing = null;

/** Begins to step an avatar in the page, and one in a worker, with every picture. */
export async function show() {
  const avatar = model.createAvatar();
  const worker = await workers.createWorkerAvatar({ model: places.model });
  const motion = sdk.Motion.procedural("hop", avatar);
  const state = { frames: 0, stalls: 0, problems: [] };
  const pose = new Float64Array(99);
  let [lastMs, seconds] = [performance.now(), 0];
  const frame = (nowMs) => {
    if (showing !== state) return;
    const dtSeconds = Math.max(0, nowMs - lastMs) / 1000;
    lastMs = nowMs;
    seconds = (seconds + dtSeconds) % motion.durationSeconds;
    motion.poseAt(seconds, pose);
    try {
      avatar.step(pose, dtSeconds);
      worker.step(pose, dtSeconds);
      if (avatar.timings.settledBecause === "stall") state.stalls += 1;
      if (!areFinite(avatar.skinMatrices)) state.problems.push("a number is not finite");
    } catch (error) {
      state.problems.push(error.message);
    }
    state.frames += 1;
    requestAnimationFrame(frame);
  };
  state.end = async () => {
    const answered = await outcome(worker.whenAnswered());
    if (answered.hangs) state.problems.push("the worker does not answer");
    showing = null;
    worker.dispose();
    motion.dispose();
    avatar.dispose();
  };
  showing = state;
  requestAnimationFrame(frame);
}

/** What the page shows by now. */
export const shown = () => ({
  frames: showing?.frames ?? 0,
  stalls: showing?.stalls ?? 0,
  problems: showing?.problems ?? [],
  hidden: document.hidden,
});

/** Ends it. */
export const end = () => showing?.end();
