import type { RestBody } from "./adapter/vertex-map.js";
import { Avatar } from "./avatar.js";
import type { Bundle, RegionName } from "./bundle.js";
import { REGION_NAMES } from "./bundle.js";
import { checkObject } from "./check.js";
import type { Core } from "./core.js";
import { Crowd } from "./crowd.js";
import { type DecoderMatrix, type Decoding, isCard, matrixOf } from "./decoding.js";
import { DynaSkinError } from "./error.js";
import { isFigure, type Shape } from "./figure.js";
import { checkLength, SHAPE_LENGTH } from "./pose.js";
import { type PoseSource, poseSourceIndex } from "./pose-source.js";
import { isDualQuaternion, type Skinning } from "./skinning.js";
import type { CoreAvatar, CoreBody, CoreModel } from "./wasm/core.js";

/** How an avatar begins. */
export interface AvatarOptions {
  /**
   * Ten shape coefficients in standard deviations, the first is stature; or measures (`Figure`).
   * Average if left out.
   */
  shape?: Shape;
  /** Where the poses come from; `display` if left out. See {@link PoseSource}. */
  poseSource?: PoseSource;
  /**
   * Whether to add the body's pose correctives (SMPL's pose blend shapes), if it has them; true by default.
   * See {@link Avatar.poseCorrectives}.
   */
  poseCorrectives?: boolean;
  /** How the motions of the joints are blended; `linear` if left out. See {@link Avatar.skinning}. */
  skinning?: Skinning;
  /** Who decodes; `cpu` if left out. See {@link Avatar.decoding}. In a worker it is always `cpu`. */
  decoding?: Decoding;
}

/** The constant data of a body: what an engine needs to draw it. Copies; keep them. */
export class Body {
  /** Number of vertices V. */
  readonly vertexCount: number;
  /** Triangles, counter-clockwise seen from outside: `[face][3]` flattened. */
  readonly faces: Uint32Array;
  /** Joints that move each vertex, `[vertex][4]` flattened. */
  readonly skinJoints: Uint8Array;
  /** Weights of those joints, `[vertex][4]` flattened; they sum to 1. */
  readonly skinWeights: Float32Array;
  /** Colours as red, green, blue, opacity in sRGB, `[vertex][4]` flattened. */
  readonly colors: Uint8Array;
  /** SHA-256 of the body's file in hexadecimal, as bundles name it. */
  readonly sha256: string;
  /**
   * The body's file, a GLB: an avatar is bound to it in a WebAssembly file with a memory of its own.
   *
   * @internal
   */
  readonly file: Uint8Array;
  readonly #core: Core;
  #raw: CoreBody | null;

  /** @internal */
  constructor(core: Core, raw: CoreBody, sha256: string, file: Uint8Array) {
    this.#core = core;
    this.#raw = raw;
    this.sha256 = sha256;
    this.file = file;
    this.vertexCount = raw.vertexCount;
    this.faces = raw.faces();
    this.skinJoints = raw.skinJoints();
    this.skinWeights = raw.skinWeights();
    this.colors = raw.colors();
  }

  /** @internal */
  get core(): Core {
    return this.#core;
  }

  /** @internal */
  get raw(): CoreBody {
    if (this.#raw) {
      this.#core.assertSound();
      return this.#raw;
    }
    throw new DynaSkinError("disposed", "This body was used after dispose().");
  }

  /** How much of each vertex belongs to a region, 0 to 1: `[vertex]`. */
  regionWeights(region: RegionName): Float32Array {
    const idx = REGION_NAMES.indexOf(region);
    if (idx < 0) throw new DynaSkinError("argument", `There is no region ${region}.`);
    return this.#core.guard(() => this.raw.regionWeights(idx));
  }

  /**
   * An avatar without networks: plain skinning, for the time until they are loaded.
   *
   * @throws DynaSkinError `argument` or `shape` for a shape that cannot be used
   */
  createAvatar(options: AvatarOptions = {}): Avatar {
    const shape = toShape(options);
    const raw = this.#core.guard(() => this.raw.createAvatar(shape));
    return asWished(new Avatar(this.#core, raw, this.vertexCount, () => this.atRest()), options);
  }

  /**
   * The body without shape, at rest; null once it is disposed of.
   *
   * @internal
   */
  atRest(): RestBody | null {
    if (!this.#raw) return null;
    const avatar = this.createAvatar();
    const rest = { positions: avatar.positions.slice(), jointsM: avatar.restJointsM() };
    avatar.dispose();
    return rest;
  }

  /** Frees the body's memory; avatars made from it stay valid. May be called again. */
  dispose(): void {
    this.#core.free(this.#raw);
    this.#raw = null;
  }
}

/** A body with the networks that move its skin. One model makes any number of avatars. */
export class Model {
  /** The files of the model, their origin and the measured errors. */
  readonly bundle: Bundle;
  /** The body. */
  readonly body: Body;
  readonly #core: Core;
  readonly #ownsBody: boolean;
  #raw: CoreModel | null;
  /** Made when first needed; null where there is none. */
  #matrix: DecoderMatrix | null | undefined;

  /** @internal */
  constructor(core: Core, raw: CoreModel, body: Body, bundle: Bundle, ownsBody: boolean) {
    this.#ownsBody = ownsBody;
    this.#core = core;
    this.#raw = raw;
    this.body = body;
    this.bundle = bundle;
  }

  /**
   * The crash after which {@link load} started a new WebAssembly core for this model. Objects made before
   * it throw `crashed`; load and make them again. Usually null.
   */
  get restartedAfter(): DynaSkinError | null {
    return this.#core.restartedAfter;
  }

  /** @internal */
  get core(): Core {
    this.#core.assertSound();
    return this.#core;
  }

  /** Name of the model, such as `female`. */
  get name(): string {
    return this.bundle.name;
  }

  /**
   * An avatar that stands in the rest pose with settled tissue.
   *
   * @throws DynaSkinError `argument` or `shape` for a shape that cannot be used
   */
  createAvatar(options: AvatarOptions = {}): Avatar {
    const shape = toShape(options);
    const avatar = this.#core.guard(() => this.#alive.createAvatar(shape));
    const rest = () => this.body.atRest();
    const matrix = (raw: CoreAvatar) => this.#matrixOf(raw);
    return asWished(new Avatar(this.#core, avatar, this.body.vertexCount, rest, matrix), options);
  }

  #matrixOf(raw: CoreAvatar): DecoderMatrix | null {
    if (this.#matrix === undefined) this.#matrix = matrixOf(raw);
    return this.#matrix;
  }

  /** A crowd without avatars, for many avatars of this model; see {@link Crowd}. */
  createCrowd(): Crowd {
    const raw = this.#core.guard(() => new this.#core.glue.CoreCrowd(this.#alive));
    return new Crowd(this.#core, raw);
  }

  get #alive(): CoreModel {
    if (this.#raw) return this.#raw;
    throw new DynaSkinError("disposed", "This model was used after dispose().");
  }

  /**
   * Frees the model's memory, and its body's unless you passed the body to {@link load}; avatars made
   * from it stay valid. May be called again.
   */
  dispose(): void {
    this.#core.free(this.#raw);
    this.#raw = null;
    if (this.#ownsBody) this.body.dispose();
  }
}

function asWished(avatar: Avatar, options: AvatarOptions): Avatar {
  const { poseSource, shape, poseCorrectives, skinning, decoding } = options;
  if (poseSource !== undefined) avatar.poseSource = poseSource;
  if (poseCorrectives !== undefined) avatar.poseCorrectives = poseCorrectives;
  if (skinning !== undefined) avatar.skinning = skinning;
  if (decoding !== undefined) avatar.decoding = decoding;
  if (shape === undefined || !isFigure(shape)) return avatar;
  try {
    avatar.setShape(shape);
    return avatar;
  } catch (error) {
    avatar.dispose();
    throw error;
  }
}

/** The coefficients that an avatar begins with; a shape in words is set on it afterwards. */
function toShape(options: AvatarOptions): Float32Array {
  checkObject("options", options);
  if (options.poseSource !== undefined) poseSourceIndex(options.poseSource);
  if (options.skinning !== undefined) isDualQuaternion(options.skinning);
  if (options.decoding !== undefined) isCard(options.decoding);
  const { shape } = options;
  if (shape === undefined || isFigure(shape)) return new Float32Array(SHAPE_LENGTH);
  checkLength("shape", shape, SHAPE_LENGTH);
  return Float32Array.from(shape);
}
