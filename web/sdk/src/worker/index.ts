/**
 * A model in a web worker: the networks of its avatars run beside the page's own work. The adapters for
 * three.js and Babylon.js take a {@link WorkerAvatar} as they take an `Avatar`.
 *
 * The price is time: the surface of a pose arrives with the worker's answer, usually by the next
 * display frame. It then lies one display frame further behind the skeleton than an `Avatar`'s,
 * whose tissue is one sixtieth of a second behind.
 *
 * @module
 */
export { WorkerAvatar } from "./avatar.js";
export { WorkerCrowd } from "./crowd.js";
export { WorkerModel } from "./model.js";
export { type ReadMotionOptions, readMotion } from "./read-motion.js";
export type { Remote } from "./remote.js";
export type { ThreadOptions, TrustedScriptAddress } from "./start.js";

import { checkCallback, checkObject, kindOf } from "../check.js";
import { DynaSkinError } from "../error.js";
import { type ModelFiles, mapFiles } from "../load.js";
import type { AvatarOptions } from "../model.js";
import type { Progress } from "../source.js";
import type { WorkerAvatar } from "./avatar.js";
import { sentShape, WorkerModel } from "./model.js";
import type { Calls } from "./protocol.js";
import {
  absolute,
  checkThread,
  startThread,
  type ThreadOptions,
  threadNeeds,
  untilAborted,
} from "./start.js";

/** Options of {@link createWorkerModel}. */
export interface WorkerModelOptions extends ThreadOptions {
  /**
   * The folder that holds `bundle.json` and the files it names, or the files themselves: addresses, bytes
   * (which are copied) or Blobs.
   */
  model: string | URL | ModelFiles;
  /** Called as bytes arrive in the worker. If it throws, the promise rejects with that error. */
  onProgress?: (progress: Progress) => void;
}

/** Options of {@link createWorkerAvatar}. */
export interface WorkerAvatarOptions extends WorkerModelOptions, AvatarOptions {}

/**
 * Starts a worker and loads a model in it.
 *
 * @throws DynaSkinError `worker` where workers cannot be started or stay silent, and what `load` throws
 */
export async function createWorkerModel(options: WorkerModelOptions): Promise<WorkerModel> {
  checkObject('A worker needs options, such as { model: "/models/female/" }: they', options);
  const { onProgress } = options;
  checkCallback("onProgress", onProgress);
  checkThread(options);
  const sent = toLoad(options);
  const link = startThread(options, (news) => {
    if (news.type === "progress") onProgress?.(news.progress);
  });
  try {
    return await untilAborted(link, options.signal, async () => {
      return new WorkerModel(link, await link.call("load", sent));
    });
  } catch (error) {
    link.close(error);
    throw error;
  }
}

/**
 * Starts a worker, loads a model in it and makes one avatar, which ends the worker when it is disposed
 * of. For several, see {@link createWorkerModel}.
 *
 * @throws DynaSkinError `worker` where workers cannot be started or stay silent, `argument` or `shape`
 *   for a shape that cannot be used, and what `load` throws
 */
export async function createWorkerAvatar(options: WorkerAvatarOptions): Promise<WorkerAvatar> {
  const { shape } = sentShape(options);
  const model = await createWorkerModel(options);
  try {
    const { poseSource, poseCorrectives, skinning } = options;
    return await model.createLoneAvatar({
      ...(shape && { shape }),
      ...(poseSource && { poseSource }),
      ...(poseCorrectives !== undefined && { poseCorrectives }),
      ...(skinning !== undefined && { skinning }),
    });
  } catch (error) {
    model.dispose();
    throw error;
  }
}

function toLoad(options: WorkerModelOptions): Calls["load"]["sent"] {
  const { model } = options;
  return { model: sentModel(model), ...threadNeeds(options) };
}

/** Addresses count from the page; what is sent are strings and bytes. */
function sentModel(model: WorkerModelOptions["model"]): string | ModelFiles {
  if (typeof model === "string" || model instanceof URL) return absolute(model);
  if (typeof model !== "object" || model === null) {
    throw new DynaSkinError(
      "argument",
      `model must be the address of a model's folder, or its files, got ${kindOf(model)}.`,
    );
  }
  return mapFiles(model, (source, key) => {
    if (typeof source === "string" || source instanceof URL) return absolute(source);
    if (typeof Response === "undefined" || !(source instanceof Response)) return source;
    throw new DynaSkinError(
      "argument",
      `model.${key} is a Response, which cannot be sent to a worker; give its address or its bytes.`,
    );
  });
}
