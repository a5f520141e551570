import type { Crowd, CrowdReport, LevelOfDetail } from "../crowd.js";
import { DynaSkinError } from "../error.js";
import { checkLength, POSE_LENGTH, type Pose } from "../pose.js";
import { WorkerAvatar } from "./avatar.js";
import type { Link } from "./link.js";
import type { CrowdSettings } from "./protocol.js";
import { checkTimeStep } from "./refusals.js";
import { Remote } from "./remote.js";

/**
 * Avatars of one worker that are stepped by one call; see `Crowd`. Made by
 * `WorkerModel.createCrowd`.
 *
 * As with a {@link WorkerAvatar}, of the steps only the newest waits while the worker is busy, and what
 * the worker refuses, the next {@link stepAll} throws.
 */
export class WorkerCrowd extends Remote<Crowd, CrowdSettings> {
  /** Replaced, never changed: steps that are under way go by it. */
  #avatars: readonly WorkerAvatar[] = Object.freeze([]);
  #report: CrowdReport | null = null;

  /** @internal */
  constructor(link: Link, id: number, settings: Partial<CrowdSettings>, onDispose: () => void) {
    super({ link, id, what: "crowd" }, { levelOfDetail: null, ...settings }, onDispose);
  }

  /**
   * The avatars in the order in which {@link stepAll} takes their poses. A frozen array; another one
   * after {@link add} and {@link remove}.
   */
  get avatars(): readonly WorkerAvatar[] {
    return this.#avatars;
  }

  /**
   * Adds an avatar at the end.
   *
   * @throws DynaSkinError `argument` for what is no avatar of this worker and for one that is in it
   *   already, `disposed`
   */
  add(avatar: WorkerAvatar): void {
    if (!(avatar instanceof WorkerAvatar) || !this.isBeside(avatar)) {
      throw new DynaSkinError(
        "argument",
        "A crowd in a worker takes avatars of the same WorkerModel, as its createAvatar() gives them.",
      );
    }
    avatar.assertAlive();
    if (this.#avatars.includes(avatar)) {
      throw new DynaSkinError("argument", "The avatar is in the crowd already.");
    }
    this.flush();
    this.change(["add", { ref: avatar.id }]);
    this.#avatars = Object.freeze([...this.#avatars, avatar]);
    avatar.crowds.add(this);
  }

  /** Takes an avatar out, also a disposed one; those after it move up. Whether it was in. */
  remove(avatar: WorkerAvatar): boolean {
    if (!this.#avatars.includes(avatar)) return false;
    this.flush();
    this.change(["remove", { ref: avatar.id }]);
    this.#avatars = Object.freeze(this.#avatars.filter((other) => other !== avatar));
    avatar.crowds.delete(this);
    return true;
  }

  /**
   * Sends every avatar its pose, `dtSeconds` after the last step, as {@link WorkerAvatar.step} does.
   *
   * @param poses - one `Pose` for each of {@link avatars}, in their order; they are copied
   * @param dtSeconds - time since the last step in seconds, 0 to 86,400
   * @throws DynaSkinError `argument` for a wrong number or length or a time step that cannot be used,
   *   `disposed` also where one of the avatars was disposed, `worker` once the worker has stopped, and
   *   what the worker refused since the last step, of the crowd or of one of its avatars
   */
  stepAll(poses: readonly Pose[], dtSeconds: number): void {
    if (!Array.isArray(poses) || poses.length !== this.#avatars.length) {
      const got = Array.isArray(poses) ? `${poses.length}` : "no array";
      throw new DynaSkinError(
        "argument",
        `stepAll needs an array of ${this.#avatars.length} poses, one for each avatar; got ${got}.`,
      );
    }
    for (const [idx, pose] of poses.entries()) checkLength(`pose ${idx}`, pose, POSE_LENGTH);
    checkTimeStep(dtSeconds);
    this.assertSound();
    for (const [idx, avatar] of this.#avatars.entries()) {
      if (!avatar.disposed) continue;
      throw new DynaSkinError(
        "disposed",
        `Avatar ${idx} of the crowd was disposed; remove() it from the crowd first.`,
      );
    }
    for (const part of [this, ...this.#avatars]) {
      const failure = part.takeFailure();
      if (failure) throw failure;
    }
    this.give(poses, dtSeconds);
  }

  /**
   * By what avatars get less detail; see `Crowd.levelOfDetail`. Distances that were left out read as
   * they are when the worker has answered; what it refuses, the next {@link stepAll} throws.
   */
  get levelOfDetail(): LevelOfDetail | null {
    this.assertAlive();
    return structuredClone(this.settings.levelOfDetail);
  }

  set levelOfDetail(levelOfDetail: LevelOfDetail | null) {
    this.change(["levelOfDetail", levelOfDetail], { levelOfDetail });
  }

  /** What the last answered step did and cost in the worker; null before the first. */
  get report(): CrowdReport | null {
    return this.#report;
  }

  /** Frees the crowd in the worker; its avatars live on. May be called again. */
  override dispose(): void {
    super.dispose();
    for (const avatar of this.#avatars) avatar.crowds.delete(this);
    this.#avatars = [];
  }

  /** @internal */
  protected override members(): readonly WorkerAvatar[] {
    return this.#avatars;
  }

  /** @internal */
  protected override receive({ report }: { report?: CrowdReport }): void {
    if (report) this.#report = report;
  }
}
