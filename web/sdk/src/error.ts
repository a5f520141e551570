/**
 * The kind of an error, as a string that a program can switch on. The message explains it in a sentence.
 *
 * From the SDK:
 * - `fetch`: a file could not be downloaded or read; the message names it.
 * - `wasm`: WebAssembly could not be compiled or started (too old a browser, or a content security
 *   policy without `'wasm-unsafe-eval'`).
 * - `crashed`: the WebAssembly instance trapped, because of a bug or lack of memory. Every object made
 *   from it throws this from then on; `load` starts a new instance (see `Model.restartedAfter`).
 * - `disposed`: the object was used after `dispose()`.
 * - `argument`: an argument has the wrong type or length, or is out of range.
 * - `worker`: a web worker could not be started, stopped, or was silent for too long.
 * - `lost`: the renderer's graphics device is lost.
 * - `internal`: a bug in dynaskin.
 *
 * Other codes name what was refused: `bundle`, `body`, `network`, `pose`, `shape`, `motion`, `state`; when
 * an avatar is bound `adult`, `humanoid`, `avatar`, `binding`; in the renderer `no-adapter`,
 * `no-read-back`, `gpu`.
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
  /** The kind of the error, as a string that a program can switch on. */
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
