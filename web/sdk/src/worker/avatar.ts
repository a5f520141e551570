import type { RemoteAvatar } from "../adapter/rig.js";
import type { RestBody } from "../adapter/vertex-map.js";
import type { Avatar, StepTimings } from "../avatar.js";
import type { RegionName } from "../bundle.js";
import { checkObject, checkState } from "../check.js";
import {
  type ControlChanges,
  type ControlPreset,
  type Controls,
  mergedControls,
} from "../controls.js";
import type { Detail } from "../detail.js";
import type { Figure, Shape } from "../figure.js";
import { checkLength, POSE_LENGTH, type Pose } from "../pose.js";
import type { PoseSource } from "../pose-source.js";
import type { Skinning } from "../skinning.js";
import type { Link } from "./link.js";
import {
  AVATAR_SETTINGS,
  type AvatarProperties,
  type AvatarSettings,
  type Calls,
  checkedShape,
  copySurface,
  type Shown,
  type Stepped,
  SURFACE,
  type SurfaceArrays,
} from "./protocol.js";
import { checkTimeStep } from "./refusals.js";
import { Remote } from "./remote.js";

/** What an avatar in a worker shares with its model. */
interface OfModel {
  restBody: () => RestBody | null;
  onDispose: () => void;
}

/**
 * One body that moves, in a worker.
 *
 * It has the members of `Avatar`, except `skinned()`. Settings read back the last value that you set; a
 * value that the worker refuses is undone when it answers, and the next {@link step} throws the reason.
 * Surface, `shape` and `timings` are those of the worker's last answer.
 */
export class WorkerAvatar
  extends Remote<Avatar, AvatarSettings>
  implements RemoteAvatar, AvatarProperties
{
  /** Whether the networks run; see `Avatar.dynamics`. */
  declare dynamics: boolean;
  /** Whether the avatar is visible; see `Avatar.visible`. */
  declare visible: boolean;
  /**
   * Level of detail of the tissue; see `Avatar.detail`. A `WorkerCrowd` with a level of detail sets
   * it. Any other string throws `argument`.
   */
  declare detail: Detail;
  /** Whether pose correctives are added; see `Avatar.poseCorrectives`. */
  declare poseCorrectives: boolean;
  /** How the motions of the joints are blended; see `Avatar.skinning`. Any other string throws `argument` at once. */
  declare skinning: Skinning;
  /** Where the poses come from; see `Avatar.poseSource`. Any other string throws `argument` at once. */
  declare poseSource: PoseSource;
  /**
   * Size of the avatar in the world, 0.1 to 10; see `Avatar.scale`. Other numbers throw
   * `argument` at once.
   */
  declare scale: number;
  /**
   * Distance from the camera in metres; a `WorkerCrowd` chooses the {@link detail} by it. A negative number
   * or NaN throws `argument`.
   */
  declare distanceM: number;
  /** Rest-pose offsets, `[vertex][x, y, z]` flattened, metres; valid until the next task. */
  declare readonly offsets: Float32Array;
  /** Rest-pose positions with the offsets, `[vertex][x, y, z]` flattened, metres. */
  declare readonly positions: Float32Array;
  /** Unit normals of {@link positions}. */
  declare readonly normals: Float32Array;
  /**
   * Per joint the matrix from rest-pose to world coordinates, `[joint][16]` flattened, column-major,
   * of the pose that the surface belongs to.
   */
  declare readonly skinMatrices: Float32Array;
  /** The body without shape; null where the worker could not say it. @internal */
  readonly restBody: () => RestBody | null;
  #shown: Shown;
  #spare: SurfaceArrays | null = null;
  #timings: StepTimings | null = null;
  readonly #crowds = new Set<Remote<unknown, object>>();

  static {
    for (const [name, { check, silent }] of Object.entries<AnySetting>(AVATAR_SETTINGS)) {
      Object.defineProperty(WorkerAvatar.prototype, name, {
        configurable: true,
        get(this: WorkerAvatar) {
          this.assertAlive();
          return this.settings[name as keyof AvatarProperties];
        },
        set(this: WorkerAvatar, value: unknown) {
          this.#set(name as keyof AvatarProperties, check(value as never) as never, silent);
        },
      });
    }
    for (const name of SURFACE) {
      Object.defineProperty(WorkerAvatar.prototype, name, {
        configurable: true,
        get(this: WorkerAvatar) {
          return this.#alive.surface[name];
        },
      });
    }
  }

  /** @internal */
  constructor(
    link: Link,
    id: number,
    { settings, shown }: Calls["createAvatar"]["back"],
    of: OfModel,
  ) {
    const known = { distanceM: 0, ...settings } as AvatarSettings;
    super({ link, id, what: "avatar" }, known, of.onDispose);
    this.restBody = of.restBody;
    this.#shown = shown;
  }

  /**
   * Sends a pose to the worker. While the worker is busy with an earlier one, only the newest pose
   * waits and time steps add up: a slow worker delivers fewer surfaces, not later ones.
   *
   * @param pose - see `Pose`; it is copied
   * @param dtSeconds - time since the last step in seconds
   * @throws DynaSkinError `argument` for a wrong length or a time step that is negative, not finite or
   *   above a day, `disposed`, `worker` once the worker has stopped, and errors in the worker since the
   *   last step
   */
  step(pose: Pose, dtSeconds: number): void {
    checkLength("pose", pose, POSE_LENGTH);
    checkTimeStep(dtSeconds);
    this.assertSound();
    const failure = this.takeFailure();
    if (failure) throw failure;
    this.give([pose], dtSeconds);
  }

  /** Shape coefficients β of the present surface, in standard deviations. */
  get shape(): Float32Array {
    return this.#shown.shape;
  }

  /** The measures of the present surface; see `Avatar.figure`. */
  get figure(): Required<Figure> | null {
    return this.#alive.figure;
  }

  /** Changes whenever {@link shape} may have changed; see `Avatar.revision`. */
  get revision(): number {
    return this.#alive.revision;
  }

  /** Rest positions of the 24 joints for that shape: `[joint][x, y, z]` flattened, metres. */
  restJointsM(): Float32Array {
    return this.#shown.restJointsM;
  }

  /**
   * Gives the avatar another shape; `shape` and the surface change when the worker answers.
   *
   * @param shape - see `Avatar.setShape`
   * @throws DynaSkinError `argument` for a wrong length or an unknown measure; the next step throws what the
   *   worker refuses
   */
  setShape(shape: Shape): void {
    this.change(["setShape", checkedShape(shape)]);
  }

  /** Factor on all offsets, 0 to 4; see `Avatar.strength`. */
  get strength(): number {
    return this.settings.controls.strength;
  }

  set strength(factor: number) {
    this.setControls({ strength: factor });
  }

  /** A copy of all controls. A preset appears in it when the worker has answered. */
  get controls(): Controls {
    return structuredClone(this.settings.controls);
  }

  /**
   * Changes some controls, or applies a preset; see `Avatar.setControls`.
   *
   * @throws DynaSkinError `argument` for an unknown region; the next step throws what the worker refuses
   */
  setControls(change: ControlChanges | ControlPreset): void {
    if (typeof change === "string") {
      this.change(["setControls", change]);
      return;
    }
    checkObject("change", change);
    const controls = mergedControls(this.settings.controls, change);
    this.change(["setControls", change], { controls });
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
    this.change(["reset"]);
  }

  /**
   * The avatar's state after the last pose that it was given; see `Avatar.save`. An `Avatar` of
   * the same model can restore it, and vice versa.
   *
   * @throws DynaSkinError `disposed`, `worker`
   */
  save(): Promise<Uint8Array> {
    this.flushAll();
    return this.ask(["save"]);
  }

  /**
   * Continues from where {@link save} was called; see `Avatar.restore`. A pose that still waits for the
   * worker is dropped.
   *
   * @throws DynaSkinError `state` for bytes that do not fit, `argument` for anything but bytes; the
   *   avatar then stays unchanged
   */
  async restore(state: Uint8Array): Promise<void> {
    this.assertSound();
    checkState(state);
    this.forgetPoses();
    this.flushAll();
    await this.ask(["restore", state]);
  }

  /** What the last answered step cost in the worker; null before the first. A crowd's do not count. */
  get timings(): StepTimings | null {
    return this.#timings;
  }

  /**
   * Frees the avatar in the worker; ends the worker of an avatar made by `createWorkerAvatar`. May be
   * called again; anything else throws `disposed` afterwards.
   */
  override dispose(): void {
    this.flushAll();
    super.dispose();
  }

  get #alive(): Shown {
    this.assertAlive();
    return this.#shown;
  }

  #set<Name extends keyof AvatarProperties>(
    name: Name,
    value: AvatarProperties[Name],
    silent: true | undefined,
  ): void {
    const expected = { [name]: value } as Partial<AvatarSettings>;
    // A pose that waits is of the size it was given at.
    if (name === "scale") this.flushAll();
    if (silent) this.changeSilently([name, value] as never, expected);
    else this.change([name, value] as never, expected);
  }

  /** @internal Sends poses that wait, also those of crowds. */
  flushAll(): void {
    this.flush();
    for (const crowd of this.#crowds) crowd.flush();
  }

  /** @internal Whose steps move it as well. */
  get crowds(): Set<Remote<unknown, object>> {
    return this.#crowds;
  }

  /** @internal A surface that may travel. */
  takeSpare(): SurfaceArrays {
    const spare = this.#spare ?? copySurface(this.#shown.surface);
    this.#spare = null;
    return spare;
  }

  /** @internal Takes over what a step gave, as number `idx` of those that it moved. */
  receiveStep({ surfaces, details }: Stepped, idx: number): void {
    const [surface, detail] = [surfaces[idx], details[idx]];
    if (!surface || !detail) return;
    this.#spare = this.#shown.surface;
    this.#shown = { ...this.#shown, surface };
    this.receiveSettings({ detail });
  }

  /** @internal */
  protected override members(): readonly WorkerAvatar[] {
    return [this];
  }

  /** @internal */
  protected override receive({ shown, timings }: { shown?: Shown; timings?: StepTimings }): void {
    if (shown) this.#shown = shown;
    if (timings) this.#timings = timings;
  }
}

type AnySetting = { check: (value: never) => unknown; silent?: true };
