import type { Avatar, RegionName } from "dynaskin";
import type { ActorKind } from "./actors.js";
import type { Cast } from "./cast.js";
import { RegionMeasures } from "./measures.js";
import type { AfterStep } from "./playing.js";
import type { Program } from "./program.js";
import type { Settings } from "./settings.js";
import { type Sample, Traces } from "./traces.js";
import type { Appearance } from "./view.js";

/** What is shown lies a tick behind the skeleton, so ground truth is shown and compared there, too. */
const DELAY_SECONDS = 1 / 60;

/** The actors while they move: how they are tuned, what is measured on them, how they look. */
export class Stage {
  readonly traces = new Traces();
  /** What the sliders of the tissue say. */
  readonly tuning = { strength: 1, gains: new Map<RegionName, number>() };
  readonly #settings: Settings;
  readonly #program: Program;
  readonly #kinds = new WeakMap<Avatar, ActorKind>();
  /** Differences from ground truth of the right and the left actor, for the heat map. */
  readonly #errorsM: Float32Array[] = [];
  #measures: RegionMeasures | null = null;
  #measuredCast: Cast | null = null;

  constructor(settings: Settings, program: Program) {
    this.#settings = settings;
    this.#program = program;
  }

  /** Makes avatars for actors, tuned; all or none. */
  createAvatars(cast: Cast, kinds: readonly ActorKind[]): Avatar[] {
    if (cast !== this.#measuredCast) {
      this.#measures = new RegionMeasures(cast.body);
      this.#measuredCast = cast;
    }
    const made: Avatar[] = [];
    try {
      for (const kind of kinds) {
        const avatar = cast.createAvatar(kind, this.#program.shape);
        made.push(avatar);
        this.#kinds.set(avatar, kind);
        this.tune(avatar);
      }
    } catch (error) {
      for (const avatar of made) avatar.dispose();
      throw error;
    }
    return made;
  }

  /** Gives an avatar the settings that are its own. */
  tune(avatar: Avatar): void {
    const { clothes, clip, dynamics } = this.#settings;
    avatar.setControls(clip === null && clothes === "sportswear" ? clothes : "as-predicted");
    const { regions } = avatar.controls;
    for (const [region, gain] of this.tuning.gains) {
      avatar.setRegionGain(region, regions[region].gain * gain);
    }
    // The networks run on, so that both states of the same moment can be compared.
    avatar.strength = dynamics ? this.tuning.strength : 0;
  }

  /** Whether the heat map shows the error. */
  get showsError(): boolean {
    return this.#settings.heatOf === "error" && this.#truthM !== null;
  }

  /** Shows ground truth where it is an actor, and measures all actors. */
  readonly afterStep: AfterStep = (avatars, timeSeconds, isFirst) => {
    const truth = this.#program.file ? null : this.#program.truth;
    truth?.moveTo(timeSeconds - DELAY_SECONDS);
    for (const avatar of avatars) {
      if (truth && this.#kinds.get(avatar) === "truth") avatar.showOffsets(truth.offsets);
    }
    if (this.#settings.plots) this.traces.add(this.#sample(avatars, timeSeconds), isFirst);
  };

  /** How the actors look now: the right one, then the left one where there are two. */
  appearances(avatars: readonly Avatar[]): Appearance[] {
    const truthM = this.showsError && this.#settings.heat ? this.#truthM : null;
    return avatars.map((avatar, idx) => {
      if (!truthM) return { avatar, heatM: null };
      const { offsets } = avatar;
      const errorM = this.#errorsM[idx] ?? new Float32Array(offsets.length);
      this.#errorsM[idx] = errorM;
      for (let at = 0; at < offsets.length; at += 1) {
        errorM[at] = (offsets[at] ?? 0) - (truthM[at] ?? 0);
      }
      return { avatar, heatM: errorM };
    });
  }

  get #truthM(): Float32Array | null {
    return this.#program.file ? null : (this.#program.truth?.offsets ?? null);
  }

  #sample([right, left]: readonly Avatar[], timeSeconds: number): Sample {
    const { region } = this.#settings;
    const truthM = this.#truthM;
    const heightMm = (avatar: Avatar | undefined) =>
      avatar ? (this.#measures?.heightMm(region, avatar.offsets) ?? null) : null;
    const errorMm = (avatar: Avatar | undefined) =>
      avatar && truthM ? (this.#measures?.errorMm(region, avatar.offsets, truthM) ?? null) : null;
    return {
      timeSeconds,
      heightMm: [heightMm(left), heightMm(right)],
      errorMm: [errorMm(left), errorMm(right)],
    };
  }
}
