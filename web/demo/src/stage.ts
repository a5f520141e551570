import type { Avatar } from "dynaskin";
import { SLOTS } from "./actors.js";
import type { Cast } from "./cast.js";
import type { Appearance, Place } from "./layer.js";
import { RegionMeasures } from "./measures.js";
import { START_YAW_RADIANS } from "./orbit.js";
import type { AfterStep } from "./playing.js";
import type { Program } from "./program.js";
import { aloneOf, isPlain, type PageStore, type Shown, showsError } from "./state.js";
import { tuneTissue } from "./tissue.js";
import { type Sample, Traces } from "./traces.js";

/** What is shown lies a tick behind the skeleton, so ground truth is shown and compared there, too. */
const DELAY_SECONDS = 1 / 60;

/** From one actor to the next where they stand beside each other: along x and z of the world, metres. */
const STEP_M = ((apartM) => [
  apartM * Math.cos(START_YAW_RADIANS),
  -apartM * Math.sin(START_YAW_RADIANS),
])(0.95) as [number, number];

/** SMPL's joint of the head. */
const HEAD_JOINT = 15;

/** The topmost vertex of a body that stands at rest; frees the avatar. */
function crownOf(avatar: Avatar): number {
  const { positions } = avatar;
  let crown = 0;
  for (let at = 1; at < positions.length; at += 3) {
    if ((positions[at] ?? 0) > (positions[crown * 3 + 1] ?? 0)) crown = (at - 1) / 3;
  }
  avatar.dispose();
  return crown;
}

/** The actors while they move: how they are tuned, what is measured on them, how they look. */
export class Stage {
  readonly traces = new Traces();
  readonly #store: PageStore;
  readonly #program: Program;
  readonly #shown = new WeakMap<Avatar, Shown>();
  /** Differences from ground truth of each actor, for the heat map. */
  readonly #errorsM: Float32Array[] = [];
  #crown = 0;
  #measures: RegionMeasures | null = null;
  #measuredCast: Cast | null = null;

  constructor(store: PageStore, program: Program) {
    this.#store = store;
    this.#program = program;
  }

  /** Makes avatars for actors, tuned; all or none. */
  createAvatars(cast: Cast, shown: readonly Shown[]): Avatar[] {
    if (cast !== this.#measuredCast) {
      this.#measures = new RegionMeasures(cast.body);
      this.#crown = crownOf(cast.body.createAvatar());
      this.#measuredCast = cast;
    }
    const made: Avatar[] = [];
    try {
      for (const actor of shown) {
        const avatar = cast.createAvatar(actor.kind, actor.shape ?? this.#program.shape);
        made.push(avatar);
        this.#shown.set(avatar, actor);
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
    const { state } = this.#store;
    const { clothes, clip, dynamics, strength, tissue } = state;
    tuneTissue(avatar, {
      preset: clip === null && clothes === "sportswear" ? clothes : "as-predicted",
      // The networks run on, so that both states of the same moment can be compared.
      strength: dynamics && !isPlain(state) ? strength : 0,
      tissue,
    });
  }

  /** Shows ground truth where it is an actor, and measures all actors. */
  readonly afterStep: AfterStep = (avatars, { timeSeconds, isFirst, isPassing }) => {
    const { state } = this.#store;
    if (isPassing && !state.plots) return;
    const truth = state.file ? null : state.truth;
    truth?.moveTo(timeSeconds - DELAY_SECONDS);
    for (const avatar of avatars) {
      if (!truth || this.#shown.get(avatar)?.kind !== "truth") continue;
      avatar.showOffsets(isPlain(state) ? new Float32Array(truth.offsets.length) : truth.offsets);
    }
    if (state.plots) this.traces.add(this.#sample(avatars, timeSeconds), isFirst);
  };

  /**
   * How far each of so many actors stands from where its pose is: along x and z of the world, in metres.
   * The row is parallel to the picture that the page starts with.
   */
  placesM(count: number): Place[] {
    const { state } = this.#store;
    const isRow = state.shownLayout === "side" && !state.isPaired && aloneOf(state) === null;
    const apart = isRow ? 1 : 0;
    return Array.from({ length: count }, (_, idx) => {
      const steps = apart * (idx - (count - 1) / 2);
      return [steps * STEP_M[0], steps * STEP_M[1]];
    });
  }

  /** Where the tops of the actors' heads are: in the world, in metres, without what sets them apart. */
  crownsM(avatars: readonly Avatar[]): [number, number, number][] {
    return avatars.map(({ positions, skinMatrices }) => {
      const rest = positions.subarray(this.#crown * 3, this.#crown * 3 + 3);
      const matrix = skinMatrices.subarray(HEAD_JOINT * 16, HEAD_JOINT * 16 + 16);
      const along = (axis: number) =>
        rest.reduce((sum, value, idx) => sum + value * (matrix[idx * 4 + axis] ?? 0), 0) +
        (matrix[12 + axis] ?? 0);
      return [along(0), along(1), along(2)];
    });
  }

  /** How the actors that are to be seen look now, in the order of the avatars. */
  appearances(avatars: readonly Avatar[]): Appearance[] {
    const looks = this.#allAppearances(avatars);
    const alone = aloneOf(this.#store.state);
    const only = alone === null ? undefined : looks[alone];
    return only ? [only] : looks;
  }

  #allAppearances(avatars: readonly Avatar[]): Appearance[] {
    const { state } = this.#store;
    const truthM = showsError(state) && state.heat ? this.#truthM : null;
    const places = this.placesM(avatars.length);
    return avatars.map((avatar, idx) => {
      const placeM = places[idx] ?? [0, 0];
      if (!truthM) return { avatar, heatM: null, placeM };
      const { offsets } = avatar;
      const errorM = this.#errorsM[idx] ?? new Float32Array(offsets.length);
      this.#errorsM[idx] = errorM;
      for (let at = 0; at < offsets.length; at += 1) {
        errorM[at] = (offsets[at] ?? 0) - (truthM[at] ?? 0);
      }
      return { avatar, heatM: errorM, placeM };
    });
  }

  get #truthM(): Float32Array | null {
    const { file, truth } = this.#store.state;
    return file ? null : (truth?.offsets ?? null);
  }

  #sample(avatars: readonly Avatar[], timeSeconds: number): Sample {
    const { region } = this.#store.state;
    const truthM = this.#truthM;
    const measure = (of: (avatar: Avatar) => number | undefined) =>
      SLOTS.map((slot) => {
        const avatar = avatars.find((candidate) => this.#shown.get(candidate)?.slot === slot);
        return (avatar && of(avatar)) ?? null;
      });
    return {
      timeSeconds,
      heightMm: measure(({ offsets }) => this.#measures?.heightMm(region, offsets)),
      errorMm: measure(({ offsets }) =>
        truthM ? this.#measures?.errorMm(region, offsets, truthM) : undefined,
      ),
    };
  }
}
