// What a worker's avatar refuses before anything is sent, and why it cannot go on.
import { checkNumber } from "../check.js";
import { DynaSkinError } from "../error.js";

/** Sizes that the core takes. */
const [MIN_SCALE, MAX_SCALE] = [0.1, 10];

/** Longest time step there is. */
const DAY_SECONDS = 86_400;

/** Why a worker did not start, or stopped. */
export function brokenWorker(reason: unknown, options?: ErrorOptions): DynaSkinError {
  const message = (reason as { message?: unknown } | null)?.message ?? "";
  return new DynaSkinError(
    "worker",
    "The worker could not be started, or stopped. The page's content security policy must allow " +
      `worker-src 'self', and the bundler must have copied worker/thread.js. ${message}`,
    options,
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

/** Why nothing can be asked of an avatar any more. */
export function disposed(): DynaSkinError {
  return new DynaSkinError("disposed", "This avatar was used after dispose().");
}

/** Refuses a size that the core would refuse. The page must know: it turns a waiting pose to it. */
export function checkScale(factor: number): void {
  checkNumber("scale", factor);
  if (!(factor >= MIN_SCALE && factor <= MAX_SCALE)) {
    throw new DynaSkinError(
      "argument",
      `scale must be ${MIN_SCALE} to ${MAX_SCALE}, got ${factor}.`,
    );
  }
}
