/**
 * dynaskin in one JavaScript file: the same as the main entry, with the WebAssembly inside. For
 * bundlers that do not copy files (esbuild), and for pages that must not fetch any. As large as
 * the compressed file, which is decompressed at each start.
 *
 * @module
 */
import { type LoadOptions, load as loadWith } from "../load.js";
import type { Model } from "../model.js";
import { CORE_GZIP_BASE64 } from "../wasm/core-inline.js";
import { compile } from "../wasm/instantiate.js";

export * from "../index.js";

/**
 * Loads a model like the main entry's `load`; the WebAssembly is in this module, so leave out `wasm`.
 *
 * @throws DynaSkinError as `load` of the main entry
 */
export async function load(options: LoadOptions): Promise<Model> {
  return loadWith({ ...options, wasm: options?.wasm ?? (await unpackOnce()) });
}

let unpacked: Promise<WebAssembly.Module> | null = null;

/** Unpacked and compiled for the first model; later ones share it. */
function unpackOnce(): Promise<WebAssembly.Module> {
  if (!unpacked) {
    unpacked = compile(unpack(), { what: "the dynaskin core" });
    unpacked.catch(() => {
      unpacked = null;
    });
  }
  return unpacked;
}

function unpack(): Response {
  const packed = Uint8Array.from(atob(CORE_GZIP_BASE64), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip")));
}
