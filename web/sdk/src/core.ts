import { DynaSkinError } from "./error.js";
import { VERSION } from "./version.js";
import * as glue from "./wasm/core.js";
import { compile, type WasmSource } from "./wasm/instantiate.js";

/**
 * The instantiated core: the generated classes and its memory.
 *
 * @internal
 */
export interface Core {
  readonly glue: typeof glue;
  readonly memory: WebAssembly.Memory;
}

let starting: { core: Promise<Core>; source: WasmSource | undefined } | null = null;

/**
 * Starts the core once; calls that come while it starts, or later, share it. A start that failed
 * may be tried again. Another `source` than that of the core that runs is compiled all the same: a
 * file that cannot be used must not go unnoticed because of what happened to be loaded before.
 *
 * @internal
 */
export async function startCore(
  source: WasmSource | undefined,
  onProgress?: (loadedBytes: number, totalBytes: number) => void,
): Promise<Core> {
  if (starting && source !== undefined && !isSame(source, starting.source)) {
    await compile(source, { what: WHAT, onProgress });
  }
  if (!starting) {
    const core = start(source, onProgress);
    starting = { core, source };
    core.catch(() => {
      starting = null;
    });
  }
  return starting.core;
}

function isSame(source: WasmSource, started: WasmSource | undefined): boolean {
  const isAddress = (file: WasmSource | undefined) =>
    typeof file === "string" || file instanceof URL;
  if (isAddress(source) && isAddress(started)) return String(source) === String(started);
  return source === started;
}

const WHAT = "the dynaskin core";

async function start(
  source: WasmSource | undefined,
  onProgress: ((loadedBytes: number, totalBytes: number) => void) | undefined,
): Promise<Core> {
  const module = await compile(source ?? new URL("./wasm/core_bg.wasm", import.meta.url), {
    what: WHAT,
    onProgress,
  });
  try {
    const { memory } = await glue.default({ module_or_path: module });
    checkVersion(glue.coreVersion());
    return { glue, memory };
  } catch (cause) {
    if (cause instanceof DynaSkinError) throw cause;
    throw new DynaSkinError(
      "wasm",
      "The dynaskin core could not be started; is its .wasm file the one of this package's version " +
        `(${VERSION})?`,
      { cause },
    );
  }
}

/**
 * Refuses a core of another version: its calls may mean something else.
 *
 * @internal
 */
export function checkVersion(coreVersion: string): void {
  if (coreVersion === VERSION) return;
  throw new DynaSkinError(
    "wasm",
    `The dynaskin core is version ${coreVersion}, the package is version ${VERSION}: ` +
      "serve the .wasm file that came with the package.",
  );
}

/**
 * An array in the core's memory. The memory moves when it grows, which empties every view on it,
 * so a view is made anew when that happened.
 *
 * @internal
 */
export class CoreArray {
  readonly #memory: WebAssembly.Memory;
  readonly #locate: () => number;
  readonly #length: number;
  #view: Float32Array;

  constructor(memory: WebAssembly.Memory, locate: () => number, length: number) {
    this.#memory = memory;
    this.#locate = locate;
    this.#length = length;
    this.#view = this.#make();
  }

  /** The array as it is now. */
  get view(): Float32Array {
    if (this.#view.buffer !== this.#memory.buffer) this.#view = this.#make();
    return this.#view;
  }

  #make(): Float32Array {
    return new Float32Array(this.#memory.buffer, this.#locate(), this.#length);
  }
}
