import { Avatar } from "./avatar.js";
import { checkNumber, checkObject } from "./check.js";
import type { Core } from "./core.js";
import { type Decoding, isCard } from "./decoding.js";
import { DynaSkinError } from "./error.js";
import { checkPoses, POSE_LENGTH, type Pose } from "./pose.js";
import type { CoreCrowd } from "./wasm/core.js";

/**
 * When avatars of a {@link Crowd} get less detail: `half` beyond one distance, `asleep` beyond
 * another, and less than that if all together would take too long. A higher level returns only
 * with a margin (10 % of the distance, 15 % of the budget), so that nothing flickers.
 */
export interface LevelOfDetail {
  /** Distance from the camera in metres beyond which avatars have half detail; by default 12, or `asleepBeyondM` if that is nearer. */
  halfBeyondM?: number;
  /** Distance from the camera in metres beyond which avatars are asleep; by default 40, or `halfBeyondM` if that is farther. */
  asleepBeyondM?: number;
  /**
   * Milliseconds that all tissue together may take per tick (1/60 s): if it takes more, the
   * farthest avatars get less detail. Decided every 30 steps by measured times, so the result
   * depends on the machine. No limit if left out.
   */
  budgetMs?: number;
}

/** What the last {@link Crowd.stepAll} did. */
export interface CrowdReport {
  /** Visible avatars at full detail. */
  full: number;
  /** Visible avatars at half detail. */
  half: number;
  /** Avatars asleep or out of sight. */
  asleep: number;
  /** Motion features of all avatars, milliseconds. */
  featuresMs: number;
  /** The predictor, milliseconds. */
  predictMs: number;
  /** The decoder, milliseconds. */
  decodeMs: number;
  /** Gains, limits, positions and normals, milliseconds. */
  applyMs: number;
  /** Skin matrices, milliseconds. */
  skinMs: number;
}

/**
 * Avatars of one model that are stepped by one call: each network runs once for all of them, so an
 * avatar costs less than alone. What it shows is the same to rounding. Made by
 * {@link Model.createCrowd}.
 */
export class Crowd {
  readonly #core: Core;
  readonly #defaults: [number, number];
  /** Replaced, never changed: whoever goes through it may take avatars out. */
  #avatars: readonly Avatar[] = [];
  #raw: CoreCrowd | null;
  #poses = new Float64Array(0);
  #levelOfDetail: LevelOfDetail | null = null;
  #decoding: Decoding | null = null;

  /** @internal */
  constructor(core: Core, raw: CoreCrowd) {
    this.#core = core;
    this.#raw = raw;
    const [half = 0, asleep = 0] = core.glue.CoreCrowd.defaultDistances();
    this.#defaults = [half, asleep];
  }

  get #alive(): CoreCrowd {
    if (this.#raw) {
      this.#core.assertSound();
      return this.#raw;
    }
    throw new DynaSkinError("disposed", "This crowd was used after dispose().");
  }

  /**
   * The avatars in the order in which {@link stepAll} takes their poses. A frozen array; another one
   * after {@link add} and {@link remove}.
   */
  get avatars(): readonly Avatar[] {
    return this.#avatars;
  }

  /**
   * Adds an avatar at the end. It may be stepped alone as well, between two steps of the crowd.
   *
   * @throws DynaSkinError `argument` for what is no avatar and for one that is in it already;
   *   {@link stepAll} throws it for one of another model
   */
  add(avatar: Avatar): void {
    if (!(avatar instanceof Avatar)) {
      throw new DynaSkinError("argument", "A crowd takes avatars, as createAvatar() gives them.");
    }
    this.#core.guard(() => this.#alive.add(avatar.raw));
    if (this.#decoding !== null) avatar.decoding = this.#decoding;
    this.#avatars = Object.freeze([...this.#avatars, avatar]);
    this.#poses = new Float64Array(0);
  }

  /** Removes an avatar, which may be disposed; those after it move up. Returns whether it was in the crowd. */
  remove(avatar: Avatar): boolean {
    const idx = this.#avatars.indexOf(avatar);
    if (idx < 0) return false;
    this.#core.guard(() => this.#alive.remove(idx));
    this.#avatars = Object.freeze(this.#avatars.filter((other) => other !== avatar));
    this.#poses = new Float64Array(0);
    return true;
  }

  /**
   * Moves every avatar to its pose, `dtSeconds` after the last step, as {@link Avatar.step} does.
   *
   * @param poses - one {@link Pose} for each of {@link avatars}, in their order
   * @param dtSeconds - time since the last step in seconds, 0 to 86,400
   * @throws DynaSkinError `argument` for a wrong number or length, a time step that cannot be used
   *   or an avatar of another model, `pose` for a pose that cannot be used (the message says whose),
   *   `disposed` where one of the avatars was disposed; all avatars then stay as they were
   */
  stepAll(poses: readonly Pose[], dtSeconds: number): void {
    const raw = this.#alive;
    checkNumber("dtSeconds", dtSeconds);
    checkPoses(poses, this.#avatars);
    const target = this.#view(raw);
    for (const [idx, pose] of poses.entries()) target.set(pose, idx * POSE_LENGTH);
    this.#core.guard(() => raw.stepAll(dtSeconds));
  }

  #view(raw: CoreCrowd): Float64Array {
    if (this.#poses.buffer !== this.#core.memory.buffer) {
      const length = this.#avatars.length * POSE_LENGTH;
      const start = this.#core.guard(() => raw.posesPtr());
      this.#poses = new Float64Array(this.#core.memory.buffer, start, length);
    }
    return this.#poses;
  }

  /**
   * When avatars get less detail, by their {@link Avatar.distanceM}; null, the default, keeps the
   * {@link Avatar.detail} that you set. Numbers that contradict each other throw `argument`.
   */
  get levelOfDetail(): LevelOfDetail | null {
    return this.#levelOfDetail && { ...this.#levelOfDetail };
  }

  set levelOfDetail(change: LevelOfDetail | null) {
    const raw = this.#alive;
    if (change === null) {
      this.#core.guard(() => raw.clearLevelOfDetail());
      this.#levelOfDetail = null;
      return;
    }
    checkObject("levelOfDetail", change);
    const [half, asleep] = this.#defaults;
    const { budgetMs } = change;
    // One distance that is given moves the other's default out of its way.
    const { halfBeyondM = Math.min(half, change.asleepBeyondM ?? half) } = change;
    const { asleepBeyondM = Math.max(asleep, change.halfBeyondM ?? asleep) } = change;
    checkNumber("halfBeyondM", halfBeyondM);
    checkNumber("asleepBeyondM", asleepBeyondM);
    if (budgetMs !== undefined) {
      checkNumber("budgetMs", budgetMs);
      if (Number.isNaN(budgetMs)) {
        throw new DynaSkinError("argument", "budgetMs is NaN; give milliseconds above 0.");
      }
    }
    this.#core.guard(() =>
      raw.setLevelOfDetail(halfBeyondM, asleepBeyondM, budgetMs ?? Number.NaN),
    );
    this.#levelOfDetail = {
      halfBeyondM,
      asleepBeyondM,
      ...(budgetMs === undefined ? {} : { budgetMs }),
    };
  }

  /**
   * Who decodes all avatars of the crowd, those that are added later included: sets their
   * {@link Avatar.decoding}. Null, the default, leaves each its own. Any other string throws `argument`.
   */
  get decoding(): Decoding | null {
    return this.#decoding;
  }

  set decoding(decoding: Decoding | null) {
    if (decoding !== null) {
      isCard(decoding);
      for (const avatar of this.#avatars) avatar.decoding = decoding;
    }
    this.#decoding = decoding;
  }

  /** What the last {@link stepAll} did and cost. */
  get report(): CrowdReport {
    const numbers = this.#core.guard(() => this.#alive.report());
    const [full = 0, half = 0, asleep = 0] = numbers;
    const [featuresMs = 0, predictMs = 0, decodeMs = 0, applyMs = 0, skinMs = 0] =
      numbers.subarray(3);
    return { full, half, asleep, featuresMs, predictMs, decodeMs, applyMs, skinMs };
  }

  /** Frees the crowd's memory; its avatars stay valid. May be called again. */
  dispose(): void {
    const raw = this.#raw;
    this.#raw = null;
    this.#avatars = [];
    this.#core.free(raw);
  }
}
