import type { Crowd, CrowdReport, LevelOfDetail } from "../crowd.js";
import { DynaSkinError } from "../error.js";
import { checkPoses, type Pose } from "../pose.js";
import { WorkerAvatar } from "./avatar.js";
import type { Link } from "./link.js";
import type { CrowdSettings } from "./protocol.js";
import { checkTimeStep } from "./refusals.js";
import { Remote } from "./remote.js";

/**
 * Avatars of one worker that one call steps together; see `Crowd`. Made by
 * `WorkerModel.createCrowd`.
 *
 * As with a {@link WorkerAvatar}, only the newest step waits while the worker is busy, and the next
 * {@link stepAll} throws what the worker refuses.
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

  /** Removes an avatar, which may be disposed; those after it move up. Returns whether it was in the crowd. */
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
    this.assertSound();
    checkTimeStep(dtSeconds);
    checkPoses(poses, this.#avatars);
    for (const part of [this, ...this.#avatars]) {
      const failure = part.takeFailure();
      if (failure) throw failure;
    }
    this.give(poses, dtSeconds);
  }

  /**
   * When avatars get less detail; see `Crowd.levelOfDetail`. Distances that were left out appear when the
   * worker has answered; the next {@link stepAll} throws what it refuses.
   */
  get levelOfDetail(): LevelOfDetail | null {
    this.assertAlive();
    return structuredClone(this.settings.levelOfDetail);
  }

  set levelOfDetail(levelOfDetail: LevelOfDetail | null) {
    this.change(["levelOfDetail", levelOfDetail], { levelOfDetail });
  }

  /** Detail and cost of the last answered step in the worker; null before the first. */
  get report(): CrowdReport | null {
    return this.#report;
  }

  /** Frees the crowd in the worker; its avatars stay valid. May be called again. */
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
