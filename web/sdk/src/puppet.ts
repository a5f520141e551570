import { Avatar } from "./avatar.js";
import { checkNumber } from "./check.js";
import type { Core } from "./core.js";
import { DynaSkinError } from "./error.js";
import { checkLength, POSE_LENGTH, type Pose } from "./pose.js";
import type { CorePuppet } from "./wasm/core.js";

/** The parts of a {@link Puppet} that can be held. */
export const GRIPS = ["pelvis", "chest"] as const;

/** Name of a part of a {@link Puppet} that can be held. */
export type Grip = (typeof GRIPS)[number];

/**
 * A standing body that is moved by hand: hold its pelvis or chest, pull, let go. The rest of the body
 * follows on damped springs, and the feet stay on the floor until the legs are stretched. After release
 * it swings back to where it stood. It makes poses for {@link Avatar.step}, in place of a motion.
 *
 * It fits the avatar's present shape: after a change of shape, make it again.
 */
export class Puppet {
  readonly #core: Core;
  #raw: CorePuppet | null;

  /**
   * @throws DynaSkinError `argument` if `avatar` is not an avatar, `motion` for a body that does not stand
   */
  constructor(avatar: Avatar) {
    if (!(avatar instanceof Avatar)) {
      throw new DynaSkinError("argument", "A puppet needs an avatar, as createAvatar() gives it.");
    }
    this.#core = avatar.core;
    this.#raw = this.#core.guard(() => avatar.raw.puppet());
  }

  /** The part that is held; null while the body is free. */
  get held(): Grip | null {
    return (this.#core.guard(() => this.#alive.held) ?? null) as Grip | null;
  }

  /**
   * Holds a part and pulls it away from its position in the standing body. Call it again when the hand
   * moves. The further the pull, the less the body follows, so it stays within its reach.
   *
   * @param grip - the part
   * @param pullM - displacement `[x, y, z]` in metres, +Y up, the body facing +Z
   * @throws DynaSkinError `argument` for an unknown part or anything but an array of three numbers,
   *   `motion` for a number that is not finite
   */
  hold(grip: Grip, pullM: ArrayLike<number>): void {
    checkLength("pullM", pullM, 3);
    const [x, y, z] = Array.from(pullM) as [number, number, number];
    this.#core.guard(() => this.#alive.hold(checkGrip(grip), x, y, z));
  }

  /** Lets go. */
  release(): void {
    this.#core.guard(() => this.#alive.release());
  }

  /**
   * Advances the motion and writes the pose into `out`, which it returns. The path does not depend on the
   * display rate.
   *
   * @param dtSeconds - time since the last step in seconds; negative counts as 0, above 0.25 s as
   *   0.25 s
   * @throws DynaSkinError `argument` for an `out` of the wrong type or length, or a time that is not a
   *   finite number
   */
  step(dtSeconds: number, out: Pose = new Float64Array(POSE_LENGTH)): Pose {
    checkNumber("dtSeconds", dtSeconds);
    checkLength("out", out, POSE_LENGTH);
    if (!(out instanceof Float64Array)) {
      throw new DynaSkinError(
        "argument",
        "out must be a Float64Array: poses are double precision.",
      );
    }
    this.#core.guard(() => this.#alive.step(dtSeconds, out));
    return out;
  }

  /**
   * Present position of a part's joint in the world, in metres. Draw handles there.
   *
   * @throws DynaSkinError `argument` for an unknown part
   */
  placeOf(grip: Grip): [x: number, y: number, z: number] {
    const place = this.#core.guard(() => this.#alive.placeOf(checkGrip(grip)));
    return [place[0] ?? 0, place[1] ?? 0, place[2] ?? 0];
  }

  /** Frees the puppet's memory. May be called again. */
  dispose(): void {
    this.#core.free(this.#raw);
    this.#raw = null;
  }

  get #alive(): CorePuppet {
    if (this.#raw) return this.#raw;
    throw new DynaSkinError("disposed", "This puppet was used after dispose().");
  }
}

function checkGrip(grip: unknown): Grip {
  const found = GRIPS.find((name) => name === grip);
  if (found) return found;
  throw new DynaSkinError(
    "argument",
    `${String(grip)} cannot be held; there are ${GRIPS.join(", ")}.`,
  );
}
