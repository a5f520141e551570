import { kindOf } from "./check.js";
import { DynaSkinError } from "./error.js";

/**
 * Where a file's bytes come from: a URL (absolute, or relative to the page), the bytes themselves,
 * or a response that is already under way.
 */
export type FileSource = string | URL | ArrayBuffer | ArrayBufferView | Blob | Response;

/** How far a download is. */
export interface Progress {
  /** Bytes that have arrived, over all files. */
  loadedBytes: number;
  /** Bytes of all files as far as the servers have announced them; at least `loadedBytes`. */
  totalBytes: number;
}

/**
 * Adds up the progress of several downloads.
 *
 * @internal
 */
export class ProgressSum {
  readonly #parts: Progress[] = [];
  readonly #report: ((progress: Progress) => void) | undefined;

  constructor(report: ((progress: Progress) => void) | undefined) {
    this.#report = report;
  }

  /** A counter for one more file. */
  part(): (loadedBytes: number, totalBytes: number) => void {
    const part: Progress = { loadedBytes: 0, totalBytes: 0 };
    this.#parts.push(part);
    return (loadedBytes, totalBytes) => {
      part.loadedBytes = loadedBytes;
      part.totalBytes = Math.max(loadedBytes, totalBytes);
      this.#report?.(
        this.#parts.reduce(
          (sum, next) => ({
            loadedBytes: sum.loadedBytes + next.loadedBytes,
            totalBytes: sum.totalBytes + next.totalBytes,
          }),
          { loadedBytes: 0, totalBytes: 0 },
        ),
      );
    };
  }
}

/** @internal */
export interface ReadOptions {
  /** What the file is, for error messages: `the body`. */
  what: string;
  /** Size over which the file is refused, and a download stopped. */
  maxBytes?: number;
  signal?: AbortSignal | undefined;
  onProgress?: ((loadedBytes: number, totalBytes: number) => void) | undefined;
}

/**
 * Reads a file to its end.
 *
 * @throws DynaSkinError `fetch` when it cannot be downloaded or is larger than `maxBytes`.
 * @internal
 */
export async function readBytes(source: FileSource, options: ReadOptions): Promise<Uint8Array> {
  options.signal?.throwIfAborted();
  if (source instanceof ArrayBuffer) {
    checkSize(source.byteLength, options);
    return new Uint8Array(source);
  }
  if (ArrayBuffer.isView(source)) {
    checkSize(source.byteLength, options);
    return new Uint8Array(source.buffer, source.byteOffset, source.byteLength);
  }
  if (typeof Blob !== "undefined" && source instanceof Blob) {
    checkSize(source.size, options);
    return new Uint8Array(await source.arrayBuffer());
  }
  if (typeof Response !== "undefined" && source instanceof Response) {
    return readResponse(source, source.url || options.what, options);
  }
  if (typeof source !== "string" && !(source instanceof URL)) {
    throw new DynaSkinError(
      "argument",
      `For ${options.what}, give an address, bytes, a Blob or a Response; got ${kindOf(source)}.`,
    );
  }
  const address = String(source);
  const fromDisk = address.startsWith("file:") ? await readFromDisk(address, options) : null;
  return fromDisk ?? readResponse(await open(address, options), address, options);
}

function checkSize(bytes: number, { what, maxBytes = Number.POSITIVE_INFINITY }: ReadOptions) {
  if (bytes <= maxBytes) return;
  const [size, limit] = [bytes, maxBytes].map((number) => Math.ceil(number / 2 ** 20));
  throw new DynaSkinError("fetch", `${what} has ${size} MiB; at most ${limit} MiB are read.`);
}

async function open(address: string, { what, signal }: ReadOptions): Promise<Response> {
  try {
    return await fetch(address, signal ? { signal } : {});
  } catch (cause) {
    signal?.throwIfAborted();
    throw new DynaSkinError("fetch", `Could not download ${what} from ${address}.`, { cause });
  }
}

/**
 * A download that somebody else reads, such as the browser's compiler while it arrives.
 *
 * @internal
 */
export interface Download {
  /** The bytes, counted as they are read. */
  body: ReadableStream<Uint8Array>;
  /** The file's first byte, once it has come. */
  readonly firstByte: number | undefined;
  /** Why the download broke off; null as long as it has not. */
  readonly failure: unknown;
}

/**
 * Begins to download a file for somebody else to read; null for what is no download.
 *
 * @throws DynaSkinError `fetch` where the server has no such file.
 * @internal
 */
export async function openDownload(
  source: FileSource,
  options: ReadOptions,
): Promise<Download | null> {
  const isResponse = typeof Response !== "undefined" && source instanceof Response;
  const isAddress = typeof source === "string" || source instanceof URL;
  if ((!isResponse && !isAddress) || String(source).startsWith("file:")) return null;
  options.signal?.throwIfAborted();
  const response = isResponse ? source : await open(String(source), options);
  const address = isResponse ? source.url || options.what : String(source);
  checkAnswer(response, address, options);
  if (!response.body || response.bodyUsed) return null;
  return countedDownload(response, response.body, address, options);
}

function countedDownload(
  response: Response,
  stream: ReadableStream<Uint8Array>,
  address: string,
  { what, signal, onProgress }: ReadOptions,
): Download {
  const announced = Number(response.headers.get("content-length")) || 0;
  const reader = stream.getReader();
  let loaded = 0;
  const state: { firstByte: number | undefined; failure: unknown } = {
    firstByte: undefined,
    failure: null,
  };
  const pull = async (controller: ReadableStreamDefaultController<Uint8Array>) => {
    try {
      const { done, value } = await reader.read();
      if (done) {
        controller.close();
        return;
      }
      state.firstByte ??= value[0];
      loaded += value.length;
      onProgress?.(loaded, announced);
      controller.enqueue(value);
    } catch (cause) {
      const message = `The download of ${what} from ${address} broke off.`;
      state.failure = signal?.aborted
        ? signal.reason
        : new DynaSkinError("fetch", message, { cause });
      reader.cancel().catch(() => {});
      controller.error(state.failure);
    }
  };
  const body = new ReadableStream<Uint8Array>({ pull, cancel: (why) => reader.cancel(why) });
  return Object.assign(state, { body });
}

function checkAnswer({ ok, status }: Response, address: string, { what }: ReadOptions): void {
  if (ok) return;
  throw new DynaSkinError(
    "fetch",
    `Could not download ${what} from ${address}: the server answered ${status}.`,
  );
}

async function readResponse(
  response: Response,
  address: string,
  options: ReadOptions,
): Promise<Uint8Array> {
  const { what, signal, onProgress } = options;
  checkAnswer(response, address, options);
  const announced = Number(response.headers.get("content-length")) || 0;
  const chunks: Uint8Array[] = [];
  let loaded = 0;
  const reader = response.body?.getReader();
  try {
    while (reader) {
      const { done, value } = await reader.read().catch((cause) => {
        signal?.throwIfAborted();
        throw new DynaSkinError("fetch", `The download of ${what} from ${address} broke off.`, {
          cause,
        });
      });
      if (done) break;
      chunks.push(value);
      loaded += value.length;
      // Counted as it arrives: the announced length is that of packed bytes, or is missing.
      checkSize(loaded, options);
      onProgress?.(loaded, announced);
    }
  } catch (error) {
    // Nobody will read the rest; that cancelling fails too, nobody needs to know.
    reader?.cancel().catch(() => {});
    throw error;
  }
  return join(chunks, loaded);
}

function join(chunks: Uint8Array[], length: number): Uint8Array {
  const bytes = new Uint8Array(length);
  let offset = 0;
  for (const chunk of chunks) {
    bytes.set(chunk, offset);
    offset += chunk.length;
  }
  return bytes;
}

interface NodeProcess {
  getBuiltinModule?: (name: "node:fs/promises") => {
    stat(path: URL): Promise<{ size: number }>;
    readFile(path: URL, options: { signal?: AbortSignal }): Promise<Uint8Array>;
  };
}

/** Node's `fetch` knows no `file:`; an import of `node:fs` would break bundlers, so it is asked for. */
async function readFromDisk(address: string, options: ReadOptions): Promise<Uint8Array | null> {
  const { what, signal, onProgress } = options;
  const { process } = globalThis as { process?: NodeProcess };
  const files = process?.getBuiltinModule?.("node:fs/promises");
  if (!files) return null;
  const failed = (cause: unknown) => {
    signal?.throwIfAborted();
    throw new DynaSkinError("fetch", `Could not read ${what} from ${address}.`, { cause });
  };
  const url = new URL(address);
  checkSize((await files.stat(url).catch(failed)).size, options);
  const bytes = await files.readFile(url, signal ? { signal } : {}).catch(failed);
  onProgress?.(bytes.length, bytes.length);
  return bytes;
}

/** Letters of a file that are looked at to tell what it is. */
const FIRST_BYTES = 64;

/**
 * Whether a file is a page of HTML: its first letter is `<`, with which no JSON, GLB, ONNX or WebAssembly
 * begins.
 *
 * @internal
 */
export function isWebPage(bytes: Uint8Array): boolean {
  return /^\s*</.test(new TextDecoder().decode(bytes.subarray(0, FIRST_BYTES)));
}

/**
 * Where a file is, for error messages; null for bytes and for addresses that hold the bytes.
 *
 * @internal
 */
export function addressOf(source: unknown): string | null {
  const fetched = typeof Response !== "undefined" && source instanceof Response;
  const address = fetched ? source.url : source;
  if (typeof address !== "string" && !(address instanceof URL)) return null;
  return /^(data:|$)/.test(String(address)) ? null : String(address);
}
