import { type Avatar, type Grip, type Pose, Puppet } from "dynaskin";

/** The menu's name of the body that is moved by hand. */
export const BY_HAND = "by-hand";

/** Poses over time: a motion of the SDK, or a hand. */
export interface Playable {
  /** Length in seconds; infinite for what goes on. */
  readonly durationSeconds: number;
  /** Writes the pose at a time into `out`. */
  poseAt(timeSeconds: number, out: Pose): unknown;
  /** Frees its memory. */
  dispose(): void;
}

/** A body that is moved by hand, played as if it were a motion without an end. */
export class ByHand implements Playable {
  readonly durationSeconds = Number.POSITIVE_INFINITY;
  readonly #puppet: Puppet;
  #timeSeconds = 0;
  /** Whether another motion has taken its place, which a hand on a ring learns of with the next picture. */
  #isGone = false;

  constructor(avatar: Avatar) {
    this.#puppet = new Puppet(avatar);
  }

  /** Moves on to a later time; an earlier one only sets the clock, since a hand cannot go back. */
  poseAt(timeSeconds: number, out: Pose): void {
    const seconds = Math.max(0, timeSeconds - this.#timeSeconds);
    this.#timeSeconds = timeSeconds;
    this.#puppet.step(seconds, out);
  }

  /** Where a part is, in the world, in metres. */
  placeOf(grip: Grip): [x: number, y: number, z: number] {
    return this.#puppet.placeOf(grip);
  }

  /** Holds a part and pulls it from where it stands, in metres along the world's axes. */
  hold(grip: Grip, pullM: readonly number[]): void {
    if (!this.#isGone) this.#puppet.hold(grip, pullM);
  }

  /** Lets go. */
  release(): void {
    if (!this.#isGone) this.#puppet.release();
  }

  dispose(): void {
    this.#isGone = true;
    this.#puppet.dispose();
  }
}
