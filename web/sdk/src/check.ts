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
 * The kind of a value, for messages.
 *
 * @internal
 */
export function kindOf(value: unknown): string {
  return value === null ? "null" : typeof value;
}
