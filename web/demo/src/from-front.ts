import { type Pose, restPose } from "dynaskin";
import type { Playable } from "./by-hand.js";

/** When a body shows where it faces: the first frame of a file is often of a calibration. */
const BEGUN_SECONDS = 0.5;

/**
 * A motion, turned about the vertical so that its body faces +Z at its beginning, as the built-in ones do: a file may
 * begin with its back to the camera and to the light.
 */
export class FromFront implements Playable {
  readonly #motion: Playable;
  readonly #turnRadians: number;

  /** Takes the motion over. */
  constructor(motion: Playable) {
    this.#motion = motion;
    const first = restPose();
    motion.poseAt(Math.min(BEGUN_SECONDS, motion.durationSeconds / 2), first);
    const [x = 0, y = 0, z = 0, w = 1] = first.subarray(3, 7);
    this.#turnRadians = -Math.atan2(2 * (x * z + w * y), 1 - 2 * (x * x + y * y));
  }

  get durationSeconds(): number {
    return this.#motion.durationSeconds;
  }

  poseAt(timeSeconds: number, out: Pose): void {
    this.#motion.poseAt(timeSeconds, out);
    const [x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1] = out;
    const [sin, cos] = [Math.sin(this.#turnRadians), Math.cos(this.#turnRadians)];
    out.set([cos * x + sin * z, y, cos * z - sin * x]);
    const [half, rest] = [Math.sin(this.#turnRadians / 2), Math.cos(this.#turnRadians / 2)];
    out.set(
      [rest * qx + half * qz, rest * qy + half * qw, rest * qz - half * qx, rest * qw - half * qy],
      3,
    );
  }

  dispose(): void {
    this.#motion.dispose();
  }
}
