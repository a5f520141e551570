// What many avatars cost: one call for all against a call for each, on one thread.

/** Numbers of avatars that are measured. */
export const COUNTS = [1, 2, 5, 10, 20, 50, 100];

const WARM_UP_TICKS = 20;
const TICKS = 100;

/**
 * Steps crowds of hopping and running avatars of five shapes at 60 Hz. For each number of avatars,
 * medians over ticks in milliseconds: together, one by one, and together at half detail; and the
 * stages of the first.
 *
 * @param {{ sdk: string, model: string }} places addresses
 */
export async function measureCrowd({ sdk, model }) {
  const { load, Motion } = await import(sdk);
  const loaded = await load({ model });
  const sample = loaded.createAvatar();
  const motions = ["hop", "run-in-place", "jumping-jacks"].map((name) =>
    Motion.procedural(name, sample),
  );
  const avatars = Array.from({ length: Math.max(...COUNTS) }, (_, idx) =>
    loaded.createAvatar({ shape: [0, (idx % 5) - 2, 0, 0, 0, 0, 0, 0, 0, 0] }),
  );
  const poses = avatars.map(() => new Float64Array(99));
  let tick = 0;
  const move = () => {
    tick += 1;
    for (const [idx, pose] of poses.entries()) {
      const motion = motions[idx % motions.length];
      motion.poseAt((tick / 60 + 0.37 * idx) % motion.durationSeconds, pose);
    }
  };
  const rows = COUNTS.map((count) => measureCount(loaded, avatars, poses, move, count));
  for (const made of [...avatars, ...motions, sample, loaded]) made.dispose();
  return rows;
}

function measureCount(model, avatars, poses, move, count) {
  const some = avatars.slice(0, count);
  const crowd = model.createCrowd();
  for (const avatar of some) crowd.add(avatar);
  const theirs = poses.slice(0, count);
  const reports = [];
  const together = () => {
    crowd.stepAll(theirs, 1 / 60);
    reports.push(crowd.report);
  };
  const alone = () => {
    for (const [idx, avatar] of some.entries()) avatar.step(theirs[idx], 1 / 60);
  };
  const [togetherMs, aloneMs] = interleaved(move, [together, alone]);
  const stage = (key) => median(reports.map((report) => report[key]));
  const stages = ["featuresMs", "predictMs", "decodeMs", "applyMs", "skinMs"].map(stage);
  for (const [idx, avatar] of some.entries()) {
    avatar.detail = "half";
    // Half of them in even ticks, half in odd ones.
    if (idx % 2 === 0) avatar.step(theirs[idx], 1 / 60);
  }
  const halfMs = mean(move, together);
  for (const avatar of some) avatar.detail = "full";
  crowd.dispose();
  return { count, togetherMs, aloneMs, halfMs, stages };
}

/** Medians of works that take turns, also at being first, so that slow moments meet them all. */
function interleaved(move, works) {
  const times = works.map(() => []);
  for (let tick = 0; tick < WARM_UP_TICKS + TICKS; tick += 1) {
    move();
    for (let turn = 0; turn < works.length; turn += 1) {
      const idx = (tick + turn) % works.length;
      const start = performance.now();
      works[idx]();
      if (tick >= WARM_UP_TICKS) times[idx].push(performance.now() - start);
    }
  }
  return times.map(median);
}

/** Mean of pairs of ticks, of which the median is taken: at half detail, ticks differ. */
function mean(move, work) {
  const times = [];
  for (let tick = 0; tick < WARM_UP_TICKS + TICKS; tick += 1) {
    move();
    const start = performance.now();
    work();
    const first = performance.now() - start;
    move();
    const again = performance.now();
    work();
    if (tick >= WARM_UP_TICKS) times.push((first + performance.now() - again) / 2);
  }
  return median(times);
}

function median(values) {
  const sorted = values.toSorted((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}
