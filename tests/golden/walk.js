// Random calls on an avatar, as crates/runtime/tests/walks.rs makes them: the same numbers in the same
// order, so that what is shown can be compared.

const STEPS = 160;
const LOOK = 16;
const SEGMENT = 48;
const MOVING = 3 + 3 * 24;

/** Xorshift. */
class Random {
  #state;

  constructor(seed) {
    this.#state = seed;
  }

  below(count) {
    let x = this.#state;
    x ^= x << 13;
    x ^= x >>> 17;
    x ^= x << 5;
    this.#state = x >>> 0;
    return this.#state % count;
  }

  goal() {
    return Array.from({ length: MOVING }, () => ((this.below(2001) - 1000) / 1000) * 0.3);
  }
}

/** A motion from goal to goal. */
class Walking {
  ticks = 0;
  shiftM = [0, 0];

  constructor(random) {
    this.random = random;
    this.from = random.goal();
    this.to = random.goal();
    this.pose = new Float64Array(99);
  }

  advance(ticks) {
    this.ticks += ticks;
    if (this.ticks >= SEGMENT) {
      this.ticks -= SEGMENT;
      this.from = this.to;
      this.to = this.random.goal();
    }
    const u = this.ticks / SEGMENT;
    const share = u * u * (3 - 2 * u);
    const at = (idx) => this.from[idx] + (this.to[idx] - this.from[idx]) * share;
    const [xM, zM] = this.shiftM;
    this.pose.set([at(0) + xM, at(1), at(2) + zM]);
    for (let joint = 0; joint < 24; joint += 1) {
      const [x, y, z] = [0, 1, 2].map((axis) => at(3 + 3 * joint + axis));
      const length = Math.sqrt(x * x + y * y + z * z + 1);
      this.pose.set([x / length, y / length, z / length, 1 / length], 3 + 4 * joint);
    }
    return this.pose;
  }
}

/**
 * @typedef {object} Shown
 * @property {number} seed
 * @property {string} matrices hash of the bits of all skin matrices
 * @property {number[][]} offsets_um `[look][vertex * 3 + axis]`, micrometres
 */

/**
 * Makes the calls of a seed on a fresh avatar.
 *
 * @param {import("dynaskin").Avatar} avatar
 * @param {number} seed
 * @param {number[]} vertices those whose offsets are looked at
 * @returns {Shown}
 */
export function walk(avatar, seed, vertices) {
  const random = new Random(seed);
  const walking = new Walking(random);
  let hash = 0x811c9dc5;
  const offsetsUm = [];
  for (let step = 0; step < STEPS; step += 1) {
    change(avatar, random, walking);
    let [ticks, dt] = [0, 0.3];
    if (random.below(40) !== 0) {
      const steps = [
        [2, 1 / 60],
        [2, 1 / 60],
        [1, 1 / 120],
        [4, 1 / 30],
      ];
      [ticks = 0, dt = 0] = steps[random.below(4)] ?? [];
    }
    avatar.step(walking.advance(ticks), dt);
    for (const word of new Uint32Array(avatar.skinMatrices.slice().buffer)) {
      hash = Math.imul(hash ^ word, 0x01000193);
    }
    if (step % LOOK === LOOK - 1) {
      const { offsets } = avatar;
      offsetsUm.push(
        vertices.flatMap((vertex) =>
          [0, 1, 2].map((axis) => 1e6 * (offsets[vertex * 3 + axis] ?? Number.NaN)),
        ),
      );
    }
  }
  const matrices = (hash >>> 0).toString(16).padStart(8, "0");
  return { seed, matrices, offsets_um: offsetsUm };
}

/** Most times nothing; else a call of another kind. */
function change(avatar, random, walking) {
  switch (random.below(64)) {
    case 0:
      walking.shiftM = [0, 1].map(() => (random.below(2000) - 1000) / 10);
      break;
    case 1:
      avatar.reset();
      break;
    case 2:
      avatar.detail = /** @type {const} */ (["full", "half", "asleep"])[random.below(3)] ?? "full";
      break;
    case 3:
      avatar.visible = random.below(2) === 0;
      break;
    case 4:
      avatar.strength = random.below(400) / 100;
      break;
    case 5:
      avatar.restore(avatar.save());
      break;
    case 6:
      avatar.scale = (10 + random.below(40)) / 20;
      break;
    case 7:
      avatar.setControls({ regions: { belly: { stiffness: (50 + random.below(150)) / 100 } } });
      break;
  }
}
