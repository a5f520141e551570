// What spring bones and dynaskin do with the same motion of the same skeleton. Both are read in
// millimetres: the tip of a spring bone from its rest, a vertex of the same regions from its.
import { Motion, restPose } from "dynaskin";
import { loadFigures } from "./figure.mjs";

export const RATES_HZ = [30, 60, 144];
export const MOTIONS = ["hop", "jump", "run-in-place"];
const MOTION_SECONDS = 8;
/** All rates show a frame at multiples of this: 5, 10 and 24 frames. */
const COMMON_SECONDS = 1 / 6;
const STIFFNESSES = [0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1, 1.5, 2, 4];
const SETTLED_MM = 1;
const WATCH_SECONDS = 5;
const TELEPORT_M = 5;
const PAUSE_SECONDS = 30;

/** The two that are compared: how each steps, and its displacements as [x, y, z, …] in mm. */
const PEERS = {
  springs: {
    step: (figure, dtSeconds) => figure.stepSprings(dtSeconds),
    readMm: ({ springs }) => springs.flatMap(({ offsetM }) => offsetM().toArray().map(toMm)),
  },
  dynaskin: {
    step: (figure, dtSeconds) => figure.stepTissue(dtSeconds),
    readMm: ({ avatar: { offsets }, vertices }) =>
      vertices.flatMap((vertex) => Array.from(offsets.subarray(vertex * 3, vertex * 3 + 3), toMm)),
  },
};

const toMm = (metres) => metres * 1000;

/** Longest of the vectors in `a`, or of their differences to those in `b`. */
function longest(a, b) {
  let largest = 0;
  for (let at = 0; at < a.length; at += 3) {
    const part = (axis) => a[at + axis] - (b?.[at + axis] ?? 0);
    largest = Math.max(largest, Math.hypot(part(0), part(1), part(2)));
  }
  return largest;
}

/** Everything but the cost. */
export async function measureMotion(modelUrl) {
  const { createFigure, softCount } = await loadFigures(modelUrl);
  const stiffness = await tune(createFigure);
  const figures = () => createFigure(stiffness);
  const counted = await figures();
  const moved = {
    springs: counted.springs.length,
    dynaskin: softCount,
  };
  counted.dispose();
  const result = { stiffness };
  for (const [name, peer] of Object.entries(PEERS)) {
    result[name] = {
      moved: moved[name],
      rates: await compareRates(figures, peer),
      teleport: await react(figures, peer, teleport),
      pause: await react(figures, peer, pause),
    };
  }
  return result;
}

/** Stiffness per region at which the springs swing as far as dynaskin's skin in a hop at 60 Hz. */
async function tune(createFigure) {
  const largest = (figure, region) =>
    longest(
      figure.regionVertices
        .get(region)
        .flatMap((vertex) =>
          Array.from(figure.avatar.offsets.subarray(vertex * 3, vertex * 3 + 3)),
        ),
    );
  const peaks = [];
  for (const stiffness of STIFFNESSES) {
    const figure = await createFigure({ chest: stiffness, buttocks: stiffness });
    const peak = { stiffness, tissue: { chest: 0, buttocks: 0 }, tip: { chest: 0, buttocks: 0 } };
    play(figure, "hop", 60, () => {
      figure.stepTissue(1 / 60);
      figure.stepSprings(1 / 60);
      for (const { region, offsetM } of figure.springs) {
        peak.tip[region] = Math.max(peak.tip[region], offsetM().length());
      }
      for (const region of ["chest", "buttocks"]) {
        peak.tissue[region] = Math.max(peak.tissue[region], largest(figure, region));
      }
    });
    peaks.push(peak);
    figure.dispose();
  }
  const misses = (region) => (peak) => Math.abs(Math.log(peak.tip[region] / peak.tissue[region]));
  const best = (region) =>
    peaks.reduce((a, b) => (misses(region)(b) < misses(region)(a) ? b : a)).stiffness;
  return { chest: best("chest"), buttocks: best("buttocks") };
}

/** Poses the figure frame by frame; the springs begin at rest. */
function play(figure, motionName, rateHz, onFrame) {
  const motion = Motion.procedural(motionName, figure.avatar, { durationSeconds: MOTION_SECONDS });
  const pose = restPose();
  for (let frame = 0; frame <= MOTION_SECONDS * rateHz; frame += 1) {
    figure.pose(motion.poseAt(frame / rateHz, pose));
    if (frame === 0) figure.settleSprings();
    onFrame(frame);
  }
  motion.dispose();
}

/** Per rate the largest and the mean difference to 60 Hz at the same instants, and the peak. */
async function compareRates(figures, peer) {
  const samples = new Map();
  for (const rateHz of RATES_HZ) {
    const seen = [];
    for (const motionName of MOTIONS) {
      const figure = await figures();
      const every = Math.round(COMMON_SECONDS * rateHz);
      play(figure, motionName, rateHz, (frame) => {
        peer.step(figure, frame === 0 ? 0 : 1 / rateHz);
        if (frame % every === 0) seen.push(peer.readMm(figure));
      });
      figure.dispose();
    }
    samples.set(rateHz, seen);
  }
  const at60 = samples.get(60);
  return RATES_HZ.map((rateHz) => {
    const differences = samples.get(rateHz).map((frame, idx) => longest(frame, at60[idx]));
    return {
      rateHz,
      peakMm: Math.max(...samples.get(rateHz).map((frame) => longest(frame))),
      largestMm: Math.max(...differences),
      meanMm: differences.reduce((sum, value) => sum + value, 0) / differences.length,
    };
  });
}

/** Stands for a second, then is 5 m further on. */
function teleport(figure, step) {
  const pose = restPose();
  for (let frame = 0; frame < 60; frame += 1) {
    figure.pose(pose);
    if (frame === 0) figure.settleSprings();
    step(1 / 60);
  }
  pose[0] += TELEPORT_M;
  figure.pose(pose);
  return 1 / 60;
}

/** Hops, and in the air the page is hidden; 30 s later it stands as it was. */
function pause(figure, step) {
  const motion = Motion.procedural("hop", figure.avatar, { durationSeconds: MOTION_SECONDS });
  const pose = restPose();
  for (let frame = 0; frame <= 150; frame += 1) {
    figure.pose(motion.poseAt(frame / 60, pose));
    if (frame === 0) figure.settleSprings();
    step(frame === 0 ? 0 : 1 / 60);
  }
  motion.dispose();
  return PAUSE_SECONDS;
}

/** Largest displacement after an event, from where it comes to rest, and when it stays there. */
async function react(figures, peer, event) {
  const figure = await figures();
  const step = (dtSeconds) => peer.step(figure, dtSeconds);
  const dtSeconds = event(figure, step);
  const before = peer.readMm(figure);
  step(dtSeconds);
  const frames = [peer.readMm(figure)];
  for (let frame = 1; frame < WATCH_SECONDS * 60; frame += 1) {
    step(1 / 60);
    frames.push(peer.readMm(figure));
  }
  const end = frames.at(-1);
  const away = frames.map((frame) => longest(frame, end));
  figure.dispose();
  return {
    jumpMm: longest(frames[0], before),
    peakMm: Math.max(...away),
    settleSeconds: (away.findLastIndex((mm) => mm > SETTLED_MM) + 1) / 60,
  };
}

/** Milliseconds per avatar and frame, the skeleton's own work left out. */
export async function measureCost(modelUrl, stiffness, frames = 2000) {
  const { createFigure } = await loadFigures(modelUrl);
  const figure = await createFigure(stiffness);
  const motion = Motion.procedural("run-in-place", figure.avatar);
  const spent = { springs: [], dynaskin: [] };
  const pose = restPose();
  for (let frame = 0; frame < frames; frame += 1) {
    figure.pose(motion.poseAt((frame / 60) % motion.durationSeconds, pose));
    for (const [name, work] of [
      ["springs", () => figure.stepSprings(1 / 60)],
      ["dynaskin", () => figure.avatar.step(pose, 1 / 60)],
    ]) {
      const startMs = performance.now();
      work();
      spent[name].push(performance.now() - startMs);
    }
  }
  figure.dispose();
  motion.dispose();
  const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
  return { springsMs: median(spent.springs), dynaskinMs: median(spent.dynaskin) };
}
