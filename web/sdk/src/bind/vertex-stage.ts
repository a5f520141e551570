// What every engine's vertex stage needs to play a binding by itself: two textures and the GLSL that reads them.
import { type Core, CoreArray } from "../core.js";
import { DynaSkinError } from "../error.js";
import type { CoreTissue } from "../wasm/core.js";

/** How the tissue reaches the meshes; see `TissueOptions.write`. */
export type TissueWrite = "attributes" | "texture";

/** Refuses what is no way of writing. */
export function checkWrite(write: unknown): TissueWrite {
  if (write === undefined || write === "attributes" || write === "texture") {
    return write ?? "attributes";
  }
  throw new DynaSkinError(
    "argument",
    `write must be "attributes" or "texture", got ${JSON.stringify(write)}.`,
  );
}

/** Numbers of a texel. */
const TEXEL = 4;
/** Texels of a vertex: four of entries, two of turns. */
const VERTEX_TEXELS = 6;
/** Vertices in a line of the texture, so that it is as wide as every graphics card takes it. */
const LINE_VERTICES = 170;
/** Places of vertices that the header takes. */
const HEADER_VERTICES = 2;

/**
 * A texture of four floats a texel, all of which `data` fills.
 *
 * @internal
 */
export interface FloatTexels {
  readonly data: Float32Array;
  readonly width: number;
  readonly height: number;
}

/**
 * What a surface that moves takes from the body.
 *
 * @internal
 */
export interface SurfaceRows {
  /** Its place in the rig's list of surfaces. */
  readonly idx: number;
  readonly rows: FloatTexels;
}

/**
 * What the body's vertices have changed by, in the core's memory: two texels each.
 *
 * @internal
 */
export class BodyChanges {
  readonly width: number;
  readonly height: number;
  readonly #numbers: CoreArray;

  constructor(core: Core, raw: CoreTissue) {
    const [width = 0, height = 0] = core.guard(() => raw.changesSize());
    this.width = width;
    this.height = height;
    this.#numbers = new CoreArray(core, () => raw.changesPtr(), TEXEL * width * height);
  }

  /** The numbers as they are now. */
  get data(): Float32Array {
    return this.#numbers.view;
  }
}

/**
 * What the vertices of a surface take, behind a header: the first vertex that moves and how many follow, then two
 * matrices by columns.
 *
 * @internal
 */
export function rowsOf(core: Core, raw: CoreTissue, idx: number): FloatTexels {
  const [vertices, matrices, moving] = core.guard(() => [
    raw.vertexRows(idx),
    raw.meshFromRow(idx),
    raw.moving(idx),
  ]);
  const [first = 0, end = 0] = moving;
  const height = Math.ceil((HEADER_VERTICES + end - first) / LINE_VERTICES);
  const width = VERTEX_TEXELS * LINE_VERTICES;
  const data = new Float32Array(TEXEL * width * height);
  data.set([first, end - first]);
  for (let column = 0; 3 * column < matrices.length; column += 1) {
    data.set(matrices.subarray(3 * column, 3 * column + 3), TEXEL * (1 + column));
  }
  data.set(vertices, TEXEL * VERTEX_TEXELS * HEADER_VERTICES);
  return { data, width, height };
}

/**
 * GLSL before `main`. `dynaskinRead()` sets `dynaskinOffset`, which is added to a position before skinning, and
 * `dynaskinNormal`, which is added to a unit normal that is then made a unit one again. `dynaskinReadFrom()` adds the same
 * of other changes to zeros.
 *
 * @internal
 */
export const VERTEX_STAGE = `
uniform highp sampler2D dynaskinChanges;
uniform highp sampler2D dynaskinRows;
vec3 dynaskinOffset = vec3(0.0);
vec3 dynaskinNormal = vec3(0.0);
vec3 dynaskinTurn(vec4 turn, vec3 v) {
  return v + 2.0 * cross(turn.xyz, cross(turn.xyz, v) + turn.w * v);
}
vec3 dynaskinHeader(int texel) {
  return texelFetch(dynaskinRows, ivec2(texel, 0), 0).xyz;
}
void dynaskinAdd(highp sampler2D changes, vec2 entry, inout vec3 offset, inout vec3 normal) {
  if (entry.y <= 0.0) return;
  int texel = 2 * int(entry.x + 0.5);
  int width = textureSize(changes, 0).x;
  ivec2 at = ivec2(texel % width, texel / width);
  offset += entry.y * texelFetch(changes, at, 0).xyz;
  normal += entry.y * texelFetch(changes, at + ivec2(1, 0), 0).xyz;
}
void dynaskinReadFrom(highp sampler2D changes, inout vec3 offset, inout vec3 normal) {
  vec2 range = dynaskinHeader(0).xy;
  int vertex = gl_VertexID - int(range.x + 0.5);
  if (vertex < 0 || vertex >= int(range.y + 0.5)) return;
  vertex += ${HEADER_VERTICES};
  ivec2 at = ivec2(${VERTEX_TEXELS} * (vertex % ${LINE_VERTICES}), vertex / ${LINE_VERTICES});
  for (int idx = 0; idx < 4; idx += 1) {
    vec4 two = texelFetch(dynaskinRows, at + ivec2(idx, 0), 0);
    dynaskinAdd(changes, two.xy, offset, normal);
    dynaskinAdd(changes, two.zw, offset, normal);
  }
  vec4 turn = texelFetch(dynaskinRows, at + ivec2(4, 0), 0);
  vec4 own = texelFetch(dynaskinRows, at + ivec2(5, 0), 0);
  mat3 offsets = mat3(dynaskinHeader(1), dynaskinHeader(2), dynaskinHeader(3));
  mat3 normals = mat3(dynaskinHeader(4), dynaskinHeader(5), dynaskinHeader(6));
  offset = dynaskinTurn(own, offsets * dynaskinTurn(turn, offset));
  normal = dynaskinTurn(own, normals * dynaskinTurn(turn, normal));
}
void dynaskinRead() {
  dynaskinReadFrom(dynaskinChanges, dynaskinOffset, dynaskinNormal);
}
vec3 dynaskinUnit(vec3 changed, vec3 still) {
  float size = dot(changed, changed);
  return size > 0.0 ? changed * inversesqrt(size) : still;
}
`;
