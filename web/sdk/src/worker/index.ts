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
export type { Remote } from "./remote.js";

import { checkCallback, checkObject, checkSignal } from "../check.js";
import { DynaSkinError } from "../error.js";
import type { AvatarOptions } from "../model.js";
import type { Progress } from "../source.js";
import type { WorkerAvatar } from "./avatar.js";
import { Link } from "./link.js";
import { sentShape, WorkerModel } from "./model.js";
import type { Calls } from "./protocol.js";
import { brokenWorker, checkTimeout } from "./refusals.js";

/** How a model in a worker begins. */
export interface WorkerModelOptions {
  /** The folder that holds `bundle.json` and the files it names. */
  model: string | URL;
  /** The WebAssembly file, where the bundler cannot find it. */
  wasm?: string | URL | ArrayBuffer | WebAssembly.Module;
  /** Makes the worker, where the bundler cannot find `dynaskin/worker/thread`. */
  createWorker?: () => Worker;
  /**
   * For how many milliseconds the worker may be silent while an answer is due; then it is ended, and
   * all that waits is rejected with the code `worker`. If left out 30,000; `Infinity` waits for ever.
   * While it loads, the worker says that it is alive, so a slow download is no silence; time in which
   * the page stands still does not count.
   */
  timeoutMs?: number;
  /** Stops the loading; the promise then rejects with the signal's reason. */
  signal?: AbortSignal;
  /** Called as bytes arrive in the worker. What it throws, the promise rejects with. */
  onProgress?: (progress: Progress) => void;
}

/** How an avatar in a worker of its own begins. */
export interface WorkerAvatarOptions extends WorkerModelOptions, AvatarOptions {}

const DEFAULT_TIMEOUT_MS = 30_000;

/** A worker that loads says that it is alive so often, or more often where its page is impatient. */
const ALIVE_EVERY_MS = 1000;

/**
 * Starts a worker and loads a model in it.
 *
 * @throws DynaSkinError `worker` where workers cannot be started or stay silent, and what `load` throws
 */
export async function createWorkerModel(options: WorkerModelOptions): Promise<WorkerModel> {
  checkObject('A worker needs options, such as { model: "/models/female/" }: they', options);
  const { signal, createWorker, onProgress, timeoutMs = DEFAULT_TIMEOUT_MS } = options;
  checkSignal(signal);
  checkCallback("onProgress", onProgress);
  checkCallback("createWorker", createWorker);
  checkTimeout(timeoutMs);
  signal?.throwIfAborted();
  const sent = toLoad(options, timeoutMs);
  const link = new Link(startWorker(createWorker), timeoutMs, (progress) => onProgress?.(progress));
  const onAbort = () => link.close(signal?.reason);
  signal?.addEventListener("abort", onAbort);
  try {
    return new WorkerModel(link, await link.call("load", sent));
  } catch (error) {
    link.close(error);
    throw error;
  } finally {
    signal?.removeEventListener("abort", onAbort);
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
    const { poseSource } = options;
    return await model.createLoneAvatar({
      ...(shape && { shape }),
      ...(poseSource && { poseSource }),
    });
  } catch (error) {
    model.dispose();
    throw error;
  }
}

function toLoad({ model, wasm }: WorkerModelOptions, timeoutMs: number): Calls["load"]["sent"] {
  if (typeof model !== "string" && !(model instanceof URL)) {
    throw new DynaSkinError(
      "argument",
      "model must be the address of a model's folder; a worker fetches the files by itself.",
    );
  }
  const aliveEveryMs = Math.min(ALIVE_EVERY_MS, timeoutMs / 4);
  const sent: Calls["load"]["sent"] = { model: absolute(model), aliveEveryMs };
  if (wasm) sent.wasm = wasm instanceof URL || typeof wasm === "string" ? absolute(wasm) : wasm;
  return sent;
}

function startWorker(create: (() => Worker) | undefined): Worker {
  if (create) return create();
  if (typeof Worker !== "function") {
    throw new DynaSkinError("worker", "There are no web workers here; use load() instead.");
  }
  try {
    // In one piece, because bundlers look for exactly this.
    return new Worker(new URL("./thread.js", import.meta.url), { type: "module" });
  } catch (cause) {
    throw brokenWorker(cause, { cause });
  }
}

/** A worker's relative addresses count from its own file, the caller's from the page. */
function absolute(address: string | URL): string {
  const { document } = globalThis as { document?: { baseURI: string } };
  try {
    return new URL(address, document?.baseURI).href;
  } catch (cause) {
    throw new DynaSkinError(
      "argument",
      `"${address}" is no address; outside a page it must be a full one, such as file:///models/female/.`,
      { cause },
    );
  }
}
