import type { RemoteAvatar } from "../adapter/rig.js";
import type { StepTimings } from "../avatar.js";
import type { RegionName } from "../bundle.js";
import { checkObject } from "../check.js";
import {
  type ControlChanges,
  type ControlPreset,
  type Controls,
  mergedControls,
} from "../controls.js";
import { checkDistance, type Detail, detailIndex } from "../detail.js";
import { DynaSkinError } from "../error.js";
import { checkLength, POSE_LENGTH, type Pose, SHAPE_LENGTH } from "../pose.js";
import {
  type Answer,
  type AvatarState,
  buffersOf,
  type Change,
  copySurface,
  type Failed,
  type Request,
  type Settings,
  type SurfaceArrays,
} from "./protocol.js";
import { brokenWorker, checkScale, checkTimeStep, disposed } from "./refusals.js";

/** Who waits for an answer. */
interface Waiting<T> {
  resolve: (value: T) => void;
  reject: (error: DynaSkinError) => void;
}

/**
 * One body that moves, in a worker.
 *
 * It has what an `Avatar` has, but for `skinned()`. Settings read as they were set last; what the
 * worker refuses is taken back when it answers, and the next {@link step} throws why. Surface,
 * `shape` and `timings` are those of the worker's last answer.
 */
export class WorkerAvatar implements RemoteAvatar {
  #worker: Worker | null;
  #surface: SurfaceArrays;
  #spare: SurfaceArrays;
  #shape: Float32Array;
  #restJointsM: Float32Array;
  #settings: Settings;
  #distanceM = 0;
  #timings: StepTimings | null = null;
  #spentPose: Float64Array = new Float64Array(POSE_LENGTH);
  readonly #nextPose = new Float64Array(POSE_LENGTH);
  #nextDtSeconds: number | null = null;
  #stepping = false;
  #unansweredChanges = 0;
  #failure: DynaSkinError | null = null;
  #broken: DynaSkinError | null = null;
  readonly #saves: Waiting<Uint8Array>[] = [];
  readonly #restores: Waiting<void>[] = [];
  readonly #idle: Waiting<void>[] = [];
  /** Saves that come after the pose that waits. */
  #savesAfterPose = 0;

  /** @internal */
  constructor(worker: Worker, { surface, state }: Answer & { type: "ready" }) {
    this.#worker = worker;
    this.#surface = surface;
    this.#spare = copySurface(surface);
    this.#shape = state.shape;
    this.#restJointsM = state.restJointsM;
    this.#settings = state.settings;
    worker.onmessage = ({ data }: MessageEvent<Answer>) => this.#receive(data);
    worker.onerror = (event) => {
      this.#broken = brokenWorker(event);
      this.#rejectAll(this.#broken);
    };
  }

  /**
   * Sends a pose to the worker. While the worker is busy with an earlier one, only the newest pose
   * waits, and the times between add up: a slow worker gives fewer surfaces, not later ones.
   *
   * @param pose - see `Pose`; it is copied
   * @param dtSeconds - time since the last step in seconds
   * @throws DynaSkinError `argument` for a wrong length or a time step that is negative, not finite or
   *   above a day, `disposed`, `worker` once the worker has stopped, and what the
   *   worker met since the last step
   */
  step(pose: Pose, dtSeconds: number): void {
    checkLength("pose", pose, POSE_LENGTH);
    checkTimeStep(dtSeconds);
    this.#assertAlive();
    if (this.#broken) throw this.#broken;
    const failure = this.#takeFailure();
    if (failure) throw failure;
    this.#nextPose.set(pose);
    this.#nextDtSeconds = (this.#nextDtSeconds ?? 0) + dtSeconds;
    this.#send();
  }

  /** Whether an answer is outstanding: the surface is not yet that of all that was asked. */
  get pending(): boolean {
    return this.#stepping || this.#unansweredChanges > 0;
  }

  /**
   * Resolves when the worker has answered all that was asked, so that surface and settings are those
   * of the last pose and the last change. For tests, and for pages that draw single pictures; a page
   * that draws continuously has no need of it.
   *
   * @throws DynaSkinError what the worker refused since the last step, `disposed`, `worker`
   */
  whenAnswered(): Promise<void> {
    return new Promise((resolve, reject) => {
      this.#assertSound();
      this.#idle.push({ resolve, reject });
      this.#settleIdle();
    });
  }

  /** Rest-pose offsets, `[vertex][x, y, z]` flattened, metres; valid until the next task. */
  get offsets(): Float32Array {
    return this.#alive().offsets;
  }

  /** Rest-pose positions with the offsets, `[vertex][x, y, z]` flattened, metres. */
  get positions(): Float32Array {
    return this.#alive().positions;
  }

  /** Unit normals of {@link positions}. */
  get normals(): Float32Array {
    return this.#alive().normals;
  }

  /**
   * Per joint the matrix from rest-pose to world coordinates, `[joint][16]` flattened, column-major,
   * of the pose that the surface belongs to.
   */
  get skinMatrices(): Float32Array {
    return this.#alive().skinMatrices;
  }

  /** Shape coefficients β in standard deviations, as the present surface has them. */
  get shape(): Float32Array {
    return this.#shape;
  }

  /** Rest positions of the 24 joints for that shape: `[joint][x, y, z]` flattened, metres. */
  restJointsM(): Float32Array {
    return this.#restJointsM;
  }

  /**
   * Gives the avatar another shape; it and the surface change when the worker answers.
   *
   * @throws DynaSkinError `argument` for a wrong length; what the worker refuses, the next step throws
   */
  setShape(shape: ArrayLike<number>): void {
    checkLength("shape", shape, SHAPE_LENGTH);
    this.#change({ what: "shape", shape: Array.from(shape) });
  }

  /** Factor on all offsets, 0 to 4; see `Avatar.strength`. */
  get strength(): number {
    return this.#settings.controls.strength;
  }

  set strength(factor: number) {
    this.setControls({ strength: factor });
  }

  /** Whether the networks run; see `Avatar.dynamics`. */
  get dynamics(): boolean {
    return this.#settings.dynamics;
  }

  set dynamics(on: boolean) {
    const dynamics = Boolean(on);
    this.#change({ what: "dynamics", on: dynamics }, { dynamics });
  }

  /**
   * How much work the tissue is worth; see `Avatar.detail`. Set it by hand: crowds, which choose it by
   * distance and by time, take avatars of the page only. Another word throws `argument`.
   */
  get detail(): Detail {
    return this.#settings.detail;
  }

  set detail(detail: Detail) {
    detailIndex(detail);
    this.#change({ what: "detail", detail }, { detail });
  }

  /** Whether anybody sees the avatar; see `Avatar.visible`. */
  get visible(): boolean {
    return this.#settings.visible;
  }

  set visible(seen: boolean) {
    const visible = Boolean(seen);
    this.#change({ what: "visible", visible }, { visible });
  }

  /**
   * Metres from the camera, for code that treats all avatars alike. It is kept here and changes
   * nothing: only a crowd goes by it, and crowds stay in the page. A negative number or NaN throws
   * `argument`.
   */
  get distanceM(): number {
    this.#assertAlive();
    return this.#distanceM;
  }

  set distanceM(metres: number) {
    checkDistance(metres);
    this.#assertAlive();
    this.#distanceM = metres;
  }

  /**
   * How large the avatar stands in the world, 0.1 to 10; see `Avatar.scale`. Other numbers throw
   * `argument` at once.
   */
  get scale(): number {
    return this.#settings.scale;
  }

  set scale(factor: number) {
    checkScale(factor);
    // A pose that waits is of the size it was given at.
    const ratio = factor / this.#settings.scale;
    for (const axis of [0, 1, 2]) this.#nextPose[axis] = (this.#nextPose[axis] ?? 0) * ratio;
    this.#change({ what: "scale", factor }, { scale: factor });
  }

  /** All controls: a copy. A preset shows when the worker has answered. */
  get controls(): Controls {
    return structuredClone(this.#settings.controls);
  }

  /**
   * Changes some controls, or takes over a preset; see `Avatar.setControls`.
   *
   * @throws DynaSkinError `argument` for an unknown region; what the worker refuses, the next step
   *   throws
   */
  setControls(change: ControlChanges | ControlPreset): void {
    if (typeof change !== "string") checkObject("change", change);
    const expected =
      typeof change === "string"
        ? {}
        : { controls: mergedControls(this.#settings.controls, change) };
    this.#change({ what: "controls", controls: change }, expected);
  }

  /**
   * Factor on the offsets of one region; see `Avatar.setRegionGain`.
   *
   * @throws DynaSkinError `argument` for an unknown region
   */
  setRegionGain(region: RegionName, factor: number): void {
    this.setControls({ regions: { [region]: { gain: factor } } });
  }

  /** The next step counts as the first; see `Avatar.reset`. */
  reset(): void {
    this.#change({ what: "reset" });
  }

  /**
   * All that the avatar remembers after the last pose it was given; see `Avatar.save`. An `Avatar` of
   * the same model can restore it, and the other way round.
   *
   * @throws DynaSkinError `disposed`, `worker`
   */
  save(): Promise<Uint8Array> {
    return new Promise((resolve, reject) => {
      this.#assertSound();
      this.#saves.push({ resolve, reject });
      if (this.#nextDtSeconds === null) this.#post({ type: "save" });
      else this.#savesAfterPose += 1;
    });
  }

  /**
   * Goes on from where {@link save} was called; see `Avatar.restore`. A pose that still waits for the
   * worker is dropped.
   *
   * @throws DynaSkinError `state` for bytes that do not fit, `argument` for what are no bytes; the
   *   avatar then stays as it was
   */
  restore(state: Uint8Array): Promise<void> {
    return new Promise((resolve, reject) => {
      this.#assertSound();
      if (!(state instanceof Uint8Array)) {
        throw new DynaSkinError("argument", "A saved state is a Uint8Array, as save() gives it.");
      }
      this.#nextDtSeconds = null;
      this.#postSaves();
      this.#restores.push({ resolve, reject });
      this.#unansweredChanges += 1;
      this.#post({ type: "restore", state });
    });
  }

  /** What the last answered step cost in the worker; null before the first. */
  get timings(): StepTimings | null {
    return this.#timings;
  }

  /** Ends the worker. May be called again; anything else throws `disposed` afterwards. */
  dispose(): void {
    this.#worker?.terminate();
    this.#worker = null;
    this.#rejectAll(disposed());
  }

  #alive(): SurfaceArrays {
    this.#assertAlive();
    return this.#surface;
  }

  #assertAlive(): Worker {
    if (this.#worker) return this.#worker;
    throw disposed();
  }

  #assertSound(): void {
    this.#assertAlive();
    if (this.#broken) throw this.#broken;
  }

  #takeFailure(): DynaSkinError | null {
    const failure = this.#failure;
    this.#failure = null;
    return failure;
  }

  #post(request: Request, transfer: Transferable[] = []): void {
    this.#assertAlive().postMessage(request, transfer);
  }

  #change(change: Change, expected: Partial<Settings> = {}): void {
    try {
      this.#post({ type: "change", change });
    } catch (cause) {
      if (cause instanceof DynaSkinError) throw cause;
      throw new DynaSkinError("argument", `The ${change.what} cannot be sent to a worker.`, {
        cause,
      });
    }
    this.#unansweredChanges += 1;
    this.#settings = { ...this.#settings, ...expected };
  }

  #send(): void {
    const dtSeconds = this.#nextDtSeconds;
    if (this.#stepping || dtSeconds === null || !this.#worker) return;
    this.#nextDtSeconds = null;
    this.#stepping = true;
    const pose = this.#spentPose;
    pose.set(this.#nextPose);
    const surface = this.#spare;
    this.#post({ type: "step", pose, dtSeconds, surface }, [
      ...buffersOf(surface),
      pose.buffer as ArrayBuffer,
    ]);
    this.#postSaves();
  }

  #postSaves(): void {
    for (; this.#savesAfterPose > 0; this.#savesAfterPose -= 1) this.#post({ type: "save" });
  }

  #receive(answer: Answer): void {
    switch (answer.type) {
      case "stepped":
        this.#spare = this.#surface;
        this.#surface = answer.surface;
        this.#spentPose = answer.pose;
        this.#timings = answer.timings;
        this.#stepping = false;
        break;
      case "changed":
        this.#receiveState(answer.surface, answer.state);
        break;
      case "restored":
        this.#receiveState(answer.surface, answer.state);
        this.#restores.shift()?.resolve();
        break;
      case "saved":
        this.#saves.shift()?.resolve(answer.bytes);
        break;
      case "failed":
        this.#receiveFailure(answer);
    }
    this.#send();
    this.#settleIdle();
  }

  #receiveState(surface: SurfaceArrays, { shape, restJointsM, settings }: AvatarState): void {
    this.#unansweredChanges -= 1;
    this.#surface = surface;
    // The same array tells an adapter that nothing has to be fitted anew.
    if (!shape.every((coefficient, idx) => coefficient === this.#shape[idx])) {
      this.#shape = shape;
      this.#restJointsM = restJointsM;
    }
    this.#receiveSettings(settings);
  }

  /** While later changes are outstanding, what they ask for is shown. */
  #receiveSettings(settings: Settings | undefined): void {
    if (settings && this.#unansweredChanges === 0) this.#settings = settings;
  }

  #receiveFailure({ during, code, message, settings, surface }: Failed): void {
    const error = new DynaSkinError(code, message);
    if (during === "change" || during === "restore") this.#unansweredChanges -= 1;
    if (during === "save") this.#saves.shift()?.reject(error);
    else if (during === "restore") this.#restores.shift()?.reject(error);
    else this.#failure ??= error;
    if (surface) {
      this.#spare = surface;
      this.#spentPose = new Float64Array(POSE_LENGTH);
      this.#stepping = false;
    }
    this.#receiveSettings(settings);
  }

  #settleIdle(): void {
    if (this.pending || this.#idle.length === 0) return;
    const failure = this.#takeFailure();
    for (const { resolve, reject } of this.#idle.splice(0)) {
      if (failure) reject(failure);
      else resolve();
    }
  }

  #rejectAll(error: DynaSkinError): void {
    for (const waiting of [this.#saves, this.#restores, this.#idle]) {
      for (const { reject } of waiting.splice(0)) reject(error);
    }
  }
}
