// What is refused before anything is sent to a worker, and why a worker cannot go on.
import { checkNumber } from "../check.js";
import { DynaSkinError } from "../error.js";

/** Sizes that the core takes. */
const [MIN_SCALE, MAX_SCALE] = [0.1, 10];

/** Longest time step there is. */
const DAY_SECONDS = 86_400;

/** Why a worker did not start, or stopped. */
export function brokenWorker(reason: unknown, options?: ErrorOptions): DynaSkinError {
  const message = (reason as { message?: unknown } | null)?.message ?? "";
  if (/TrustedScript/.test(String(message))) {
    return new DynaSkinError(
      "worker",
      "The page's content security policy asks for Trusted Types: give the worker's address as a " +
        `TrustedScriptURL (workerScript), or the worker itself (createWorker). ${message}`,
      options,
    );
  }
  if ((reason as { name?: unknown } | null)?.name === "SecurityError") {
    return new DynaSkinError(
      "worker",
      "The worker's script comes from another origin than the page, which browsers refuse. Give createWorker: " +
        `a worker of a blob that imports the script (docs/hosting.md). ${message}`,
      options,
    );
  }
  return new DynaSkinError(
    "worker",
    "The worker could not be started, or stopped. The page's content security policy must allow " +
      `worker-src 'self', and the bundler must have copied worker/thread.js. ${message}`,
    options,
  );
}

/** Why a worker was given up. */
export function silentWorker(timeoutMs: number): DynaSkinError {
  return new DynaSkinError(
    "worker",
    `The worker was silent for ${timeoutMs} ms while an answer was due (the option timeoutMs), and ` +
      "was ended. Is thread.js what runs in it, and does it live?",
  );
}

/** Refuses what is no time to wait. */
export function checkTimeout(timeoutMs: number): void {
  checkNumber("timeoutMs", timeoutMs);
  if (timeoutMs > 0) return;
  throw new DynaSkinError(
    "argument",
    `timeoutMs must be milliseconds above 0, or Infinity to wait for ever; got ${timeoutMs}.`,
  );
}

/** Refuses a bad time. Here and not in the worker alone: times of poses that wait add up, and would hide a bad one. */
export function checkTimeStep(dtSeconds: number): void {
  checkNumber("dtSeconds", dtSeconds);
  if (dtSeconds >= 0 && dtSeconds <= DAY_SECONDS) return;
  throw new DynaSkinError(
    "argument",
    `dtSeconds must be 0 to ${DAY_SECONDS} seconds (not milliseconds), got ${dtSeconds}.`,
  );
}

/** Why nothing can be asked any more. */
export function disposed(what: string): DynaSkinError {
  return new DynaSkinError("disposed", `This ${what} was used after dispose().`);
}

/** Refuses a size that the core would refuse. */
export function checkScale(factor: number): void {
  checkNumber("scale", factor);
  if (!(factor >= MIN_SCALE && factor <= MAX_SCALE)) {
    throw new DynaSkinError(
      "argument",
      `scale must be ${MIN_SCALE} to ${MAX_SCALE}, got ${factor}.`,
    );
  }
}
