// How a worker starts, with or without a model.
import { checkCallback, checkSignal } from "../check.js";
import { DynaSkinError } from "../error.js";
import { StartWatch } from "./diagnosis.js";
import { Link, type News } from "./link.js";
import { brokenWorker, checkTimeout } from "./refusals.js";

/**
 * A `TrustedScriptURL` that the page's policy makes from the address of `dynaskin/worker/thread`. Not
 * every TypeScript version has that type.
 */
export interface TrustedScriptAddress {
  toString(): string;
}

/** How a worker starts, and when it counts as lost. */
export interface ThreadOptions {
  /** The WebAssembly file, if the bundler cannot find it. */
  wasm?: string | URL | ArrayBuffer | WebAssembly.Module;
  /** Makes the worker, if the bundler cannot find `dynaskin/worker/thread`. dynaskin owns it from then on. */
  createWorker?: () => Worker;
  /**
   * The address from which the page serves `dynaskin/worker/thread`, if its content security
   * policy has `require-trusted-types-for 'script'`: a `TrustedScriptURL` of your own policy. In place
   * of `createWorker`.
   */
  workerScript?: TrustedScriptAddress;
  /**
   * Milliseconds for which the worker may be silent while an answer is due; then it is terminated, and
   * all pending promises reject with the code `worker`. Browsers do not report that a worker was
   * terminated or ran out of memory, so it takes this long, and up to a quarter longer, to notice. By
   * default 30,000; `Infinity` for no limit. While it loads, the worker reports that it
   * is alive, so a slow download does not count as silence, nor does time in which the page is blocked.
   */
  timeoutMs?: number;
  /** Ends the worker while it loads or reads; the promise then rejects with the signal's reason. */
  signal?: AbortSignal;
}

const DEFAULT_TIMEOUT_MS = 30_000;

/** A worker that loads says that it is alive so often, or more often where its page is impatient. */
const ALIVE_EVERY_MS = 1000;

/** Refuses options before anything starts. */
export function checkThread(options: ThreadOptions): void {
  const { signal, createWorker, workerScript, timeoutMs = DEFAULT_TIMEOUT_MS } = options;
  checkSignal(signal);
  checkCallback("createWorker", createWorker);
  if (createWorker !== undefined && workerScript !== undefined) {
    throw new DynaSkinError("argument", "Give createWorker or workerScript, not both of them.");
  }
  checkTimeout(timeoutMs);
  signal?.throwIfAborted();
}

/** Starts a worker; `onNews` is told how far it is. */
export function startThread(options: ThreadOptions, onNews: (news: News) => void): Link {
  const { createWorker, workerScript, timeoutMs = DEFAULT_TIMEOUT_MS } = options;
  const watch = new StartWatch(workerScript === undefined ? null : String(workerScript));
  try {
    return new Link(startWorker(createWorker, workerScript), timeoutMs, onNews, watch);
  } catch (error) {
    watch.stop();
    throw error;
  }
}

/** Closes the link when the signal is aborted while `work` is being done. */
export async function untilAborted<T>(
  link: Link,
  signal: AbortSignal | undefined,
  work: () => Promise<T>,
): Promise<T> {
  const onAbort = () => link.close(signal?.reason);
  signal?.addEventListener("abort", onAbort);
  try {
    return await work();
  } finally {
    signal?.removeEventListener("abort", onAbort);
  }
}

/** What a worker is told of its page. */
export function threadNeeds({ wasm, timeoutMs = DEFAULT_TIMEOUT_MS }: ThreadOptions): {
  wasm?: string | ArrayBuffer | WebAssembly.Module;
  aliveEveryMs: number;
} {
  const aliveEveryMs = Math.min(ALIVE_EVERY_MS, timeoutMs / 4);
  if (!wasm) return { aliveEveryMs };
  const isAddress = wasm instanceof URL || typeof wasm === "string";
  return { aliveEveryMs, wasm: isAddress ? absolute(wasm) : wasm };
}

function startWorker(
  create: (() => Worker) | undefined,
  script: TrustedScriptAddress | undefined,
): Worker {
  if (create) return made(create);
  if (typeof Worker !== "function") {
    throw new DynaSkinError("worker", "There are no web workers here; use load() instead.");
  }
  try {
    if (script !== undefined) return new Worker(script as string, { type: "module" });
    // In one piece, because bundlers look for exactly this.
    return new Worker(new URL("./thread.js", import.meta.url), { type: "module" });
  } catch (cause) {
    throw brokenWorker(cause, { cause });
  }
}

/** What the page's own function throws is the page's, but for what browsers refuse. */
function made(create: () => Worker): Worker {
  try {
    return create();
  } catch (cause) {
    const { name, message } = (cause ?? {}) as { name?: unknown; message?: unknown };
    const isRefused = name === "SecurityError" || /TrustedScript/.test(String(message));
    throw isRefused ? brokenWorker(cause, { cause }) : cause;
  }
}

/** A worker's relative addresses count from its own file, the caller's from the page. */
export function absolute(address: string | URL): string {
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
