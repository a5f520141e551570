import { DynaSkinError } from "../error.js";
import { type FileSource, readBytes } from "../source.js";

/** A WebAssembly file: where it is, its bytes, or the compiled module. */
export type WasmSource = FileSource | WebAssembly.Module;

/** @internal */
export interface CompileOptions {
  what: string;
  signal?: AbortSignal | undefined;
  onProgress?: ((loadedBytes: number, totalBytes: number) => void) | undefined;
}

/**
 * Downloads and compiles a WebAssembly file.
 *
 * @throws DynaSkinError `fetch` or `wasm`.
 * @internal
 */
export async function compile(
  source: WasmSource,
  options: CompileOptions,
): Promise<WebAssembly.Module> {
  if (typeof WebAssembly !== "object") {
    throw new DynaSkinError("wasm", "This browser has no WebAssembly, which dynaskin needs.");
  }
  if (source instanceof WebAssembly.Module) return source;
  const bytes = await readBytes(source, options);
  try {
    return await WebAssembly.compile(bytes as Uint8Array<ArrayBuffer>);
  } catch (cause) {
    throw new DynaSkinError("wasm", explain(cause, options.what), { cause });
  }
}

function explain(cause: unknown, what: string): string {
  const reason = cause instanceof Error ? cause.message : String(cause);
  if (/unsafe-eval|Content Security Policy|disallowed by embedder/i.test(reason)) {
    return (
      `The page's content security policy forbids WebAssembly (${what}). ` +
      "Add 'wasm-unsafe-eval' to script-src."
    );
  }
  return `The browser could not compile ${what}: ${reason}. It needs WebAssembly with SIMD.`;
}
