import { DynaSkinError } from "./error.js";
import type { CoreAvatar } from "./wasm/core.js";

/**
 * Who turns what the network predicts into offsets.
 *
 * - `cpu`: every step that changes the surface.
 * - `card`: the graphics card, if `dynaskin/renderer` or an engine's `DynaSkin` shows the avatar; the arrays of the
 *   surface are made when you read them. Steps decode as usual where the card cannot: on bodies with pose
 *   correctives, with decoders of other methods, with `maxStrain`, and with a stiffness or damping beyond what the
 *   networks have learned.
 */
export type Decoding = "cpu" | "card";

/**
 * Whether it is the card.
 *
 * @internal
 */
export function isCard(decoding: Decoding): boolean {
  if (decoding === "card" || decoding === "cpu") return decoding === "card";
  throw new DynaSkinError(
    "argument",
    `There is no decoding ${String(decoding)}; there are cpu, card.`,
  );
}

/**
 * A decoder that is a product with a matrix. Copies, the same object for all avatars of a model.
 *
 * @internal
 */
export interface DecoderMatrix {
  readonly softVertices: Uint32Array;
  readonly starts: Uint32Array;
  readonly latents: Uint32Array;
  readonly weightsM: Float32Array;
  readonly latentCount: number;
}

/**
 * The matrix of an avatar's decoder; null where it has none.
 *
 * @internal
 */
export function matrixOf(raw: CoreAvatar): DecoderMatrix | null {
  const latentCount = raw.latentCount();
  if (latentCount === 0) return null;
  return {
    softVertices: raw.softVertices(),
    starts: raw.decoderStarts(),
    latents: raw.decoderLatents(),
    weightsM: raw.decoderWeights(),
    latentCount,
  };
}

/**
 * What a renderer decodes an avatar from.
 *
 * @internal
 */
export interface Undecoded {
  readonly matrix: DecoderMatrix;
  /** A view into WebAssembly memory: for at once. */
  latents(): Float32Array;
  /** Changes with the surface. */
  readonly surfaceRevision: number;
  /** Changes with what {@link constants} gives. */
  readonly constantsRevision: string;
  /** Positions without offsets, and gains and limits of the soft vertices. Copies. */
  constants(): { stillPositions: Float32Array; vertexControls: Float32Array };
  /** The same as {@link constants} as it lies in textures. Copies. */
  bodyTexels(): BodyTexels;
  /** The tables of the matrix. Copies. */
  tables(): DecoderTables;
}

/**
 * A decoder as tables, in whole rows of texels, as `shader/decode.wgsl` of the Rust crate `dynaskin-decoding` reads
 * them.
 *
 * @internal
 */
export interface DecoderTables {
  /** Four whole numbers a texel. */
  readonly vertices: Uint32Array;
  /** Four numbers a texel. */
  readonly weights: Float32Array;
  /** Two whole numbers a texel. */
  readonly corners: Uint32Array;
}

/**
 * What a body is decoded from besides its latents, likewise.
 *
 * @internal
 */
export interface BodyTexels {
  /** Four numbers a texel. */
  readonly stillPositions: Float32Array;
  /** Two numbers a texel. */
  readonly controls: Float32Array;
}

/**
 * Reads the tables of an avatar's decoder.
 *
 * @internal
 */
export function tablesOf(raw: CoreAvatar): DecoderTables {
  const tables = raw.decoderTables() as [Uint32Array, Float32Array, Uint32Array];
  const [vertices, weights, corners] = tables;
  return { vertices, weights, corners };
}

/**
 * Reads what a body is decoded from.
 *
 * @internal
 */
export function bodyTexelsOf(raw: CoreAvatar): BodyTexels {
  const [stillPositions, controls] = raw.bodyTexels() as [Float32Array, Float32Array];
  return { stillPositions, controls };
}
