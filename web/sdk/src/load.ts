import type { Bundle, BundleFile } from "./bundle.js";
import { checkCallback, checkObject, checkSignal } from "./check.js";
import { type Core, type Glue, startCore } from "./core.js";
import { DynaSkinError } from "./error.js";
import { checkIntegrity, isIntegrity } from "./integrity.js";
import { Body, Model } from "./model.js";
import {
  addressOf,
  type FileSource,
  isWebPage,
  type Progress,
  ProgressSum,
  readBytes,
} from "./source.js";
import type { WasmSource } from "./wasm/instantiate.js";

/** The files of a model, one by one. They must be those whose hashes the bundle names. */
export interface ModelFiles {
  /** `bundle.json`. */
  bundle: FileSource;
  /** The body, a GLB: {@link Bundle.body}. */
  body: FileSource;
  /** The network that turns motion into a latent vector, an ONNX file: {@link Bundle.predictor}. */
  predictor: FileSource;
  /** The network that turns that vector into offsets, an ONNX file: {@link Bundle.decoder}. */
  decoder: FileSource;
}

/** Size in bytes over which `load` refuses a body or a network and stops its download. */
const MAX_FILE_BYTES = 64 * 2 ** 20;

/** Size in bytes over which bundle.json is refused: it holds a list of vertices and some numbers. */
const MAX_BUNDLE_BYTES = 16 * 2 ** 20;

/** What {@link load} needs to know. */
export interface LoadOptions {
  /**
   * The folder that holds `bundle.json` and the files it names (with or without the final slash),
   * or the files themselves, as the packages `dynaskin-female` and `dynaskin-male` name them.
   */
  model: string | URL | ModelFiles;
  /**
   * A body that is already loaded, for networks that were made for it: its file is not
   * read again, and `dispose()` of the model does not free it. Several models may share a body.
   */
  body?: Body;
  /**
   * The WebAssembly file, if the bundler cannot find it beside this module. A page has one core per entry:
   * the first that started. Another file passed later is compiled, so that a bad one is reported, but not
   * used.
   */
  wasm?: WasmSource;
  /**
   * The SHA-256 that `bundle.json` must have, in the form of HTML's `integrity`: `sha256-` and the hash
   * in base64. bundle.json has the hashes of all other files, so this one covers the whole model:
   * use it if the files come from a server that you do not control.
   */
  integrity?: string;
  /** Stops the downloads; `load` then rejects with the signal's reason. */
  signal?: AbortSignal;
  /** Called as bytes arrive. If it throws, `load` rejects with that error. */
  onProgress?: (progress: Progress) => void;
  /**
   * Called as soon as the body is loaded, before the networks are: make an avatar of it and show
   * plain skinning in the meantime. It becomes the model's {@link Model.body}. The body matches the
   * hash in the bundle; {@link integrity} checks the bundle itself.
   */
  onBody?: (body: Body) => void;
}

/**
 * Loads a model: the WebAssembly core, the body and the two networks, in parallel. The files are read
 * only from the folder of `bundle.json`, whatever names it contains. Strings in the bundle and in error
 * messages come from its author: show them as text, never as HTML.
 *
 * @throws DynaSkinError `fetch` (also for a file over 64 MiB), `wasm`, or what the core
 *   refuses: `bundle` (also a wrong hash, or a `body` that is not the bundle's), `body`, `network`
 */
export async function load(options: LoadOptions): Promise<Model> {
  return loadForm(options, "onnx");
}

/**
 * Which files of a bundle hold its networks.
 *
 * @internal
 */
export type NetworkForm = "onnx" | "lowered";

/**
 * As {@link load}, with the networks in this form, and with `glue` where the core is not the whole one.
 *
 * @internal
 */
export async function loadForm(
  options: LoadOptions,
  form: NetworkForm,
  glue?: Glue,
): Promise<Model> {
  checkObject('load() needs options, such as { model: "/models/female/" }: they', options);
  const { signal, onBody } = options;
  if (options.body !== undefined && !(options.body instanceof Body)) {
    throw new DynaSkinError("argument", "body must be a Body, such as another model's body.");
  }
  if (options.integrity !== undefined && !isIntegrity(options.integrity)) {
    throw new DynaSkinError(
      "argument",
      'integrity must be "sha256-" and the 44 characters of a hash in base64, as HTML writes it.',
    );
  }
  checkSignal(signal);
  checkCallback("onProgress", options.onProgress);
  checkCallback("onBody", onBody);
  const progress = new ProgressSum(options.onProgress);
  const read = async (source: FileSource, what: string, maxBytes = MAX_FILE_BYTES) => {
    const bytes = await readBytes(source, { what, signal, maxBytes, onProgress: progress.part() });
    if (isWebPage(bytes)) throw webPage(what, source);
    return bytes;
  };

  const starting = startCore(options.wasm, progress.part(), glue);
  // A failure is reported below, at the first await that meets it.
  starting.catch(() => {});
  const sources = toSources(options.model, form);
  const bundleBytes = await read(sources.bundle, "bundle.json", MAX_BUNDLE_BYTES);
  if (options.integrity !== undefined) await checkIntegrity(bundleBytes, options.integrity);
  const bundle = parseBundle(bundleBytes, addressOf(sources.bundle));
  const shared = options.body;
  if (shared) checkBody(shared, bundle);
  const body = shared ? null : read(sources.file(bundle, "body"), "the body");
  const predictor = read(sources.file(bundle, "predictor"), "the predictor");
  const decoder = read(sources.file(bundle, "decoder"), "the decoder");
  for (const download of [body, predictor, decoder]) download?.catch(() => {});

  const core = await starting;
  if (shared) checkCore(shared, core);
  const loadedBody =
    shared ?? makeBody(core, bundle, bundleBytes, await (body as typeof predictor));
  try {
    onBody?.(loadedBody);
    const networks = [await predictor, await decoder] as const;
    signal?.throwIfAborted();
    const raw = core.guard(() => new core.glue.CoreModel(bundleBytes, loadedBody.raw, ...networks));
    return new Model(core, raw, loadedBody, bundle, shared === undefined);
  } catch (error) {
    if (!shared) loadedBody.dispose();
    throw error;
  }
}

/** What {@link loadBody} needs to know. */
export interface LoadBodyOptions extends Pick<LoadOptions, "wasm" | "signal" | "onProgress"> {
  /** The body's file, a GLB of `dynaskin body build` or `dynaskin body import`. */
  body: FileSource;
}

/**
 * Loads only a body, for which no networks have been trained yet: its avatars use plain skinning, with pose
 * correctives if the body has them. For a body with its networks, see {@link load}.
 *
 * @throws DynaSkinError `fetch` (also for a file over 64 MiB), `wasm`, `body` for another file
 */
export async function loadBody(options: LoadBodyOptions): Promise<Body> {
  return loadBodyWith(options);
}

/**
 * As {@link loadBody}, with `glue` where the core is not the whole one.
 *
 * @internal
 */
export async function loadBodyWith(options: LoadBodyOptions, glue?: Glue): Promise<Body> {
  checkObject('loadBody() needs options, such as { body: "/models/mine/body.glb" }: they', options);
  const { body, signal, wasm } = options;
  checkSignal(signal);
  checkCallback("onProgress", options.onProgress);
  const progress = new ProgressSum(options.onProgress);
  const starting = startCore(wasm, progress.part(), glue);
  // A failure is reported below, at the await that meets it.
  starting.catch(() => {});
  const what = "the body";
  const reading = { what, signal, maxBytes: MAX_FILE_BYTES, onProgress: progress.part() };
  const bytes = await readBytes(body, reading);
  if (isWebPage(bytes)) throw webPage(what, body);
  const core = await starting;
  const { CoreBody } = core.glue;
  const [raw, sha256] = core.guard(
    () => [CoreBody.fromFile(bytes), CoreBody.hashOf(bytes)] as const,
  );
  return new Body(core, raw, sha256, bytes);
}

function makeBody(core: Core, bundle: Bundle, bundleBytes: Uint8Array, glb: Uint8Array): Body {
  return new Body(
    core,
    core.guard(() => new core.glue.CoreBody(bundleBytes, glb)),
    bundle.body.sha256,
    glb,
  );
}

/** Networks move the vertices of one body; with another they would tear it. */
function checkBody(body: Body, bundle: Bundle): void {
  if (body.sha256 === bundle.body.sha256) return;
  throw new DynaSkinError(
    "bundle",
    `The networks of "${bundle.name}" are for another body than the one given: bundle.json expects ` +
      `SHA-256 ${bundle.body.sha256}, the body's is ${body.sha256}.`,
  );
}

/** A page may have the whole core and the slim one: what one of them made is nothing to the other. */
function checkCore(body: Body, core: Core): void {
  if (body.core.glue === core.glue) return;
  throw new DynaSkinError(
    "argument",
    "The body given is of another core: one of dynaskin and dynaskin/slim loaded it, the other loads these networks. " +
      "Load both through the same entry.",
  );
}

type FileKey = "body" | "predictor" | "decoder";

interface Sources {
  bundle: FileSource;
  file: (bundle: Bundle, key: FileKey) => FileSource;
}

function toSources(model: LoadOptions["model"], form: NetworkForm): Sources {
  if (typeof model !== "string" && !(model instanceof URL)) {
    if (typeof model !== "object" || model === null) {
      throw new DynaSkinError(
        "argument",
        `model must be an address or the model's files, got ${model === null ? "null" : typeof model}.`,
      );
    }
    checkFiles(model);
    return { bundle: model.bundle, file: (_bundle, key) => model[key] };
  }
  const address = String(model);
  const folder = toUrl(address.endsWith("/") ? address : `${address}/`);
  return {
    bundle: new URL("bundle.json", folder),
    file: (bundle, key) => new URL(encodeURIComponent(fileOf(bundle, key, form).file), folder),
  };
}

/** The files of a model. */
const FILE_KEYS = ["bundle", "body", "predictor", "decoder"] as const;

function checkFiles(model: ModelFiles): void {
  const missing = FILE_KEYS.find((key) => model[key] === undefined || model[key] === null);
  if (missing === undefined) return;
  throw new DynaSkinError(
    "argument",
    `model lacks the file ${missing}; it needs bundle, body, predictor and decoder.`,
  );
}

/**
 * The files with `change` made to each.
 *
 * @throws DynaSkinError `argument` where one is missing
 * @internal
 */
export function mapFiles(
  model: ModelFiles,
  change: (source: FileSource, key: keyof ModelFiles) => FileSource,
): ModelFiles {
  checkFiles(model);
  const changed = FILE_KEYS.map((key) => [key, change(model[key], key)] as const);
  return Object.fromEntries(changed) as Record<keyof ModelFiles, FileSource>;
}

/** @throws DynaSkinError `bundle` where the bundle has no networks in this form. */
function fileOf(bundle: Bundle, key: FileKey, form: NetworkForm): BundleFile {
  if (form === "onnx" || key === "body") return bundle[key];
  if (bundle.lowered) return bundle.lowered[key];
  throw new DynaSkinError(
    "bundle",
    `The bundle "${bundle.name}" names no lowered networks, which dynaskin/slim needs: write them ` +
      'with `dynaskin slim FOLDER`, or load it with "dynaskin".',
  );
}

function toUrl(address: string): URL {
  const page = (globalThis as { document?: { baseURI: string } }).document?.baseURI;
  try {
    return new URL(address, page);
  } catch (cause) {
    throw new DynaSkinError(
      "argument",
      page === undefined
        ? `model is "${address}": outside a page it must be a full address, such as ` +
            'new URL("./models/female/", import.meta.url) or pathToFileURL(folder).'
        : `model is "${address}", which is no address.`,
      { cause },
    );
  }
}

/**
 * Servers of single-page applications answer every unknown address with their start page. Said before
 * hashes are compared: that a page has another hash than a network helps nobody.
 */
function webPage(what: string, source: FileSource): DynaSkinError {
  const address = addressOf(source);
  return new DynaSkinError(
    "bundle",
    `There is a web page where ${what} should be${address ? `: ${address}` : ""}. ` +
      "Give the address of the folder that holds bundle.json and the files it names, and check that " +
      "the server has them.",
  );
}

/** Only as much as is needed to find the files; the core checks the rest. */
function parseBundle(bytes: Uint8Array, address: string | null): Bundle {
  const text = new TextDecoder().decode(bytes);
  try {
    const bundle = JSON.parse(text) as Bundle;
    for (const key of ["body", "predictor", "decoder"] as const) checkFileName(key, bundle?.[key]);
    if (bundle.lowered !== undefined) {
      for (const key of ["predictor", "decoder"] as const) {
        checkFileName(`lowered.${key}`, bundle.lowered?.[key]);
      }
    }
    return bundle;
  } catch (cause) {
    const reason = cause instanceof Error ? cause.message : String(cause);
    const where = address ? ` (${address})` : "";
    throw new DynaSkinError("bundle", `bundle.json cannot be read${where}: ${reason}.`, { cause });
  }
}

function checkFileName(key: string, named: BundleFile | undefined): void {
  const file: unknown = named?.file;
  if (typeof file !== "string") throw new Error(`${key}.file is missing`);
  if (isPlainName(file)) return;
  throw new Error(`${key}.file is ${JSON.stringify(file)}, expected a file name without folders`);
}

/**
 * Whether a name means a file beside bundle.json. The core asks the same, but only after the request:
 * a bundle could name another host, or a file of the machine that runs Node.
 */
function isPlainName(name: string): boolean {
  // biome-ignore lint/suspicious/noControlCharactersInRegex: they have no place in a file name.
  return name !== "" && !name.startsWith(".") && !/[/\\:\u0000-\u001f]/.test(name);
}
