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
 * Refuses what is neither left out nor true or false.
 *
 * @internal
 */
export function checkFlag(what: string, value: unknown): void {
  if (value === undefined || typeof value === "boolean") return;
  throw new DynaSkinError("argument", `${what} must be true or false, got ${kindOf(value)}.`);
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

/** Bytes over which a state is refused before it is copied: one has some hundred thousand. */
const MAX_STATE_BYTES = 16 * 2 ** 20;

/**
 * Refuses what is no saved state.
 *
 * @internal
 */
export function checkState(state: unknown): asserts state is Uint8Array {
  if (!(state instanceof Uint8Array)) {
    throw new DynaSkinError("argument", "A saved state is a Uint8Array, as save() gives it.");
  }
  if (state.length <= MAX_STATE_BYTES) return;
  throw new DynaSkinError(
    "state",
    `This is no saved state: it has ${Math.ceil(state.length / 2 ** 20)} MiB, and states have less than one.`,
  );
}

/** Letters of a name, at most. */
const MAX_LETTERS = 1000;

/**
 * Refuses what is no string, or a longer one than any name.
 *
 * @internal
 */
export function checkName(what: string, value: unknown): void {
  if (typeof value !== "string") {
    throw new DynaSkinError("argument", `${what} must be a string, got ${kindOf(value)}.`);
  }
  if (value.length <= MAX_LETTERS) return;
  throw new DynaSkinError(
    "argument",
    `${what} has ${value.length} letters; at most ${MAX_LETTERS} are taken.`,
  );
}
