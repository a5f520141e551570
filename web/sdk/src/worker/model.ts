import type { RestBody } from "../adapter/vertex-map.js";
import type { Bundle } from "../bundle.js";
import { checkObject } from "../check.js";
import type { AvatarOptions } from "../model.js";
import { poseSourceIndex } from "../pose-source.js";
import { isDualQuaternion } from "../skinning.js";
import { WorkerAvatar } from "./avatar.js";
import { WorkerCrowd } from "./crowd.js";
import type { Link } from "./link.js";
import { checkedShape, type SentShape } from "./protocol.js";
import { disposed } from "./refusals.js";

/**
 * A model in a worker: it makes avatars and crowds in the worker, as a `Model` does in this thread.
 * They share one core and the networks, and are stepped one after the other.
 */
export class WorkerModel {
  /** The files of the model, their origin and the measured errors. */
  readonly bundle: Bundle;
  readonly #link: Link;
  readonly #made = new Set<{ dispose(): void }>();
  /** The body without shape, once an avatar has brought it. */
  #rest: RestBody | null = null;
  #isDisposed = false;

  /** @internal */
  constructor(link: Link, bundle: Bundle) {
    this.#link = link;
    this.bundle = bundle;
  }

  /** Name of the model, such as `female`. */
  get name(): string {
    return this.bundle.name;
  }

  /**
   * An avatar that stands in the rest pose with settled tissue.
   *
   * @throws DynaSkinError `argument` or `shape` for a shape that cannot be used, `disposed`, `worker`
   */
  createAvatar(options: AvatarOptions = {}): Promise<WorkerAvatar> {
    return this.#createAvatar(options, (avatar) => this.#made.delete(avatar));
  }

  /** @internal An avatar that takes the model with it. */
  createLoneAvatar(options: AvatarOptions): Promise<WorkerAvatar> {
    return this.#createAvatar(options, () => this.dispose());
  }

  async #createAvatar(
    options: AvatarOptions,
    onDispose: (avatar: WorkerAvatar) => void,
  ): Promise<WorkerAvatar> {
    const shape = sentShape(options);
    const link = this.#sound;
    const target = link.nextId();
    const wantsRest = this.#rest === null;
    const { rest, ...state } = await link.call("createAvatar", { target, ...shape, wantsRest });
    if (rest) this.#rest = rest;
    const restBody = () => this.#rest;
    const avatar = new WorkerAvatar(link, target, state, {
      ...{ restBody, onDispose: () => onDispose(avatar) },
    });
    this.#made.add(avatar);
    if (options.poseSource !== undefined) avatar.poseSource = options.poseSource;
    const { poseCorrectives, skinning } = options;
    if (poseCorrectives !== undefined) avatar.poseCorrectives = poseCorrectives;
    if (skinning !== undefined) avatar.skinning = skinning;
    return avatar;
  }

  /**
   * A crowd without avatars, for many avatars of this model; see {@link WorkerCrowd}.
   *
   * @throws DynaSkinError `disposed`, `worker`
   */
  async createCrowd(): Promise<WorkerCrowd> {
    const link = this.#sound;
    const target = link.nextId();
    const { settings } = await link.call("createCrowd", { target });
    const crowd = new WorkerCrowd(link, target, settings, () => this.#made.delete(crowd));
    this.#made.add(crowd);
    return crowd;
  }

  /**
   * Ends the worker, and with it everything made from the model. May be called again; anything else
   * throws `disposed` afterwards.
   */
  dispose(): void {
    if (this.#isDisposed) return;
    this.#isDisposed = true;
    for (const made of [...this.#made]) made.dispose();
    this.#link.close(disposed("model"));
  }

  get #sound(): Link {
    if (this.#isDisposed) throw disposed("model");
    this.#link.assertOpen();
    return this.#link;
  }
}

/**
 * The shape as it is sent to a worker.
 *
 * @internal
 */
export function sentShape(options: AvatarOptions): { shape?: SentShape } {
  checkObject("options", options);
  const { shape, poseSource, skinning } = options;
  if (poseSource !== undefined) poseSourceIndex(poseSource);
  if (skinning !== undefined) isDualQuaternion(skinning);
  return shape === undefined ? {} : { shape: checkedShape(shape) };
}
