/**
 * dynaskin's own renderer: skins on the graphics card and draws avatars in a studio, with WebGPU or
 * WebGL2. Its WebAssembly is a separate file, so pages with another engine never download it.
 *
 * @module
 */

import type { DecoderMatrix, Undecoded } from "./decoding.js";
import { DynaSkinError } from "./error.js";
import { Instance } from "./instance.js";
import type { Body } from "./model.js";
import { AdaptiveResolution } from "./renderer/resolution.js";
import { isDualQuaternion, type Skinning } from "./skinning.js";
import { type Progress, ProgressSum } from "./source.js";
import { compile, type WasmSource } from "./wasm/instantiate.js";
import * as glue from "./wasm/renderer.js";

/** A graphics API of the browser. */
export type Backend = "webgpu" | "webgl2";

/** Options of {@link createRenderer}. */
export interface RendererOptions {
  /** The API to use; `auto`, the default, takes WebGPU if there is an adapter, else WebGL2. */
  backend?: Backend | "auto";
  /** The WebAssembly file, if the bundler cannot find it beside this module. */
  wasm?: WasmSource;
  /** Called as the WebAssembly file arrives. */
  onProgress?: (progress: Progress) => void;
  /**
   * Lowers the resolution (down to half the width and height) while frames come slower than 48 a second,
   * and raises it again afterwards; begins low if the browser renders without a graphics card. Off by
   * default. For pages that draw in every animation frame.
   */
  adaptiveResolution?: boolean;
}

/** A perspective camera. */
export interface Camera {
  /** Its position in the world, metres. */
  eyeWorldM: readonly [number, number, number];
  /** The point it looks at, in the world, metres. */
  targetWorldM: readonly [number, number, number];
  /** Vertical field of view in radians, 0.05 to 2.8. */
  fovYRadians: number;
}

/** Colours of the background: red, green, blue in sRGB, 0 to 1. */
export interface Background {
  /** Behind the subject. */
  center: readonly [number, number, number];
  /** At the picture's edges. */
  edge: readonly [number, number, number];
}

/** The arrays that a body is drawn from. Avatars of `dynaskin` have them; you can also build them yourself. */
export interface Surface {
  /** Rest-pose positions: `[vertex][x, y, z]` flattened, metres. */
  readonly positions: Float32Array;
  /** Unit normals of the positions, in the same order. */
  readonly normals: Float32Array;
  /**
   * The values of the heat map, in the same order, metres: one vector (whose length counts) or one
   * length per vertex, such as the offsets or an error.
   */
  readonly offsets: Float32Array;
  /** Per joint the matrix from rest-pose to world coordinates: `[joint][16]`, column-major. */
  readonly skinMatrices: Float32Array;
  /**
   * How the graphics card blends the matrices; `linear` if left out. For `dual-quaternion` each matrix must be
   * a rotation and a translation after a uniform scale, as an avatar's are.
   */
  readonly skinning?: Skinning;
}

/** An avatar that leaves decoding to whoever draws it. */
interface MaybeUndecoded extends Surface {
  readonly undecoded?: Undecoded | null;
}

let starting: Promise<void> | null = null;

/** The running file; after a crash the next renderer starts another. */
let instance = new Instance();

function startGlue(options: RendererOptions): Promise<void> {
  if (instance.crash) {
    glue.__wbg_reset_state();
    instance = new Instance();
  }
  starting ??= start(options).catch((error) => {
    starting = null;
    throw error;
  });
  return starting;
}

async function start({ wasm, onProgress }: RendererOptions): Promise<void> {
  const module = await compile(wasm ?? new URL("./wasm/renderer_bg.wasm", import.meta.url), {
    what: "the dynaskin renderer",
    onProgress: new ProgressSum(onProgress).part(),
  });
  await glue.default({ module_or_path: module });
}

/** What browsers call graphics without a graphics card. */
const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i;

/**
 * Starts drawing to a canvas, which then belongs to the renderer.
 *
 * @throws DynaSkinError `fetch`, `wasm`, `gpu` for an error of the driver, or `no-adapter` if the browser
 *   has no usable graphics API
 */
export async function createRenderer(
  canvas: HTMLCanvasElement,
  options: RendererOptions = {},
): Promise<Renderer> {
  await startGlue(options);
  const raw = await createRaw(canvas, options.backend ?? "auto");
  const isSoftware = SOFTWARE.test(raw.adapter);
  const resolution = options.adaptiveResolution
    ? new AdaptiveResolution(undefined, undefined, isSoftware)
    : null;
  return new Renderer(canvas, raw, resolution);
}

async function createRaw(
  canvas: HTMLCanvasElement,
  backend: Backend | "auto",
): Promise<glue.Renderer> {
  return instance.guardLater(() => glue.Renderer.create(canvas, backend));
}

/** How long a browser may take to give a WebGL2 context back. */
const RESTORE_LIMIT_MS = 10_000;

/** Settles when the browser has given the canvas its WebGL2 context back, if it took it. */
function contextRestored(canvas: HTMLCanvasElement): Promise<void> {
  if (!canvas.getContext("webgl2")?.isContextLost()) return Promise.resolve();
  return new Promise((resolve, reject) => {
    const done = new AbortController();
    const late = () => {
      done.abort();
      const message = "The browser took the WebGL2 context away and has not given it back.";
      reject(new DynaSkinError("lost", message));
    };
    const timer = setTimeout(late, RESTORE_LIMIT_MS);
    const restored = () => {
      clearTimeout(timer);
      done.abort();
      resolve();
    };
    canvas.addEventListener("webglcontextrestored", restored, { signal: done.signal });
  });
}

/**
 * The heat map's colours from zero to the end of the scale, evenly spaced: red, green, blue in
 * sRGB, 0 to 1. Create a renderer first.
 */
export function heatRamp(): [number, number, number][] {
  const flat = instance.guard(() => glue.heat_ramp());
  return Array.from({ length: flat.length / 3 }, (_, idx) => [
    flat[idx * 3] ?? 0,
    flat[idx * 3 + 1] ?? 0,
    flat[idx * 3 + 2] ?? 0,
  ]);
}

/** A displacement of a body from the position in its pose. */
export interface Placement {
  /** Translation in the world, metres; zero by default. */
  readonly positionM?: readonly [number, number, number];
  /** Rotation about the vertical axis through the world's origin, before the translation, radians; 0 by default. */
  readonly turnRadians?: number;
}

/** How a body is shown. */
export interface Look {
  /** Matt plaster instead of skin and cloth as painted; false by default. */
  readonly sculpture?: boolean;
  /**
   * Whether painted clothes span hollows of the skin instead of following them; false by default. The
   * drawn surface then differs from the avatar's by up to a few millimetres under the clothes.
   */
  readonly draped?: boolean;
}

/** Column-major matrix of a placement: a turn about +Y, then a shift. */
function placementMatrix({ positionM = [0, 0, 0], turnRadians = 0 }: Placement): Float32Array {
  const [x, y, z] = positionM;
  const cos = Math.cos(turnRadians);
  const sin = Math.sin(turnRadians);
  return Float32Array.of(cos, 0, -sin, 0, 0, 1, 0, 0, sin, 0, cos, 0, x, y, z, 1);
}

/** Draws avatars to one canvas. */
export class Renderer {
  /** The graphics API in use. */
  readonly backend: Backend;
  /** The graphics card as the browser names it; may be empty. */
  readonly adapter: string;
  readonly #canvas: HTMLCanvasElement;
  readonly #resolution: AdaptiveResolution | null;
  /** Whether the last picture was one that stands. */
  #hasAllPixels = false;
  /** @internal The WebAssembly that draws. */
  readonly wasm = instance;
  /** Null while nothing can be drawn: after a loss or {@link dispose}. */
  #raw: glue.Renderer | null = null;
  #lost: Promise<string | null> = Promise.resolve(null);
  /** Ends the listeners of the present device. */
  #watch = new AbortController();
  #recovering: Promise<void> | null = null;
  #isDisposed = false;
  readonly #bodies = new Set<BodyHandle>();
  /** Decoders of the present device; null for what it cannot decode. */
  #decoders = new Map<DecoderMatrix, number | null>();
  // What a renderer that comes back has to be told again.
  #camera: Camera | null = null;
  #background: Background | null = null;
  #heatRangeMm: number | null = null;
  #size: readonly [widthPx: number, heightPx: number, pixelRatio: number] | null = null;

  /** @internal */
  constructor(
    canvas: HTMLCanvasElement,
    raw: glue.Renderer,
    resolution: AdaptiveResolution | null,
  ) {
    this.#canvas = canvas;
    this.#resolution = resolution;
    this.backend = raw.backend as Backend;
    this.adapter = raw.adapter;
    this.#begin(raw);
  }

  /** @internal The renderer in WebAssembly; null while the graphics card is lost. */
  get raw(): glue.Renderer | null {
    if (this.#isDisposed) {
      throw new DynaSkinError("disposed", "This renderer was used after dispose().");
    }
    return this.#raw;
  }

  /** @internal */
  get isDisposed(): boolean {
    return this.#isDisposed;
  }

  /**
   * Resolves when the graphics device is lost: with the reason (then call {@link recover}), or with
   * null after {@link dispose}. After a recovery it is a new promise.
   */
  get lost(): Promise<string | null> {
    return this.#lost;
  }

  /**
   * Whether the graphics device is lost and not yet recovered. Calls are recorded meanwhile, and nothing
   * is drawn.
   */
  get isLost(): boolean {
    return this.raw === null;
  }

  #begin(raw: glue.Renderer): void {
    this.#decoders = new Map();
    const watch = new AbortController();
    const context = new Promise<string>((resolve) => {
      const taken = (event: Event) => {
        // Only then does the browser give it back.
        event.preventDefault();
        resolve("the browser took the WebGL2 context away");
      };
      this.#canvas.addEventListener("webglcontextlost", taken, { signal: watch.signal });
    });
    const device = raw.lost() as Promise<string | null>;
    this.#raw = raw;
    this.#watch = watch;
    this.#lost = Promise.race([device, context]).then((reason) => {
      if (this.#isDisposed || reason === null) return null;
      // Now, because what it made is none of the context's that comes back.
      this.#end();
      return reason;
    });
  }

  /** Lets go of everything on the graphics card. */
  #end(): void {
    const raw = this.#raw;
    this.#raw = null;
    this.#watch.abort();
    this.wasm.free(raw);
  }

  /**
   * Draws again on the same canvas after the graphics device was lost. Bodies, camera, background, heat map
   * and size are as before; with WebGL2 it waits until the browser restores the context.
   *
   * @throws DynaSkinError `lost` if the context is not restored within ten seconds,
   *   otherwise as {@link createRenderer}; you may call it again
   */
  recover(): Promise<void> {
    this.#recovering ??= this.#recover().finally(() => {
      this.#recovering = null;
    });
    return this.#recovering;
  }

  async #recover(): Promise<void> {
    if (!this.isLost) return;
    if (this.backend === "webgl2") await contextRestored(this.#canvas);
    this.wasm.assertSound();
    const raw = await createRaw(this.#canvas, this.backend);
    if (this.#isDisposed) {
      this.wasm.free(raw);
      return;
    }
    this.#begin(raw);
    if (this.#size) this.resize(...this.#size);
    if (this.#camera) this.setCamera(this.#camera);
    if (this.#background) this.setBackground(this.#background);
    this.setHeatMap(this.#heatRangeMm);
    for (const body of this.#bodies) body.restore();
  }

  /** Adds a body; it appears with the first {@link BodyHandle.update}. */
  addBody(body: Body): BodyHandle {
    const handle = new BodyHandle(this, body, (gone) => this.#bodies.delete(gone));
    this.#bodies.add(handle);
    return handle;
  }

  /** @internal The number of a decoder on the present device; null where it cannot decode. */
  decoderOf(raw: glue.Renderer, body: Body, matrix: DecoderMatrix): number | null {
    let id = this.#decoders.get(matrix);
    if (id === undefined) {
      const { softVertices, starts, latents, weightsM, latentCount } = matrix;
      const { vertexCount, faces } = body;
      id =
        this.wasm.guard(() =>
          raw.add_decoder(
            ...([
              vertexCount,
              faces,
              softVertices,
              starts,
              latents,
              weightsM,
              latentCount,
            ] as const),
          ),
        ) ?? null;
      this.#decoders.set(matrix, id);
    }
    return id;
  }

  /** Moves the camera. */
  setCamera(camera: Camera): void {
    const { eyeWorldM, targetWorldM, fovYRadians } = camera;
    const { raw } = this;
    this.wasm.guard(() =>
      raw?.set_camera(Float32Array.from(eyeWorldM), Float32Array.from(targetWorldM), fovYRadians),
    );
    this.#camera = camera;
  }

  /** Sets the colours of the background. */
  setBackground(background: Background): void {
    const { center, edge } = background;
    const { raw } = this;
    this.wasm.guard(() => raw?.set_background(Float32Array.from(center), Float32Array.from(edge)));
    this.#background = background;
  }

  /** Colours bodies by the size of their offsets, 0 to `rangeMm` millimetres; null: as painted. */
  setHeatMap(rangeMm: number | null): void {
    const { raw } = this;
    this.wasm.guard(() => raw?.set_heat_map(rangeMm ?? undefined));
    this.#heatRangeMm = rangeMm;
  }

  /**
   * The present factor on the pixel ratio, 0.5 to 1; always 1 without
   * {@link RendererOptions.adaptiveResolution}, and in a frame with all pixels.
   */
  get resolutionScale(): number {
    return this.#hasAllPixels ? 1 : (this.#resolution?.scale ?? 1);
  }

  /** Sets the size of canvas and picture: CSS pixels times `pixelRatio` (times {@link resolutionScale}). */
  resize(widthPx: number, heightPx: number, pixelRatio = 1): void {
    const { raw } = this;
    this.wasm.guard(() => raw?.resize(widthPx, heightPx, pixelRatio * this.resolutionScale));
    this.#size = [widthPx, heightPx, pixelRatio];
  }

  /**
   * Draws one frame. Returns whether it was drawn: a hidden page and a lost graphics device draw
   * nothing, which is not an error. `allPixels` draws a still frame in full resolution, whatever
   * {@link RendererOptions.adaptiveResolution} has chosen.
   */
  render({ allPixels = false }: { allPixels?: boolean } = {}): boolean {
    const { raw } = this;
    // Before drawing, because a canvas that changes its size is empty.
    const isChanged = !allPixels && (this.#resolution?.frame(performance.now()) ?? false);
    if (raw && this.#size && (isChanged || allPixels !== this.#hasAllPixels)) {
      this.#hasAllPixels = allPixels;
      this.resize(...this.#size);
    }
    try {
      return this.wasm.guard(() => raw?.render() ?? false);
    } catch (error) {
      // The promise `lost` tells it a moment later.
      if ((error as DynaSkinError).code === "lost") return false;
      throw error;
    }
  }

  /** Frees everything on the graphics card. May be called again. */
  dispose(): void {
    this.#isDisposed = true;
    this.#bodies.clear();
    this.#end();
  }
}

/** One body of a renderer. */
export class BodyHandle {
  readonly #renderer: Renderer;
  readonly #body: Body;
  readonly #forget: (gone: BodyHandle) => void;
  /** Its number in the present renderer; null where there is none. */
  #id: number | null = null;
  #surface: Surface | null = null;
  /** What the card decodes, and its revisions; null where the CPU does. */
  #decoded: { of: Surface; constants: string; surface: number } | null = null;
  #placement: Placement = {};
  #look: Look = {};
  #isVisible = true;
  #isRemoved = false;

  /** @internal */
  constructor(renderer: Renderer, body: Body, forget: (gone: BodyHandle) => void) {
    this.#renderer = renderer;
    this.#body = body;
    this.#forget = forget;
    this.restore();
  }

  /** @internal Adds it to a renderer that is new or has come back. */
  restore(): void {
    this.#id = null;
    this.#decoded = null;
    const { raw } = this.#renderer;
    if (!raw) return;
    const { faces, skinJoints, skinWeights, colors } = this.#body;
    this.#id = this.#renderer.wasm.guard(() =>
      raw.add_body(faces, skinJoints, skinWeights, colors),
    );
    this.setPlacement(this.#placement);
    this.setVisible(this.#isVisible);
    this.setLook(this.#look);
    try {
      if (this.#surface) this.update(this.#surface);
    } catch {
      // Its avatar is gone, or its arrays are: it appears with the next update.
      this.#surface = null;
    }
  }

  /** Calls the renderer, unless the graphics card is lost. */
  #call(call: (raw: glue.Renderer, id: number) => void): void {
    this.#checkPresent();
    const { raw } = this.#renderer;
    const id = this.#id;
    if (raw && id !== null) this.#renderer.wasm.guard(() => call(raw, id));
  }

  #checkPresent(): void {
    if (this.#isRemoved) {
      throw new DynaSkinError("disposed", "This body was used after remove().");
    }
  }

  /** Takes over the present surface and pose of an avatar, or another surface of the same body. */
  update(surface: Surface): void {
    const isDual = isDualQuaternion(surface.skinning ?? "linear");
    this.#call((raw, id) => {
      const { undecoded } = surface as MaybeUndecoded;
      if (!undecoded || !this.#decode(raw, id, surface, undecoded)) {
        this.#decoded = null;
        raw.set_surface(id, surface.positions, surface.normals, surface.offsets);
      }
      raw.set_skin_matrices(id, surface.skinMatrices);
      raw.set_skinning(id, isDual);
    });
    this.#surface = surface;
  }

  /** Whether the surface is decoded on the graphics card. */
  get isDecodedOnCard(): boolean {
    return this.#decoded !== null;
  }

  /** Leaves decoding to the card; returns whether it can. */
  #decode(raw: glue.Renderer, id: number, of: Surface, undecoded: Undecoded): boolean {
    const { surfaceRevision, constantsRevision } = undecoded;
    const before = this.#decoded?.of === of ? this.#decoded : null;
    if (before?.surface === surfaceRevision && before.constants === constantsRevision) return true;
    const decoder = this.#renderer.decoderOf(raw, this.#body, undecoded.matrix);
    if (decoder === null || this.#look.draped) return false;
    if (before?.constants !== constantsRevision) {
      const { stillPositions, vertexControls } = undecoded.constants();
      raw.decode_body(id, decoder, stillPositions, vertexControls);
    }
    if (!raw.set_latents(id, undecoded.latents())) return false;
    this.#decoded = { of, constants: constantsRevision, surface: surfaceRevision };
    return true;
  }

  /** Displaces it from the position in its pose, for example to stand beside another with the same motion. */
  setPlacement(placement: Placement): void {
    this.#call((raw, id) => raw.set_body_placement(id, placementMatrix(placement)));
    this.#placement = placement;
  }

  /** Shows it in another look: its colours at once, its surface with the next {@link update}. */
  setLook(look: Look): void {
    const { sculpture = false, draped = false } = look;
    this.#call((raw, id) => raw.set_look(id, sculpture, draped));
    this.#look = look;
    // The next surface is made anew, on the card or not.
    this.#decoded = null;
  }

  /** Shows or hides it. */
  setVisible(visible: boolean): void {
    this.#call((raw, id) => raw.set_body_visible(id, visible));
    this.#isVisible = visible;
  }

  /**
   * Reads back the positions that the graphics card skinned: `[vertex][x, y, z]` flattened, metres,
   * in the world. Only with WebGPU.
   *
   * @throws DynaSkinError `lost` while the graphics card is lost
   */
  async readSkinnedPositions(): Promise<Float32Array> {
    this.#checkPresent();
    const { raw } = this.#renderer;
    if (!raw || this.#id === null) {
      throw new DynaSkinError("lost", "The graphics card is lost; call recover() first.");
    }
    const id = this.#id;
    return this.#renderer.wasm.guardLater(() => raw.read_skinned_positions(id));
  }

  /**
   * Reads back the surface that the graphics card has decoded, in the rest pose; for avatars with the
   * {@link Avatar.decoding} `card`.
   *
   * @throws DynaSkinError `no-read-back` where the CPU decoded it, `lost` while the graphics card is lost
   */
  async readDecoded(): Promise<Pick<Surface, "positions" | "normals">> {
    this.#checkPresent();
    const { raw } = this.#renderer;
    if (!raw || this.#id === null) {
      throw new DynaSkinError("lost", "The graphics card is lost; call recover() first.");
    }
    const id = this.#id;
    const both: Float32Array = await this.#renderer.wasm.guardLater(() => raw.read_decoded(id));
    const half = both.length / 2;
    return { positions: both.subarray(0, half), normals: both.subarray(half) };
  }

  /** Removes it from the scene and frees its buffers. May be called again, and after `dispose()` of the renderer. */
  remove(): void {
    if (this.#isRemoved) return;
    if (!this.#renderer.isDisposed) this.#call((raw, id) => raw.remove_body(id));
    this.#isRemoved = true;
    this.#forget(this);
  }
}
