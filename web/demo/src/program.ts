import { type Avatar, Motion, type Shape } from "dynaskin";
import { ByHand, type Playable } from "./by-hand.js";
import { storyFigure } from "./chapters.js";
import type { PlayedInstead } from "./code.js";
import { findMotion, type MotionFile, motionLabel, motionOptions } from "./motions.js";
import type { PageStore } from "./state.js";
import { clipLabel } from "./truth.js";

/** What plays: a file, a clip of the simulator, or the settings' motion, which may be a hand. */
export class Program {
  readonly #store: PageStore;

  constructor(store: PageStore) {
    this.#store = store;
  }

  /** What the page calls it. */
  get label(): string {
    const { file, truth, motion } = this.#store.state;
    if (file) return file.name;
    return truth ? `${clipLabel(truth.name)}, simulated` : motionLabel(motion);
  }

  /** What plays instead of the settings' motion, for a program that does the same. */
  get played(): PlayedInstead {
    const { file, truth } = this.#store.state;
    const clip = truth && { ...truth.formula, shape: truth.shape };
    return { fileName: file?.name ?? null, clip };
  }

  /** The shape that the body must have: the clip's own, the story's, or the settings'. */
  get shape(): Shape {
    const { file, truth, chapter, sex, shape } = this.#store.state;
    if (chapter) return storyFigure(sex);
    return truth && !file ? truth.shape : shape;
  }

  /** Plays a file from now on. */
  setFile(file: MotionFile): void {
    this.#store.change({ file, fileBefore: this.#store.state.file });
  }

  /** Goes back from a file that was refused to what played before, and returns it. */
  refuseFile(): MotionFile | null {
    const { file, fileBefore } = this.#store.state;
    this.#store.change({ file: fileBefore, fileBefore: null });
    return file;
  }

  /** Makes the motion for an avatar's present shape. */
  makeMotion(avatar: Avatar): Playable {
    const { file, truth, motion, tempoHz, heightM } = this.#store.state;
    if (file) return Motion.fromFile(file.bytes, avatar).turnToFront();
    if (truth) return Motion.fromPoses(truth.poses, truth.rateHz, avatar, truth.name);
    const choice = findMotion(motion);
    if (!choice) return new ByHand(avatar);
    return Motion.procedural(choice.name, avatar, motionOptions(choice, tempoHz, heightM));
  }
}
