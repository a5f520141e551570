/**
 * dynaskin's own renderer: skins on the graphics card and draws avatars in a studio, with WebGPU or
 * WebGL2. A file of its own, so that pages with another engine never download it.
 *
 * @module
 */
import { DynaSkinError, guard, toDynaSkinError } from "./error.js";
import type { Body } from "./model.js";
import { type Progress, ProgressSum } from "./source.js";
import { compile, type WasmSource } from "./wasm/instantiate.js";
import * as glue from "./wasm/renderer.js";

/** A graphics interface of the browser. */
export type Backend = "webgpu" | "webgl2";

/** How the renderer begins. */
export interface RendererOptions {
  /** The interface to use; `auto` takes WebGPU where there is an adapter, else WebGL2. */
  backend?: Backend | "auto";
  /** The WebAssembly file, where the bundler cannot find it beside this module. */
  wasm?: WasmSource;
  /** Called as the WebAssembly file arrives. */
  onProgress?: (progress: Progress) => void;
}

/** A perspective camera. */
export interface Camera {
  /** Where it is, in the world, metres. */
  eyeWorldM: readonly [number, number, number];
  /** What it looks at, in the world, metres. */
  targetWorldM: readonly [number, number, number];
  /** Vertical field of view in radians, 0.05 to 2.8. */
  fovYRadians: number;
}

/** Colours of the backdrop: red, green, blue in sRGB, 0 to 1. */
export interface Background {
  /** Behind the subject. */
  center: readonly [number, number, number];
  /** At the picture's edges. */
  edge: readonly [number, number, number];
}

/** What a body is drawn from. An avatar of `dynaskin` is one; so is what you put together yourself. */
export interface Surface {
  /** Rest-pose positions: `[vertex][x, y, z]` flattened, metres. */
  readonly positions: Float32Array;
  /** Unit normals of the positions, in the same order. */
  readonly normals: Float32Array;
  /** What the heat map shows the length of, in the same order, metres: the offsets, or an error. */
  readonly offsets: Float32Array;
  /** Per joint the matrix from rest-pose to world coordinates: `[joint][16]`, column-major. */
  readonly skinMatrices: Float32Array;
}

let starting: Promise<void> | null = null;

function startGlue(options: RendererOptions): Promise<void> {
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

/**
 * Starts drawing to a canvas, which then belongs to the renderer.
 *
 * @throws DynaSkinError `fetch`, `wasm`, or what the graphics interface refuses (`no-adapter` where
 *   the browser has none)
 */
export async function createRenderer(
  canvas: HTMLCanvasElement,
  options: RendererOptions = {},
): Promise<Renderer> {
  await startGlue(options);
  try {
    return new Renderer(await glue.Renderer.create(canvas, options.backend ?? "auto"));
  } catch (error) {
    throw toDynaSkinError(error);
  }
}

/**
 * The heat map's colours from no offset to the end of the scale, evenly spaced: red, green, blue in
 * sRGB, 0 to 1. A renderer must have been made before.
 */
export function heatRamp(): [number, number, number][] {
  const flat = guard(() => glue.heat_ramp());
  return Array.from({ length: flat.length / 3 }, (_, idx) => [
    flat[idx * 3] ?? 0,
    flat[idx * 3 + 1] ?? 0,
    flat[idx * 3 + 2] ?? 0,
  ]);
}

/** Draws avatars to one canvas. */
export class Renderer {
  /** The graphics interface in use. */
  readonly backend: Backend;
  /** The graphics card as the browser names it. */
  readonly adapter: string;
  /**
   * Resolves when the graphics card is lost: with the reason (make a new renderer then), or with
   * null after {@link dispose}.
   */
  readonly lost: Promise<string | null>;
  #raw: glue.Renderer | null;

  /** @internal */
  constructor(raw: glue.Renderer) {
    this.#raw = raw;
    this.backend = raw.backend as Backend;
    this.adapter = raw.adapter;
    this.lost = raw.lost() as Promise<string | null>;
  }

  /** @internal */
  get raw(): glue.Renderer {
    if (this.#raw) return this.#raw;
    throw new DynaSkinError("disposed", "This renderer was used after dispose().");
  }

  /** Adds a body; it appears with the first {@link BodyHandle.update}. */
  addBody(body: Body): BodyHandle {
    const { faces, skinJoints, skinWeights, colors } = body;
    const id = guard(() => this.raw.add_body(faces, skinJoints, skinWeights, colors));
    return new BodyHandle(this, id);
  }

  /** Moves the camera. */
  setCamera({ eyeWorldM, targetWorldM, fovYRadians }: Camera): void {
    guard(() =>
      this.raw.set_camera(
        Float32Array.from(eyeWorldM),
        Float32Array.from(targetWorldM),
        fovYRadians,
      ),
    );
  }

  /** Paints the backdrop. */
  setBackground({ center, edge }: Background): void {
    guard(() => this.raw.set_background(Float32Array.from(center), Float32Array.from(edge)));
  }

  /** Colours bodies by the size of their offsets, 0 to `rangeMm` millimetres; null: as painted. */
  setHeatMap(rangeMm: number | null): void {
    guard(() => this.raw.set_heat_map(rangeMm ?? undefined));
  }

  /** Sets the size of canvas and picture: CSS pixels times `pixelRatio`. */
  resize(widthPx: number, heightPx: number, pixelRatio = 1): void {
    guard(() => this.raw.resize(widthPx, heightPx, pixelRatio));
  }

  /**
   * Draws one picture. Returns whether it was drawn: a hidden page draws none, which is no error.
   *
   * @throws DynaSkinError when the graphics card was lost
   */
  render(): boolean {
    return guard(() => this.raw.render());
  }

  /** Frees everything on the graphics card. May be called again. */
  dispose(): void {
    const raw = this.#raw;
    this.#raw = null;
    raw?.free();
  }
}

/** One body of a renderer. */
export class BodyHandle {
  readonly #renderer: Renderer;
  readonly #id: number;

  /** @internal */
  constructor(renderer: Renderer, id: number) {
    this.#renderer = renderer;
    this.#id = id;
  }

  /** Takes over an avatar's present surface and pose, or another of the same body. */
  update(surface: Surface): void {
    const { raw } = this.#renderer;
    guard(() => {
      raw.set_surface(this.#id, surface.positions, surface.normals, surface.offsets);
      raw.set_skin_matrices(this.#id, surface.skinMatrices);
    });
  }

  /** Shows or hides it. */
  setVisible(visible: boolean): void {
    guard(() => this.#renderer.raw.set_body_visible(this.#id, visible));
  }

  /**
   * Reads back the positions that the graphics card skinned: `[vertex][x, y, z]` flattened, metres,
   * in the world. Only with WebGPU.
   */
  async readSkinnedPositions(): Promise<Float32Array> {
    try {
      return await this.#renderer.raw.read_skinned_positions(this.#id);
    } catch (error) {
      throw toDynaSkinError(error);
    }
  }

  /** Takes it off the picture and frees its buffers. */
  remove(): void {
    guard(() => this.#renderer.raw.remove_body(this.#id));
  }
}
