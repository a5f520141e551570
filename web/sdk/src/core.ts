import { DynaSkinError } from "./error.js";
import { Instance } from "./instance.js";
import { VERSION } from "./version.js";
import * as glue from "./wasm/core.js";
import { compile, type WasmSource } from "./wasm/instantiate.js";

/**
 * The JavaScript that was generated with a core, and runs no other.
 *
 * @internal
 */
export type Glue = typeof glue;

/**
 * The instantiated core: the generated classes and its memory.
 *
 * @internal
 */
export class Core extends Instance {
  readonly glue: Glue;
  readonly memory: WebAssembly.Memory;
  /** The crash of the core before this one; null for the first. */
  readonly restartedAfter: DynaSkinError | null;

  constructor(glue: Glue, memory: WebAssembly.Memory, restartedAfter: DynaSkinError | null = null) {
    super();
    this.glue = glue;
    this.memory = memory;
    this.restartedAfter = restartedAfter;
  }
}

/** A core that runs or starts, and what it was started from. */
interface Started {
  core: Promise<Core>;
  source: WasmSource | undefined;
}

/** The cores of this page, by what was generated with them: at most the whole one and the slim one. */
const cores = new Map<Glue, Started>();

/**
 * Starts a core once; calls that come while it starts, or later, share it. The whole core stands in for a slim one that
 * has not started, because it plays the same. A start that failed may be tried again, and after a crash a new one
 * starts. Another `source` than that of the core that runs is compiled all the same: a file that cannot be used must
 * not go unnoticed because of what happened to be loaded before.
 *
 * @param own - what was generated with `source`
 * @internal
 */
export async function startCore(
  source: WasmSource | undefined,
  onProgress?: (loadedBytes: number, totalBytes: number) => void,
  own: Glue = glue,
): Promise<Core> {
  const kind = cores.has(own) || !cores.has(glue) ? own : glue;
  const running = cores.get(kind);
  if (running && source !== undefined && !isSame(source, running.source)) {
    await compile(source, { what: WHAT, onProgress });
  }
  const shared = cores.get(kind) ?? begin(kind, start(source, onProgress, kind), source);
  const core = await shared.core;
  if (!core.crash) return core;
  // Of several calls the first starts it.
  if (cores.get(kind) === shared) begin(kind, restart(core.crash, kind), shared.source);
  return cores.get(kind)?.core ?? startCore(source, onProgress, own);
}

/** Takes note of a core that starts, for as long as it has not failed. */
function begin(kind: Glue, core: Promise<Core>, source: WasmSource | undefined): Started {
  const started = { core, source };
  cores.set(kind, started);
  core.catch(() => {
    if (cores.get(kind) === started) cores.delete(kind);
  });
  return started;
}

/** The same file anew, with a memory of its own. Objects of the one before cannot be used with it. */
async function restart(crash: DynaSkinError, own: Glue): Promise<Core> {
  try {
    own.__wbg_reset_state();
    // It runs, so this only gives what it exports.
    const { memory } = own.initSync({ module: new Uint8Array() });
    return new Core(own, memory, crash);
  } catch (cause) {
    throw new DynaSkinError(
      "wasm",
      "The dynaskin core crashed and could not be started again; reload the page.",
      { cause },
    );
  }
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
  own: Glue,
): Promise<Core> {
  const module = await compile(source ?? new URL("./wasm/core_bg.wasm", import.meta.url), {
    what: WHAT,
    onProgress,
  });
  try {
    const { memory } = await own.default({ module_or_path: module });
    checkVersion(own.coreVersion());
    return new Core(own, memory);
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
  readonly #core: Core;
  readonly #locate: () => number;
  /** Numbers in it. */
  readonly length: number;
  #view: Float32Array;

  constructor(core: Core, locate: () => number, length: number) {
    this.#core = core;
    this.#locate = locate;
    this.length = length;
    this.#view = this.#make();
  }

  /** The array as it is now; throws `crashed`. */
  get view(): Float32Array {
    this.#core.assertSound();
    if (this.#view.buffer !== this.#core.memory.buffer) this.#view = this.#make();
    return this.#view;
  }

  #make(): Float32Array {
    const start = this.#core.guard(this.#locate);
    return new Float32Array(this.#core.memory.buffer, start, this.length);
  }
}
