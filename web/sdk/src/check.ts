import { DynaSkinError } from "./error.js";

/**
 * Refuses what is no number. WebAssembly would turn strings into numbers and throw at others.
 *
 * @internal
 */
export function checkNumber(what: string, value: unknown): void {
  if (typeof value === "number") return;
  throw new DynaSkinError("argument", `${what} must be a number, got ${kindOf(value)}.`);
}

/**
 * Refuses what is no plain object of options.
 *
 * @internal
 */
export function checkObject(what: string, value: unknown): void {
  if (typeof value === "object" && value !== null) return;
  throw new DynaSkinError("argument", `${what} must be an object, got ${kindOf(value)}.`);
}

/**
 * Refuses what is neither left out nor a function.
 *
 * @internal
 */
export function checkCallback(what: string, value: unknown): void {
  if (value === undefined || typeof value === "function") return;
  throw new DynaSkinError("argument", `${what} must be a function, got ${kindOf(value)}.`);
}

/**
 * Refuses what is neither left out nor a signal that can be asked whether it was aborted.
 *
 * @internal
 */
export function checkSignal(signal: unknown): void {
  if (signal === undefined) return;
  if (typeof (signal as AbortSignal | null)?.throwIfAborted === "function") return;
  throw new DynaSkinError(
    "argument",
    `signal must be an AbortSignal, such as the signal of an AbortController; got ${kindOf(signal)}.`,
  );
}

/**
 * The kind of a value, for messages.
 *
 * @internal
 */
export function kindOf(value: unknown): string {
  return value === null ? "null" : typeof value;
}

/**
 * Refuses what is no saved state.
 *
 * @internal
 */
export function checkState(state: unknown): asserts state is Uint8Array {
  if (state instanceof Uint8Array) return;
  throw new DynaSkinError("argument", "A saved state is a Uint8Array, as save() gives it.");
}
