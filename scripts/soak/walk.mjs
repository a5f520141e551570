// One long walk through the SDK's calls, the same code in Node and in a page: which call comes next, and
// with what, follows from the seed and the number of steps alone, so two engines that agree have the same
// hash after the same number of steps.

/** Steps between two marks: a hash, times and memory. */
const MARK_STEPS = 100_000;

/** Of so many floats of a surface one goes into the hash at each step; all of them at every 256th. */
const STRIDE = 61;
const FULL_EVERY = 256;

const MOST_AVATARS = 5;
const DETAILS = ["full", "full", "half", "asleep"];
const SOURCES = ["display", "display", "tracker", "network", "as-given"];
const PRESETS = ["as-predicted", "calm-clothes", "sportswear"];

/** Numbers below 2³² from a seed (xorshift). */
class Random {
  #state;

  constructor(seed) {
    this.#state = seed >>> 0 || 1;
  }

  next() {
    let x = this.#state;
    x ^= x << 13;
    x ^= x >>> 17;
    x ^= x << 5;
    this.#state = x >>> 0;
    return this.#state;
  }

  below(count) {
    return this.next() % count;
  }

  oneIn(count) {
    return this.below(count) === 0;
  }

  of(list) {
    return list[this.below(list.length)];
  }

  /** A number from `low` to `high`. */
  between(low, high) {
    return low + (this.next() / 2 ** 32) * (high - low);
  }
}

/** Two hashes of 32 bits over the bits of floats. */
class Hash {
  #a = 0x811c9dc5;
  #b = 0x9747b28c;

  add(word) {
    this.#a = Math.imul(this.#a ^ word, 0x01000193);
    this.#b = Math.imul(this.#b ^ word, 0x85ebca6b) ^ (this.#b >>> 15);
  }

  /** Every `stride`-th float from `start` on; whether they are finite. */
  floats(floats, start = 0, stride = 1) {
    const words = new Uint32Array(floats.buffer, floats.byteOffset, floats.length);
    let areFinite = true;
    for (let idx = start; idx < words.length; idx += stride) {
      const word = words[idx];
      // An exponent of ones: infinite, or not a number.
      if ((word & 0x7f800000) === 0x7f800000) areFinite = false;
      this.add(word);
    }
    return areFinite;
  }

  get text() {
    return [this.#a, this.#b].map((word) => (word >>> 0).toString(16).padStart(8, "0")).join("");
  }
}

/** An avatar, where it is in its motion, and what was asked of it. */
class Actor {
  constructor(avatar, motion) {
    this.avatar = avatar;
    this.motion = motion;
    this.seconds = 0;
    this.pose = new Float64Array(99);
    this.shiftM = [0, 0, 0];
  }

  /** Moves on in its motion; gives the pose there. */
  poseAfter(seconds) {
    this.seconds = (this.seconds + seconds) % this.motion.durationSeconds;
    this.motion.poseAt(this.seconds, this.pose);
    for (let axis = 0; axis < 3; axis += 1) this.pose[axis] += this.shiftM[axis];
    return this.pose;
  }
}

/** The walk. */
export class Walk {
  steps = 0;
  calls = 0;
  refusals = 0;
  /** What went wrong; nothing should. */
  problems = [];
  marks = [];
  #random;
  #hash = new Hash();
  #sdk;
  #model;
  #shapes;
  #motions;
  #actors = [];
  #crowd;
  #states = [];
  #markMs = 0;

  constructor(sdk, model, seed) {
    this.#sdk = sdk;
    this.#model = model;
    this.#random = new Random(seed);
    this.#shapes = Array.from({ length: 10 }, (_, idx) =>
      Float32Array.from({ length: 10 }, (__, beta) => ((idx * 7 + beta * 3) % 9) / 3 - 1.3),
    );
    const avatar = model.createAvatar();
    this.#motions = sdk.PROCEDURAL_MOTIONS.map((name) => sdk.Motion.procedural(name, avatar));
    avatar.dispose();
    this.#crowd = model.createCrowd();
    while (this.#actors.length < 3) this.#enter();
  }

  /** Goes on for so many steps of avatars, which a crowd's step makes several of. */
  advance(count) {
    const end = this.steps + count;
    let lastMs = performance.now();
    while (this.steps < end) {
      const next = (Math.floor(this.steps / MARK_STEPS) + 1) * MARK_STEPS;
      while (this.steps < Math.min(next, end)) this.#call();
      const nowMs = performance.now();
      this.#markMs += nowMs - lastMs;
      lastMs = nowMs;
      if (this.steps >= next) this.#mark();
    }
    return { steps: this.steps, hash: this.#hash.text };
  }

  /** Median milliseconds of plain steps of one avatar, which change nothing of the walk. */
  probeMs(count = 3000) {
    const avatar = this.#model.createAvatar();
    const times = [];
    const pose = new Float64Array(99);
    for (let frame = 0; frame < count; frame += 1) {
      const motion = this.#motions[0];
      motion.poseAt((frame / 60) % motion.durationSeconds, pose);
      const start = performance.now();
      avatar.step(pose, 1 / 60);
      times.push(performance.now() - start);
    }
    avatar.dispose();
    return times.sort((a, b) => a - b)[Math.floor(count / 2)];
  }

  /** Bytes of WebAssembly memory. */
  get wasmBytes() {
    return this.#actors[0].avatar.positions.buffer.byteLength;
  }

  dispose() {
    this.#crowd.dispose();
    for (const { avatar } of this.#actors) avatar.dispose();
    for (const motion of this.#motions) motion.dispose();
  }

  #mark() {
    const { steps, wasmBytes } = this;
    const msPerStep = this.#markMs / MARK_STEPS;
    this.marks.push({ steps, hash: this.#hash.text, wasmBytes, msPerStep });
    this.#markMs = 0;
  }

  #call() {
    this.calls += 1;
    const random = this.#random;
    try {
      if (!random.oneIn(48)) this.#step(random.of(this.#actors));
      else if (random.oneIn(3)) this.#stepAll();
      else this.#change(random.of(this.#actors));
    } catch (error) {
      this.#fail(`call ${this.calls}: ${error?.message ?? error}`);
      // So that a walk on which everything fails ends.
      this.steps += 1;
    }
  }

  #fail(problem) {
    if (this.problems.length < 20) this.problems.push(`step ${this.steps}: ${problem}`);
  }

  #dtSeconds() {
    const random = this.#random;
    if (random.oneIn(500)) return random.of([0, 0.3, 5, 86_400, 1e-9]);
    return random.of([1 / 60, 1 / 60, 1 / 120, 1 / 144, 1 / 240, random.between(0, 0.03)]);
  }

  #step(actor) {
    const dtSeconds = this.#dtSeconds();
    // Poses that are held, too.
    const pose = actor.poseAfter(this.#random.oneIn(20) ? 0 : Math.min(dtSeconds, 0.25));
    actor.avatar.step(pose, dtSeconds);
    this.steps += 1;
    this.#look(actor.avatar);
  }

  #stepAll() {
    const dtSeconds = this.#dtSeconds();
    const avatars = this.#crowd.avatars;
    const actors = avatars.map((avatar) => this.#actors.find((actor) => actor.avatar === avatar));
    const poses = actors.map((actor) => actor.poseAfter(Math.min(dtSeconds, 0.25)));
    this.#crowd.stepAll(poses, dtSeconds);
    this.steps += avatars.length;
    for (const avatar of avatars) this.#look(avatar);
  }

  /** Takes the surface into the hash, and checks that it is finite. */
  #look(avatar) {
    const hash = this.#hash;
    let areFinite = hash.floats(avatar.skinMatrices);
    if (this.steps % FULL_EVERY === 0) {
      const { positions, normals } = avatar.skinned();
      for (const floats of [avatar.offsets, avatar.positions, avatar.normals, positions, normals]) {
        areFinite &&= hash.floats(floats);
      }
    } else {
      areFinite &&= hash.floats(avatar.offsets, this.steps % STRIDE, STRIDE);
    }
    if (!areFinite) this.#fail("a number is not finite");
  }

  #change(actor) {
    const random = this.#random;
    const changes = [
      () => this.#teleport(actor),
      () => this.#control(actor.avatar),
      () => this.#control(actor.avatar),
      () => this.#saveOrRestore(actor.avatar),
      () => this.#saveOrRestore(actor.avatar),
      () => this.#sleep(actor.avatar),
      () => this.#sleep(actor.avatar),
      () => this.#reshape(actor.avatar),
      () => this.#refused(actor.avatar),
      () => this.#crowdChange(actor.avatar),
      () => {
        actor.motion = random.of(this.#motions);
        actor.seconds = 0;
      },
      () => {
        if (random.oneIn(10)) this.#leave(actor);
        else this.#enter();
      },
    ];
    random.of(changes)();
  }

  #teleport(actor) {
    const random = this.#random;
    if (random.oneIn(4)) actor.avatar.reset();
    else actor.shiftM = [random.between(-50, 50), 0, random.between(-50, 50)];
  }

  #control(avatar) {
    const random = this.#random;
    if (random.oneIn(4)) return avatar.setControls(random.of(PRESETS));
    if (random.oneIn(4)) {
      avatar.strength = random.between(0, 4);
      return;
    }
    const region = {
      gain: random.between(0, 4),
      stiffness: random.between(0.1, 10),
      damping: random.between(0.1, 10),
      limitCm: random.between(0, 20),
    };
    avatar.setControls({
      rootInertia: random.between(0, 4),
      regions: { [random.of(this.#sdk.REGION_NAMES)]: region },
    });
  }

  #saveOrRestore(avatar) {
    const random = this.#random;
    if (this.#states.length === 0 || random.oneIn(2)) {
      const state = avatar.save();
      if (this.#states.length < 4) this.#states.push(state);
      else this.#states[random.below(4)] = state;
      for (let idx = 0; idx < state.length; idx += 97) this.#hash.add(state[idx]);
      return;
    }
    const state = random.of(this.#states);
    avatar.restore(state);
    const again = avatar.save();
    if (again.length !== state.length || again.some((byte, idx) => byte !== state[idx])) {
      this.#fail("a restored state is saved as another");
    }
  }

  #sleep(avatar) {
    const random = this.#random;
    if (random.oneIn(3)) avatar.visible = random.oneIn(2);
    else if (random.oneIn(4)) avatar.dynamics = !random.oneIn(3);
    else this.#sourceOrDetail(avatar);
    // Nobody stays away for ever.
    if (random.oneIn(2)) {
      avatar.visible = true;
      avatar.dynamics = true;
    }
  }

  #sourceOrDetail(avatar) {
    const random = this.#random;
    if (random.oneIn(4)) avatar.poseSource = random.of(SOURCES);
    else avatar.detail = random.of(DETAILS);
  }

  #reshape(avatar) {
    const random = this.#random;
    if (random.oneIn(3)) {
      avatar.scale = random.between(0.1, 10);
      return;
    }
    // Shapes that the model remembers; each new one runs the networks to rest.
    if (random.oneIn(8)) avatar.setShape(random.of(this.#shapes));
  }

  #refused(avatar) {
    const random = this.#random;
    const pose = this.#sdk.restPose();
    const calls = [
      () => avatar.step(pose.fill(Number.NaN), 1 / 60),
      () => avatar.step(pose, -1),
      () => avatar.step(pose.subarray(1), 0),
      () => avatar.setShape(new Float32Array(10).fill(9)),
      () => avatar.restore(new Uint8Array(random.below(200))),
      () => avatar.setControls({ strength: 1e9 }),
      () => {
        avatar.scale = 0;
      },
      () => this.#crowd.stepAll([pose], 1e9),
      () => this.#sdk.Motion.fromFile(new Uint8Array([1, 2, 3]), avatar),
    ];
    const idx = random.below(calls.length);
    try {
      calls[idx]();
    } catch (error) {
      if (!(error instanceof this.#sdk.DynaSkinError)) throw error;
      if (error.code === "crashed") throw error;
      this.refusals += 1;
      return;
    }
    this.#fail(`odd call ${idx} was not refused`);
  }

  #crowdChange(avatar) {
    if (this.#crowd.avatars.includes(avatar)) this.#crowd.remove(avatar);
    else this.#crowd.add(avatar);
    this.#crowd.levelOfDetail = this.#random.oneIn(3)
      ? { halfBeyondM: 5, asleepBeyondM: 15 }
      : null;
    for (const each of this.#crowd.avatars) each.distanceM = this.#random.between(0, 20);
  }

  #enter() {
    if (this.#actors.length === MOST_AVATARS) return;
    const random = this.#random;
    const avatar = this.#model.createAvatar({ shape: random.of(this.#shapes) });
    this.#actors.push(new Actor(avatar, random.of(this.#motions)));
    if (random.oneIn(2)) this.#crowd.add(avatar);
  }

  #leave(actor) {
    if (this.#actors.length <= 2) return;
    this.#crowd.remove(actor.avatar);
    actor.avatar.dispose();
    this.#actors = this.#actors.filter((other) => other !== actor);
  }
}

/** Loads a model and begins a walk. */
export async function beginWalk({ sdk, model, seed }) {
  const module = await import(sdk);
  const loaded = await module.load({ model });
  return new Walk(module, loaded, seed);
}
