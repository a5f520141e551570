import type { RestBody } from "./adapter/vertex-map.js";
import type { RegionName } from "./bundle.js";
import { checkNumber, checkObject, checkState } from "./check.js";
import {
  type ControlChanges,
  type ControlPreset,
  type Controls,
  changedControls,
  controlsOf,
  regionIndex,
} from "./controls.js";
import { type Core, CoreArray } from "./core.js";
import {
  bodyTexelsOf,
  type DecoderMatrix,
  type Decoding,
  isCard,
  tablesOf,
  type Undecoded,
} from "./decoding.js";
import { checkDistance, type Detail, detailIndex, detailOf } from "./detail.js";
import { DynaSkinError } from "./error.js";
import { type Figure, figureNumbers, figureOf, isFigure, type Shape } from "./figure.js";
import { checkLength, POSE_LENGTH, type Pose, SHAPE_LENGTH } from "./pose.js";
import {
  type PoseSource,
  poseSourceIndex,
  poseSourceOf,
  type SourceReport,
  sourceReportOf,
} from "./pose-source.js";
import { isDualQuaternion, type Skinning, skinningOf } from "./skinning.js";
import type { CoreAvatar } from "./wasm/core.js";

/**
 * Why the tissue was settled: at the first pose or the first after {@link Avatar.reset} (`first-pose`),
 * after a step of more than 0.25 s (`stall`), because the body jumped (`cut`), or because the avatar was
 * asleep or not visible (`woken`). If every step says `stall`, the time steps are probably in milliseconds.
 */
export type SettledBecause = "first-pose" | "stall" | "cut" | "woken";

const SETTLED_BECAUSE = [null, "first-pose", "stall", "cut", "woken"] as const;

/** What the last {@link Avatar.step} cost, in milliseconds per stage. */
export interface StepTimings {
  /** Ticks of the network's 60 Hz clock in this step; often 0 on displays faster than 60 Hz. */
  ticks: number;
  /** Motion features, over all ticks. */
  featuresMs: number;
  /** The predictor, over all ticks. */
  predictMs: number;
  /** The decoder. */
  decodeMs: number;
  /** Gains, limits, positions and normals. */
  applyMs: number;
  /** Whether this step settled the tissue: the first step, after a jump of the pose or after a stall. */
  settled: boolean;
  /** Why it was settled; null if it was not. */
  settledBecause: SettledBecause | null;
  /** What the conditioner has detected about the pose source; steps of a crowd count, too. */
  source: SourceReport;
}

/** The surface after skinning, in the world. */
export interface SkinnedSurface {
  /** `[vertex][x, y, z]` flattened, metres. */
  positions: Float32Array;
  /** `[vertex][x, y, z]` flattened, unit length. */
  normals: Float32Array;
}

/**
 * One body that moves. Give it a pose each frame, then read what your engine needs:
 * {@link positions} and {@link normals} are inputs of skinning, {@link skinned} is the skinned
 * surface.
 *
 * The arrays are views into WebAssembly memory: read them at once, or copy them. A view that you
 * keep becomes empty when that memory grows; the properties always return a valid one.
 */
export class Avatar {
  readonly #arrays: Record<"offsets" | "positions" | "normals" | "skinMatrices", CoreArray>;
  /** Made with the first call of {@link skinned}: the core has none before. */
  #skinned: Record<keyof SkinnedSurface, CoreArray> | null = null;
  readonly #core: Core;
  readonly #matrix: (raw: CoreAvatar) => DecoderMatrix | null;
  #raw: CoreAvatar | null;
  #decoding: Decoding = "cpu";

  /** @internal */
  constructor(
    core: Core,
    raw: CoreAvatar,
    vertexCount: number,
    /** The body without shape; null where it was disposed of. @internal */
    readonly restBody: () => RestBody | null,
    matrix: (raw: CoreAvatar) => DecoderMatrix | null = () => null,
  ) {
    this.#matrix = matrix;
    this.#core = core;
    this.#raw = raw;
    const array = (locate: () => number, length: number) => new CoreArray(core, locate, length);
    const perVertex = vertexCount * 3;
    this.#arrays = {
      offsets: array(() => this.raw.offsetsPtr(), perVertex),
      positions: array(() => this.raw.positionsPtr(), perVertex),
      normals: array(() => this.raw.normalsPtr(), perVertex),
      skinMatrices: array(() => this.raw.skinMatricesPtr(), 24 * 16),
    };
  }

  /** @internal */
  get core(): Core {
    return this.#core;
  }

  /** @internal */
  get raw(): CoreAvatar {
    this.#assertAlive();
    this.#core.assertSound();
    return this.#raw as CoreAvatar;
  }

  /**
   * Moves the avatar to `pose`, `dtSeconds` after the last step; the tissue follows.
   *
   * The tissue has its own 60 Hz clock, so any display rate gives the same motion; it is one
   * sixtieth of a second behind the skeleton. The first step, a jump of the pose (a teleport, a cut)
   * and a step of more than 0.25 s (a stall, a hidden tab) start with settled tissue. After a jump
   * or a stall the previous offsets fade out over 0.2 s, so nothing pops. For slow motion, pass a
   * smaller `dtSeconds` along with slower poses; for a pause, pass 0 or do not step.
   *
   * @param pose - see {@link Pose}
   * @param dtSeconds - time since the last step in seconds (not milliseconds), 0 to 86,400; 0 only
   *   re-poses
   * @throws DynaSkinError `argument` for a wrong length or a time step that is negative, not finite
   *   or above a day, `pose` for numbers that are not finite or quaternions that are not of unit
   *   length; the avatar then stays unchanged
   */
  step(pose: Pose, dtSeconds: number): void {
    checkLength("pose", pose, POSE_LENGTH);
    checkNumber("dtSeconds", dtSeconds);
    this.#core.guard(() => this.raw.step(pose, dtSeconds));
  }

  /**
   * Soft-tissue offsets in the rest pose, before skinning: `[vertex][x, y, z]` flattened, metres.
   * Zero where the body is not soft.
   */
  get offsets(): Float32Array {
    return this.#view("offsets");
  }

  /** Rest-pose positions with pose correctives and offsets added: `[vertex][x, y, z]` flattened, metres. */
  get positions(): Float32Array {
    return this.#view("positions");
  }

  /** Unit normals of {@link positions}: `[vertex][x, y, z]` flattened. */
  get normals(): Float32Array {
    return this.#view("normals");
  }

  /**
   * Per joint the matrix from rest-pose to world coordinates, `[joint][16]` flattened, each
   * column-major as WebGL, WebGPU and three.js have them.
   */
  get skinMatrices(): Float32Array {
    return this.#view("skinMatrices");
  }

  /** Skins on the CPU, as {@link skinning} says, for hosts without a GPU and for tests. */
  skinned(): SkinnedSurface {
    this.#core.guard(() => this.raw.skin());
    const { length } = this.#arrays.positions;
    this.#skinned ??= {
      positions: new CoreArray(this.#core, () => this.raw.skinnedPositionsPtr(), length),
      normals: new CoreArray(this.#core, () => this.raw.skinnedNormalsPtr(), length),
    };
    const { positions, normals } = this.#skinned;
    return { positions: positions.view, normals: normals.view };
  }

  /** @internal */
  get disposed(): boolean {
    return this.#raw === null;
  }

  #view(name: "offsets" | "positions" | "normals" | "skinMatrices"): Float32Array {
    // A view of freed memory would show whatever is there now.
    this.#assertAlive();
    if (this.#decoding === "card" && name !== "skinMatrices") {
      this.#core.guard(() => this.raw.updateSurface());
    }
    return this.#arrays[name].view;
  }

  #assertAlive(): void {
    if (this.#raw === null) {
      throw new DynaSkinError("disposed", "This avatar was used after dispose().");
    }
  }

  /** Shape coefficients β in standard deviations, {@link SHAPE_LENGTH} of them. */
  get shape(): Float32Array {
    return this.#core.guard(() => this.raw.shape());
  }

  /**
   * Gives the avatar another shape, also while it moves: the surface follows at once, the tissue
   * keeps moving.
   *
   * @param shape - 10 coefficients in standard deviations, -5 to 5, the first is stature; or measures
   *   ({@link Figure}), which take some milliseconds
   * @throws DynaSkinError `argument` for a wrong length or an unknown measure, `shape` for numbers out of range or
   *   not finite, and for measures if the bundle has no `traits`; the avatar then keeps its shape
   */
  setShape(shape: Shape): void {
    if (isFigure(shape)) {
      const wish = figureNumbers(shape);
      this.#core.guard(() => this.raw.setShape(this.raw.shapeOf(wish)));
      return;
    }
    checkLength("shape", shape, SHAPE_LENGTH);
    this.#core.guard(() => this.raw.setShape(Float32Array.from(shape)));
  }

  /**
   * The body's measures: weight, stature and chest of its surface, and the average muscle and age of bodies
   * with its shape. Null if the bundle has no `traits`.
   */
  get figure(): Required<Figure> | null {
    return this.#core.guard(() => figureOf(this.raw.figure()));
  }

  /**
   * Changes with every {@link setShape} and {@link restore}. Compare it in every frame to notice a change
   * of the shape; reading ten coefficients would allocate.
   */
  get revision(): number {
    return this.#core.guard(() => this.raw.revision);
  }

  /** Rest positions of the 24 joints for the present shape: `[joint][x, y, z]` flattened, metres. A copy. */
  restJointsM(): Float32Array {
    return this.#core.guard(() => this.raw.jointsRest());
  }

  /**
   * Whether the networks run. Off, the avatar is plain skinning and costs nothing;
   * switching back on starts with settled tissue. To compare the same moment with and without
   * tissue, set {@link strength} to 0 instead. Always off on an avatar of a {@link Body}, which has
   * no networks.
   */
  get dynamics(): boolean {
    return this.#core.guard(() => this.raw.dynamics);
  }

  set dynamics(on: boolean) {
    this.#core.guard(() => {
      this.raw.dynamics = Boolean(on);
    });
  }

  /**
   * Factor on all offsets, 0 to 4; 1 is as predicted. Takes effect at once, also between steps.
   * Other numbers throw `argument`.
   */
  get strength(): number {
    return this.#core.guard(() => this.raw.strength);
  }

  set strength(factor: number) {
    checkNumber("strength", factor);
    this.#core.guard(() => {
      this.raw.strength = factor;
    });
  }

  /**
   * How far neighbouring vertices of soft skin may move relative to each other, as a share of their distance,
   * 0.05 to 4; null, the default, for no limit. With 0.6 no skin folds or turns inside out for any controls
   * and shape, and skin within the limit does not change. Takes effect at once, costs a fraction of a step,
   * and is not part of a saved state. Other numbers throw `argument`.
   */
  get maxStrain(): number | null {
    return this.#core.guard(() => this.raw.maxStrain ?? null);
  }

  set maxStrain(share: number | null) {
    if (share !== null) checkNumber("maxStrain", share);
    this.#core.guard(() => {
      this.raw.maxStrain = share ?? undefined;
    });
  }

  /**
   * Whether pose correctives (SMPL's pose blend shapes) are added to {@link positions}, before skinning, with
   * every step. Only bodies made by `dynaskin body import` have them; on others this is false and
   * setting it changes nothing. Takes effect at once, and is not part of a saved state.
   */
  get poseCorrectives(): boolean {
    return this.#core.guard(() => this.raw.poseCorrectives);
  }

  set poseCorrectives(on: boolean) {
    this.#core.guard(() => {
      this.raw.poseCorrectives = Boolean(on);
    });
  }

  /**
   * How {@link skinned}, `dynaskin/renderer` and the adapters' `DynaSkin` blend the motions of the joints;
   * `linear` by default. The tissue is added in the rest pose, before skinning, so {@link positions} and
   * {@link offsets} do not depend on it. Takes effect at once, and is not part of a saved state. Other
   * strings throw `argument`.
   */
  get skinning(): Skinning {
    return skinningOf(this.#core.guard(() => this.raw.dualQuaternions));
  }

  set skinning(skinning: Skinning) {
    const isDual = isDualQuaternion(skinning);
    this.#core.guard(() => {
      this.raw.dualQuaternions = isDual;
    });
  }

  /**
   * Factor on the offsets of one region, blended at its border; 1 is as predicted.
   *
   * @throws DynaSkinError `argument` for an unknown region or a factor outside 0 to 4
   */
  setRegionGain(region: RegionName, factor: number): void {
    const idx = regionIndex(region);
    checkNumber("factor", factor);
    this.#core.guard(() => this.raw.setRegionGain(idx, factor));
  }

  /** All controls as they are now: a copy. */
  get controls(): Controls {
    return controlsOf(this.#core.guard(() => this.raw.controls()));
  }

  /**
   * Changes some controls, or applies a preset. Takes effect at once, also between steps; a change
   * of stiffness or damping takes effect with the next step.
   *
   * @param change - what to change, or a preset that replaces all
   * @throws DynaSkinError `argument` for a number out of range, or an unknown control, region or preset; the
   *   avatar then keeps its controls
   */
  setControls(change: ControlChanges | ControlPreset): void {
    if (typeof change !== "string") checkObject("change", change);
    this.#core.guard(() => {
      const numbers =
        typeof change === "string"
          ? this.#core.glue.CoreAvatar.controlPreset(change)
          : changedControls(this.raw.controls(), change);
      this.raw.setControls(numbers);
    });
  }

  /**
   * Shows offsets of your own, such as recorded or simulated ones, on an avatar made by
   * {@link Body.createAvatar}: positions and normals follow at once. They stay until the next call, so
   * pass them with every step, and again after {@link setShape}. Controls do not change them.
   *
   * @param offsetsM - for every vertex of the body, in the rest pose: `[vertex][x, y, z]` flattened,
   *   metres
   * @throws DynaSkinError `argument` for another length, numbers that are not finite, and on an avatar
   *   with networks; the surface then stays unchanged
   */
  showOffsets(offsetsM: Float32Array): void {
    if (!(offsetsM instanceof Float32Array)) {
      throw new DynaSkinError(
        "argument",
        "showOffsets takes a Float32Array, three numbers a vertex.",
      );
    }
    checkLength("offsetsM", offsetsM, this.#arrays.offsets.length);
    this.#core.guard(() => this.raw.showOffsets(offsetsM));
  }

  /**
   * Size of the avatar in the world: metres of the world per metre of the body, 0.1 to 10.
   * The translation of poses is in metres of the world, and {@link skinMatrices} and
   * {@link skinned} have that size, while {@link offsets} and {@link positions} stay those of the
   * body in its own size. The inputs of the networks are in lengths of the body: a doll and a giant with
   * poses to scale move alike. May change while the avatar moves; other numbers throw `argument`.
   */
  get scale(): number {
    return this.#core.guard(() => this.raw.scale);
  }

  set scale(factor: number) {
    checkNumber("scale", factor);
    this.#core.guard(() => {
      this.raw.scale = factor;
    });
  }

  /**
   * Level of detail of the tissue; see {@link Detail}. A {@link Crowd} with a level of detail
   * sets it. Any other string throws `argument`.
   */
  get detail(): Detail {
    return detailOf(this.#core.guard(() => this.raw.detail));
  }

  set detail(detail: Detail) {
    const idx = detailIndex(detail);
    this.#core.guard(() => {
      this.raw.detail = idx;
    });
  }

  /**
   * Who turns what the network predicts into offsets; see {@link Decoding}. `cpu` by default. May change while the
   * avatar moves; what it shows stays the same. Any other string throws `argument`.
   */
  get decoding(): Decoding {
    return this.#decoding;
  }

  set decoding(decoding: Decoding) {
    const onDemand = isCard(decoding);
    this.#core.guard(() => {
      this.raw.decodesOnDemand = onDemand;
    });
    this.#decoding = decoding;
  }

  /**
   * Whether the last step left decoding to the card; otherwise it decoded, because {@link decoding} says so or
   * the card cannot.
   */
  get isLeftToCard(): boolean {
    return this.#core.guard(() => this.raw.undecodedPtr() !== 0);
  }

  /**
   * What a renderer decodes it from; null where the arrays of the surface are to be used.
   *
   * @internal
   */
  get undecoded(): Undecoded | null {
    if (this.#decoding === "cpu") return null;
    return this.#core.guard(() => {
      const { raw } = this;
      const start = raw.undecodedPtr();
      const matrix = start === 0 ? null : this.#matrix(raw);
      if (matrix === null) return null;
      return {
        matrix,
        latents: () => new Float32Array(this.#core.memory.buffer, start, matrix.latentCount),
        surfaceRevision: raw.surfaceRevision,
        constantsRevision: `${raw.revision} ${raw.controlsRevision}`,
        constants: () => ({
          stillPositions: raw.stillPositions(),
          vertexControls: raw.vertexControls(),
        }),
        bodyTexels: () => this.#core.guard(() => bodyTexelsOf(raw)),
        tables: () => this.#core.guard(() => tablesOf(raw)),
      };
    });
  }

  /**
   * Where the poses come from; see {@link PoseSource}. The step after a change counts as the first.
   * `timings.source` has what was detected about the source, the latency of the tissue, and the source
   * that would help. Any other string throws `argument`.
   */
  get poseSource(): PoseSource {
    return poseSourceOf(this.#core.guard(() => this.raw.poseSource));
  }

  set poseSource(source: PoseSource) {
    const idx = poseSourceIndex(source);
    this.#core.guard(() => {
      this.raw.poseSource = idx;
    });
  }

  /**
   * Whether the avatar is visible; set it to false while it is off the screen. Its tissue then costs
   * nothing and its surface does not change. Steps still move the skeleton, but may be left
   * out. The first step after it is visible again shows tissue that is settled in that step's pose.
   */
  get visible(): boolean {
    return this.#core.guard(() => this.raw.visible);
  }

  set visible(visible: boolean) {
    this.#core.guard(() => {
      this.raw.visible = Boolean(visible);
    });
  }

  /**
   * Distance from the camera in metres, 0 by default; a {@link Crowd} chooses the {@link detail} by it.
   * A negative number or NaN throws `argument`.
   */
  get distanceM(): number {
    return this.#core.guard(() => this.raw.distanceM);
  }

  set distanceM(metres: number) {
    checkDistance(metres);
    this.#core.guard(() => {
      this.raw.distanceM = metres;
    });
  }

  /**
   * The next step counts as the first: it shows settled tissue at once, without a fade. A teleport is
   * recognised without it.
   */
  reset(): void {
    this.#core.guard(() => this.raw.reset());
  }

  /**
   * The avatar's state: shape, scale, controls, clock and tissue, in about 100 KB. After
   * {@link restore} the same poses and time steps give the same numbers, bit for bit. If poses repeat, or
   * come from a `tracker` or a `network`, the state does not include poses that have not reached the tissue:
   * the first step after {@link restore} starts with settled tissue. {@link poseSource}, {@link detail} and
   * {@link visible} belong to the page and do not change.
   */
  save(): Uint8Array {
    return this.#core.guard(() => this.raw.save());
  }

  /**
   * Continues from where {@link save} was called, on this avatar or another of the same model.
   *
   * @param state - the bytes that {@link save} returned
   * @throws DynaSkinError `state` for bytes that were changed, truncated, or saved by another version or
   *   with another model, `argument` for anything but bytes; the avatar then stays unchanged
   */
  restore(state: Uint8Array): void {
    checkState(state);
    this.#core.guard(() => this.raw.restore(state));
  }

  /** What the last {@link step} cost. */
  get timings(): StepTimings {
    const [ticks = 0, featuresMs = 0, predictMs = 0, decodeMs = 0, applyMs = 0, settled = 0] =
      this.#core.guard(() => this.raw.timings());
    const source = sourceReportOf(this.#core.guard(() => this.raw.sourceDiagnosis()));
    const settledBecause = SETTLED_BECAUSE[settled] ?? null;
    return {
      ticks,
      featuresMs,
      predictMs,
      decodeMs,
      applyMs,
      settled: settled !== 0,
      settledBecause,
      source,
    };
  }

  /** Frees the avatar's memory. May be called again; anything else throws `disposed` afterwards. */
  dispose(): void {
    const raw = this.#raw;
    this.#raw = null;
    this.#core.free(raw);
  }
}
