import { type Avatar, Motion } from "dynaskin";
import { ByHand, type Playable } from "./by-hand.js";
import type { PlayedInstead } from "./code.js";
import { findMotion, motionLabel, motionOptions } from "./motions.js";
import type { Settings } from "./settings.js";
import { clipLabel, type TruthClip } from "./truth.js";

/** A motion file's name and content, to make its motion again for another body or shape. */
export interface MotionFile {
  name: string;
  bytes: Uint8Array;
}

/** What plays: a file, a clip of the simulator, or the settings' motion, which may be a hand. */
export class Program {
  /** The file that plays; null: none. */
  file: MotionFile | null = null;
  /** The clip that plays where no file does; null: none. */
  truth: TruthClip | null = null;
  readonly #settings: Settings;
  /** What played before the file, to go back to if the avatar refuses one of its poses. */
  #fileBefore: MotionFile | null = null;

  constructor(settings: Settings) {
    this.#settings = settings;
  }

  /** What the page calls it. */
  get label(): string {
    if (this.file) return this.file.name;
    if (this.truth) return `${clipLabel(this.truth.name)}, simulated`;
    return motionLabel(this.#settings.motion);
  }

  /** What plays instead of the settings' motion, for a program that does the same. */
  get played(): PlayedInstead {
    const { file, truth } = this;
    const clip = truth && { ...truth.formula, shape: truth.shape };
    return { fileName: file?.name ?? null, clip };
  }

  /** The shape that the body must have: the clip's own, or the settings'. */
  get shape(): readonly number[] {
    return this.truth && !this.file ? this.truth.shape : this.#settings.shape;
  }

  /** Plays a file from now on. */
  setFile(file: MotionFile): void {
    this.#fileBefore = this.file;
    this.file = file;
  }

  /** Plays no file from now on. */
  clearFile(): void {
    this.file = null;
    this.#fileBefore = null;
  }

  /** Goes back from a file that was refused to what played before, and returns it. */
  refuseFile(): MotionFile | null {
    const refused = this.file;
    this.file = this.#fileBefore;
    this.#fileBefore = null;
    return refused;
  }

  /** Makes the motion for an avatar's present shape. */
  makeMotion(avatar: Avatar): Playable {
    if (this.file) return Motion.fromFile(this.file.bytes, avatar);
    if (this.truth) {
      const { poses, rateHz, name } = this.truth;
      return Motion.fromPoses(poses, rateHz, avatar, name);
    }
    const { motion, tempoHz, heightM } = this.#settings;
    const choice = findMotion(motion);
    if (!choice) return new ByHand(avatar);
    return Motion.procedural(choice.name, avatar, motionOptions(choice, tempoHz, heightM));
  }
}
