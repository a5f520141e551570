import { type Avatar, POSE_LENGTH, type Pose, restPose } from "dynaskin";
import type { Playable } from "./by-hand.js";

/** Seconds of motion that are stepped through before a moment that is jumped to. */
const WARM_UP_SECONDS = 2;
const TICK_SECONDS = 1 / 60;
/** Longest part of a motion that one display frame may advance, after a stall. */
const MAX_FRAME_SECONDS = 0.25;
/** Time in which a body goes over into the rest pose, slow enough to be no jump. */
const TO_REST_SECONDS = 1;

/** A moment that avatars have been brought to. */
export interface Moment {
  timeSeconds: number;
  /** Whether it is the first of a row. */
  isFirst: boolean;
  /** Whether it only lies on the way to one that is jumped to, and is never seen. */
  isPassing: boolean;
}

/** Is told each moment. */
export type AfterStep = (avatars: readonly Avatar[], moment: Moment) => void;

/**
 * Plays a motion on avatars: the clock of the page, with pause, slow motion and jumps. It owns the
 * motion and disposes it when another takes its place; the avatars are the caller's.
 */
export class Playback {
  /** Playback speed; 1 is real time. The tissue slows down with the skeleton. */
  speed = 1;
  /** Whether the clock stands still. */
  paused = false;
  /** The part of the motion that plays over and over, its end like its beginning; null: all of it. */
  loop: { readonly fromSeconds: number; readonly periodSeconds: number } | null = null;
  /** How often the motion has been played to its end. */
  rounds = 0;
  /** The pose last given to the avatar. */
  readonly pose: Pose = new Float64Array(POSE_LENGTH);
  #timeSeconds = 0;
  readonly #afterStep: AfterStep;
  #avatars: readonly Avatar[];
  #motion: Playable;

  constructor(avatars: readonly Avatar[], motion: Playable, afterStep: AfterStep) {
    this.#afterStep = afterStep;
    this.#avatars = avatars;
    this.#motion = motion;
    this.seek(0);
  }

  /** Where in the motion it is, in seconds. */
  get timeSeconds(): number {
    return this.#timeSeconds;
  }

  /** The motion that plays. */
  get motion(): Playable {
    return this.#motion;
  }

  /** The avatars it plays on, at least one. */
  get avatars(): readonly Avatar[] {
    return this.#avatars;
  }

  /** The first of them. */
  get avatar(): Avatar {
    const [first] = this.#avatars;
    if (!first) throw new Error("A playback needs an avatar.");
    return first;
  }

  /** Plays another motion from its beginning. If the avatar refuses it, this one goes on. */
  setMotion(motion: Playable): void {
    this.#replace(this.#avatars, motion, 0);
    this.rounds = 0;
  }

  /** Goes on with other avatars at the same moment. If that fails, the present ones go on. */
  setAvatars(avatars: readonly Avatar[], motion: Playable): void {
    this.#replace(avatars, motion, Math.min(this.#timeSeconds, motion.durationSeconds));
  }

  #replace(avatars: readonly Avatar[], motion: Playable, timeSeconds: number): void {
    const before = {
      avatars: this.#avatars,
      motion: this.#motion,
      timeSeconds: this.#timeSeconds,
    };
    this.#avatars = avatars;
    this.#motion = motion;
    try {
      this.seek(timeSeconds);
    } catch (error) {
      this.#avatars = before.avatars;
      this.#motion = before.motion;
      motion.dispose();
      this.seek(before.timeSeconds);
      throw error;
    }
    before.motion.dispose();
  }

  /** Advances by a display frame of `elapsedSeconds` of real time. */
  frame(elapsedSeconds: number): void {
    if (this.paused) return;
    this.advance(Math.min(elapsedSeconds, MAX_FRAME_SECONDS) * this.speed);
  }

  /** Advances by `seconds` of motion. A motion that ends starts again, with settled tissue. */
  advance(seconds: number): void {
    const { durationSeconds } = this.#motion;
    let next = this.#timeSeconds + seconds;
    if (this.loop && next >= this.loop.fromSeconds + this.loop.periodSeconds) {
      // The tissue swings on: nothing jumps.
      next -= this.loop.periodSeconds;
      this.rounds += 1;
    }
    if (next >= durationSeconds) {
      this.rounds += 1;
      this.#start(0);
      return;
    }
    this.#apply(next, seconds);
  }

  /** One tick of the model's clock, 1/60 s. */
  step(): void {
    this.advance(TICK_SECONDS);
  }

  /** One tick in the present pose. */
  hold(): void {
    for (const avatar of this.#avatars) avatar.step(this.pose, TICK_SECONDS);
    this.#afterStep(this.#avatars, {
      timeSeconds: this.#timeSeconds,
      isFirst: false,
      isPassing: false,
    });
  }

  /** Goes over into the rest pose, on the spot, and stands in it for `seconds`. */
  standAtRest(seconds: number): void {
    const from = this.pose.slice();
    const rest = restPose();
    rest.set(from.subarray(0, 3));
    const ticks = Math.round(TO_REST_SECONDS / TICK_SECONDS);
    for (let tick = 1; tick <= ticks; tick += 1) {
      blendPoses(from, rest, smooth(tick / ticks), this.pose);
      this.hold();
    }
    for (let tick = 0; tick < seconds / TICK_SECONDS; tick += 1) this.hold();
  }

  /**
   * Jumps to a moment, with the tissue as if the motion had been playing for two seconds (or from
   * its beginning, when that is nearer, or from `fromSeconds`). The same call gives the same skin.
   */
  seek(timeSeconds: number, fromSeconds = Math.max(0, timeSeconds - WARM_UP_SECONDS)): void {
    const ticks = Math.round((timeSeconds - fromSeconds) / TICK_SECONDS);
    this.#start(timeSeconds - ticks * TICK_SECONDS, ticks > 0);
    for (let tick = 1; tick <= ticks; tick += 1) {
      const isPassing = tick < ticks;
      this.#apply(timeSeconds - (ticks - tick) * TICK_SECONDS, TICK_SECONDS, { isPassing });
    }
  }

  /** Gives the avatar the present pose again, after its shape or a gain changed. */
  refresh(): void {
    this.#apply(this.#timeSeconds, 0);
  }

  #start(timeSeconds: number, isPassing = false): void {
    for (const avatar of this.#avatars) avatar.reset();
    this.#apply(timeSeconds, 0, { isFirst: true, isPassing });
  }

  #apply(
    timeSeconds: number,
    dtSeconds: number,
    { isFirst = false, isPassing = false }: Partial<Moment> = {},
  ): void {
    this.#timeSeconds = Math.max(0, timeSeconds);
    this.#motion.poseAt(this.#timeSeconds, this.pose);
    for (const avatar of this.#avatars) avatar.step(this.pose, dtSeconds);
    this.#afterStep(this.#avatars, { timeSeconds: this.#timeSeconds, isFirst, isPassing });
  }
}

/** 0 to 1 with no speed at either end. */
function smooth(share: number): number {
  return share * share * (3 - 2 * share);
}

/** The pose `share` of the way from one to another; rotations by normalised interpolation. */
function blendPoses(from: Pose, to: Pose, share: number, out: Pose): void {
  const mix = (a: number, b: number) => a + (b - a) * share;
  for (let idx = 0; idx < 3; idx += 1) out[idx] = mix(from[idx] ?? 0, to[idx] ?? 0);
  for (let at = 3; at < POSE_LENGTH; at += 4) {
    const a = from.subarray(at, at + 4);
    const b = to.subarray(at, at + 4);
    // A quaternion and its negative are the same rotation; the nearer one is the short way.
    const sign = a.reduce((sum, value, idx) => sum + value * (b[idx] ?? 0), 0) < 0 ? -1 : 1;
    const mixed = a.map((value, idx) => mix(value, sign * (b[idx] ?? 0)));
    const length = Math.hypot(...mixed);
    for (const [idx, value] of mixed.entries()) out[at + idx] = value / length;
  }
}
