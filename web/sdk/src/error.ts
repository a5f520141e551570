/**
 * What went wrong, as a word a program can switch on. The message says it in a sentence.
 *
 * From the SDK:
 * - `fetch`: a file could not be downloaded or read; the message names it.
 * - `wasm`: WebAssembly could not be compiled or started (too old a browser, or a content security
 *   policy without `'wasm-unsafe-eval'`).
 * - `crashed`: the WebAssembly instance trapped, by a bug or for want of memory. Nothing made from it
 *   works any more, and all of it says so; `load` starts a new one (see `Model.restartedAfter`).
 * - `disposed`: the object was used after `dispose()`.
 * - `argument`: an argument has the wrong type or length.
 *
 * Other codes come from the core and name what was refused (a bundle, a body, a network, a pose, a
 * shape, a motion).
 */
export type DynaSkinErrorCode =
  | "fetch"
  | "wasm"
  | "crashed"
  | "disposed"
  | "argument"
  | (string & {});

/** The one error type this package throws, apart from the reason of an aborted `signal`. */
export class DynaSkinError extends Error {
  /** What went wrong, as a word a program can switch on. */
  readonly code: DynaSkinErrorCode;

  constructor(code: DynaSkinErrorCode, message: string, options?: ErrorOptions) {
    super(message, options);
    this.name = "DynaSkinError";
    this.code = code;
  }
}

/**
 * Whether WebAssembly stopped in the middle of a call. Overflown stacks are errors of JavaScript, which
 * engines word differently.
 *
 * @internal
 */
export function isTrap(error: unknown): boolean {
  if (error instanceof WebAssembly.RuntimeError) return true;
  return error instanceof Error && /call stack|too much recursion/i.test(error.message);
}

/** @internal */
export function crashedBy(trap: unknown): DynaSkinError {
  const reason = trap instanceof Error ? trap.message : String(trap);
  return new DynaSkinError(
    "crashed",
    `The WebAssembly core stopped unexpectedly (${reason}), and what was loaded with it is unusable. ` +
      "Load the model again, which starts a new core, and please report what led here.",
    { cause: trap },
  );
}

/** @internal */
export function toDynaSkinError(error: unknown): DynaSkinError {
  if (error instanceof DynaSkinError) return error;
  if (isTrap(error)) return crashedBy(error);
  const code = (error as { code?: unknown } | null)?.code;
  const message = error instanceof Error ? error.message : String(error);
  return new DynaSkinError(typeof code === "string" ? code : "internal", message, { cause: error });
}
