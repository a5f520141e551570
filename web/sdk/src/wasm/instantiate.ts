import { DynaSkinError } from "../error.js";
import { addressOf, type Download, type FileSource, isWebPage, openDownload, readBytes } from "../source.js";

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
  const download = canStream() ? await openDownload(source, options) : null;
  if (download) return compileDownload(download, source, options);
  const bytes = await readBytes(source, options);
  try {
    return await WebAssembly.compile(bytes as Uint8Array<ArrayBuffer>);
  } catch (cause) {
    throw refusal(cause, options.what, isWebPage(bytes), source);
  }
}

function canStream(): boolean {
  return typeof WebAssembly.compileStreaming === "function" && typeof Response === "function";
}

/** Compiles while the file arrives, whatever type the server says that it has. */
async function compileDownload(
  download: Download,
  source: WasmSource,
  { what }: CompileOptions,
): Promise<WebAssembly.Module> {
  const headers = { "content-type": "application/wasm" };
  try {
    return await WebAssembly.compileStreaming(new Response(download.body, { headers }));
  } catch (cause) {
    if (download.failure !== null) throw download.failure;
    throw refusal(cause, what, isWebPage(Uint8Array.of(download.firstByte ?? 0)), source);
  }
}

/** The smallest module with a SIMD instruction: `i32.const 0`, `i8x16.splat`. */
const SIMD_PROBE = Uint8Array.of(
  ...[0, 97, 115, 109, 1, 0, 0, 0],
  ...[1, 5, 1, 96, 0, 1, 123],
  ...[3, 2, 1, 0],
  ...[10, 8, 1, 6, 0, 65, 0, 253, 15, 11],
);

function refusal(cause: unknown, what: string, isPage: boolean, source: WasmSource): DynaSkinError {
  const address = addressOf(source);
  return new DynaSkinError("wasm", explain(cause, what, isPage, address), { cause });
}

function explain(cause: unknown, what: string, isPage: boolean, address: string | null): string {
  const reason = cause instanceof Error ? cause.message : String(cause);
  if (/unsafe-eval|Content Security Policy|disallowed by embedder/i.test(reason)) {
    return (
      `The page's content security policy forbids WebAssembly (${what}). ` +
      "Add 'wasm-unsafe-eval' to script-src."
    );
  }
  if (isPage) {
    return (
      `There is a web page where ${what} should be${address ? `: ${address}` : ""}. ` +
      "Check that the .wasm file is served, or hand it to load() as `wasm`."
    );
  }
  if (!WebAssembly.validate(SIMD_PROBE)) {
    return `This browser has no WebAssembly SIMD, which ${what} needs (all have it since 2023).`;
  }
  return `The browser could not compile ${what}: ${reason}.`;
}
