/**
 * dynaskin with a much smaller core: the same as the main entry, without tract, which reads
 * and runs ONNX files. It plays bundles whose networks `dynaskin slim` has lowered, and refuses
 * others.
 *
 * @module
 */
import type { Glue } from "../core.js";
import { type LoadBodyOptions, type LoadOptions, loadBodyWith, loadForm } from "../load.js";
import type { Body, Model } from "../model.js";
import type { WasmSource } from "../wasm/instantiate.js";
import * as glue from "../wasm/slim.js";

export * from "../index.js";

/**
 * Loads a model as the main entry's `load` does, with the lowered networks that `bundle.json` names;
 * of {@link ModelFiles}, `predictor` and `decoder` are the lowered files. After the main entry's `load`, this one uses
 * that core, which plays both kinds of files; a main entry's `load` that comes later starts the whole core beside this
 * one.
 *
 * @throws DynaSkinError as `load` of the main entry; `bundle` where the bundle names no lowered networks,
 *   `network` for an ONNX file and for files of another version of dynaskin
 */
export async function load(options: LoadOptions): Promise<Model> {
  // The same classes, generated once more.
  return loadForm(withWasm(options), "lowered", glue as unknown as Glue);
}

/**
 * Loads a body alone as the main entry's `loadBody` does.
 *
 * @throws DynaSkinError as `loadBody` of the main entry
 */
export async function loadBody(options: LoadBodyOptions): Promise<Body> {
  return loadBodyWith(withWasm(options), glue as unknown as Glue);
}

/** Options with this entry's WebAssembly file, unless they name another. */
function withWasm<Options extends { wasm?: WasmSource }>(options: Options): Options {
  const wasm = options?.wasm ?? new URL("../wasm/slim_bg.wasm", import.meta.url);
  return { ...options, wasm };
}
