/**
 * An avatar in a web worker: the networks run beside the page's own work. The adapters for three.js
 * and Babylon.js take a {@link WorkerAvatar} as they take an `Avatar`.
 *
 * The price is time: the surface of a pose arrives with the worker's answer, usually by the next
 * display frame. It then lies one display frame further behind the skeleton than an `Avatar`'s,
 * whose tissue is one sixtieth of a second behind.
 *
 * @module
 */
export { WorkerAvatar } from "./avatar.js";

import { checkCallback, checkObject, checkSignal } from "../check.js";
import { DynaSkinError } from "../error.js";
import { checkLength, SHAPE_LENGTH } from "../pose.js";
import type { Progress } from "../source.js";
import { WorkerAvatar } from "./avatar.js";
import type { Answer, Request } from "./protocol.js";
import { brokenWorker } from "./refusals.js";

/** How an avatar in a worker begins. */
export interface WorkerAvatarOptions {
  /** The folder that holds `bundle.json` and the files it names. */
  model: string | URL;
  /** Ten shape coefficients in standard deviations; average if left out. */
  shape?: ArrayLike<number>;
  /** The WebAssembly file, where the bundler cannot find it. */
  wasm?: string | URL | ArrayBuffer | WebAssembly.Module;
  /** Makes the worker, where the bundler cannot find `dynaskin/worker/thread`. */
  createWorker?: () => Worker;
  /** Stops the loading; the promise then rejects with the signal's reason. */
  signal?: AbortSignal;
  /** Called as bytes arrive in the worker. */
  onProgress?: (progress: Progress) => void;
}

/**
 * Starts a worker, loads a model in it and makes an avatar.
 *
 * @throws DynaSkinError `worker` where workers cannot be started, and what `load` throws
 */
export async function createWorkerAvatar(options: WorkerAvatarOptions): Promise<WorkerAvatar> {
  checkObject(
    'createWorkerAvatar() needs options, such as { model: "/models/female/" }: they',
    options,
  );
  const { signal } = options;
  checkSignal(signal);
  checkCallback("onProgress", options.onProgress);
  checkCallback("createWorker", options.createWorker);
  signal?.throwIfAborted();
  const request = toRequest(options);
  return new Promise((resolve, reject) => {
    const worker = startWorker(options.createWorker);
    const finish = (end: () => void) => {
      signal?.removeEventListener("abort", onAbort);
      worker.onmessage = null;
      worker.onerror = null;
      end();
    };
    const fail = (error: unknown) =>
      finish(() => {
        worker.terminate();
        reject(error);
      });
    const onAbort = () => fail(signal?.reason);
    signal?.addEventListener("abort", onAbort);
    worker.onerror = (event) => fail(brokenWorker(event));
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      if (data.type === "progress") options.onProgress?.(data.progress);
      if (data.type === "failed") fail(new DynaSkinError(data.code, data.message));
      if (data.type === "ready") finish(() => resolve(new WorkerAvatar(worker, data)));
    };
    worker.postMessage(request);
  });
}

function toRequest({ model, wasm, shape }: WorkerAvatarOptions): Request {
  if (typeof model !== "string" && !(model instanceof URL)) {
    throw new DynaSkinError(
      "argument",
      "model must be the address of a model's folder; a worker fetches the files by itself.",
    );
  }
  const request: Request = { type: "load", model: absolute(model) };
  if (wasm) request.wasm = wasm instanceof URL || typeof wasm === "string" ? absolute(wasm) : wasm;
  if (shape !== undefined) {
    checkLength("shape", shape, SHAPE_LENGTH);
    request.shape = Array.from(shape);
  }
  return request;
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
