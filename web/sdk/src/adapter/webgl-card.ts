// Decoding with WebGL2, in the context that an engine draws with: a fragment pass decodes the positions of many
// bodies into a texture, then the vertices of each mesh are captured into the very buffers that the engine draws
// from. So every material, shadow and pass of the engine sees them as if they had been uploaded.
//
// The shaders and the layout of their textures are those of the Rust crate `dynaskin-decoding`.
import type { DecoderMatrix, Undecoded } from "../decoding.js";
import type { CardSeat } from "./card.js";
import { CardDecoder, CardPool, type PoolCard, PoolSeat } from "./card-pools.js";
import {
  MAX_SLOTS,
  MESH_VERTEX,
  POSITIONS_FRAGMENT,
  POSITIONS_VERTEX,
  WIDTH,
} from "./decoding-shaders.js";
import { withOwnState } from "./webgl-state.js";

/** Bytes of a position or normal in a buffer. */
const VERTEX_BYTES = 12;
/** Bytes of the shaders' uniform block. */
const BATCH_BYTES = 4 * (4 + MAX_SLOTS);
/** Numbers of the shaders' textures. */
const [VERTICES, WEIGHTS, CORNERS, STILL, CONTROLS, LATENTS] = [1, 2, 3, 4, 5, 6];
/** Of the texture of decoded positions: another group has its numbers. */
const DECODED = 0;
const UNITS = 7;

const NO_COLOUR = `#version 300 es
void main() {}
`;

/** Buffers that an engine draws a mesh from, three floats a vertex, and which vertex of the body each is. */
export interface MeshBuffers {
  readonly positions: WebGLBuffer;
  readonly normals: WebGLBuffer;
  /** Positions as the frame before has them, where motion vectors are drawn. */
  readonly previous?: WebGLBuffer | undefined;
  readonly vertexOf: Uint32Array;
  /** Whether a frame has drawn the mesh. */
  readonly isShown: boolean;
}

const cards = new WeakMap<WebGL2RenderingContext, WebGlCard | null>();

/**
 * What decodes in a context; null where it cannot, such as where it has no textures of 32-bit floats to draw to, and
 * in one of WebGL 1.
 */
export function webGlCard(gl: WebGL2RenderingContext | WebGLRenderingContext): WebGlCard | null {
  if (!("transformFeedbackVaryings" in gl) || gl.isContextLost()) return null;
  let card = cards.get(gl);
  if (card === undefined || card?.isLost) {
    card = gl.getExtension("EXT_color_buffer_float") ? WebGlCard.make(gl) : null;
    cards.set(gl, card);
  }
  return card;
}

/** Decodes in one context. */
export class WebGlCard implements PoolCard {
  readonly gl: WebGL2RenderingContext;
  readonly positionsPass: Pass;
  readonly meshPass: Pass;
  readonly batch: WebGLBuffer;
  readonly capture: WebGLTransformFeedback;
  readonly quad: WebGLVertexArrayObject;
  /** The first of the texture units that are used: the highest, which engines leave alone. */
  readonly firstUnit: number;
  readonly bindingPoint: number;
  readonly #decoders = new Map<DecoderMatrix, Decoder>();
  readonly #dirty = new Set<Pool>();
  #isLost = false;

  /** Null where the driver refuses a shader. */
  static make(gl: WebGL2RenderingContext): WebGlCard | null {
    const positions = passOf(gl, POSITIONS_VERTEX, POSITIONS_FRAGMENT, []);
    const captured = ["_vs2fs_location0", "_vs2fs_location1"];
    const mesh = passOf(gl, MESH_VERTEX, NO_COLOUR, captured);
    return positions && mesh ? new WebGlCard(gl, positions, mesh) : null;
  }

  private constructor(gl: WebGL2RenderingContext, positions: Pass, mesh: Pass) {
    this.gl = gl;
    this.positionsPass = positions;
    this.meshPass = mesh;
    this.batch = gl.createBuffer();
    this.capture = gl.createTransformFeedback();
    this.quad = gl.createVertexArray();
    this.firstUnit = gl.getParameter(gl.MAX_COMBINED_TEXTURE_IMAGE_UNITS) - UNITS;
    this.bindingPoint = gl.getParameter(gl.MAX_UNIFORM_BUFFER_BINDINGS) - 1;
    withOwnState(gl, this.firstUnit, UNITS, () => {
      for (const pass of [positions, mesh]) {
        gl.useProgram(pass.program);
        // Each stage has a block of its own.
        const blocks: number = gl.getProgramParameter(pass.program, gl.ACTIVE_UNIFORM_BLOCKS);
        for (let block = 0; block < blocks; block += 1) {
          gl.uniformBlockBinding(pass.program, block, this.bindingPoint);
        }
        for (const [unit, place] of pass.textures) gl.uniform1i(place, this.firstUnit + unit);
      }
      gl.bindBufferBase(gl.UNIFORM_BUFFER, this.bindingPoint, this.batch);
      gl.bufferData(gl.UNIFORM_BUFFER, BATCH_BYTES, gl.DYNAMIC_DRAW);
    });
    // What it made is none of the context's that comes back.
    gl.canvas.addEventListener("webglcontextlost", () => {
      this.#isLost = true;
      this.#dirty.clear();
    });
  }

  get isLost(): boolean {
    return this.#isLost || this.gl.isContextLost();
  }

  /** A place for a mesh that shows avatars of this decoder; null where textures cannot be as large. */
  seat(undecoded: Undecoded, buffers: MeshBuffers): CardSeat | null {
    const { gl } = this;
    return withOwnState(gl, this.firstUnit, UNITS, () => {
      let decoder = this.#decoders.get(undecoded.matrix);
      if (!decoder) {
        decoder = new Decoder(this, undecoded);
        this.#decoders.set(undecoded.matrix, decoder);
      }
      if (!decoder.fits) return null;
      return new WebGlSeat(this, ...decoder.take(), buffers);
    });
  }

  touch(pool: CardPool): void {
    this.#dirty.add(pool as Pool);
  }

  /** Lets go of a decoder that has no bodies any more. */
  forget(matrix: DecoderMatrix): void {
    this.#decoders.delete(matrix);
  }

  /** Decodes what has changed. The engine finds the context as it was. */
  flush(): void {
    if (this.#dirty.size === 0 || this.isLost) return;
    withOwnState(this.gl, this.firstUnit, UNITS, () => {
      for (const pool of this.#dirty) pool.decode();
    });
    this.#dirty.clear();
  }

  bind(unit: number, texture: WebGLTexture | null): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + this.firstUnit + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
  }
}

/** A program, and where its textures are set, by {@link DECODED} or the number in the shader. */
interface Pass {
  readonly program: WebGLProgram;
  readonly textures: readonly [unit: number, place: WebGLUniformLocation][];
  /** Where the number of a body in the batch is set. */
  readonly first: WebGLUniformLocation | null;
}

function passOf(
  gl: WebGL2RenderingContext,
  vertex: string,
  fragment: string,
  captured: readonly string[],
): Pass | null {
  const program = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ] as const) {
    const shader = gl.createShader(kind);
    if (!shader) return null;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.transformFeedbackVaryings(program, captured, gl.SEPARATE_ATTRIBS);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
  const textures: [number, WebGLUniformLocation][] = [];
  const count: number = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
  for (let idx = 0; idx < count; idx += 1) {
    const name = gl.getActiveUniform(program, idx)?.name ?? "";
    const [, group, binding] = /^_group_(\d)_binding_(\d)_/.exec(name) ?? [];
    const place = gl.getUniformLocation(program, name);
    if (group && place) textures.push([group === "0" ? Number(binding) : DECODED, place]);
  }
  return { program, textures, first: gl.getUniformLocation(program, "naga_vs_first_instance") };
}

/** The tables of one decoder, and its bodies. */
class Decoder extends CardDecoder<Pool> {
  /** Whether the card's textures are large enough. */
  readonly fits: boolean;
  readonly tables: readonly [unit: number, texture: WebGLTexture][];
  readonly #card: WebGlCard;

  constructor(card: WebGlCard, undecoded: Undecoded) {
    const { gl } = card;
    const { vertices, weights, corners } = undecoded.tables();
    const maxSize: number = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    super(undecoded.matrix, vertices.length / 4, maxSize);
    this.#card = card;
    const rows = [vertices.length / 4, weights.length / 4, corners.length / 2];
    this.fits = Math.max(...rows.map((texels) => texels / WIDTH), WIDTH) <= maxSize;
    this.tables = this.fits
      ? [
          [VERTICES, textureOf(card, VERTICES, gl.RGBA32UI, WIDTH, vertices)],
          [WEIGHTS, textureOf(card, WEIGHTS, gl.RGBA32F, WIDTH, weights)],
          [CORNERS, textureOf(card, CORNERS, gl.RG32UI, WIDTH, corners)],
        ]
      : [];
  }

  protected override makePool(capacity: number): Pool {
    return new Pool(this.#card, this, capacity);
  }

  protected override dispose(): void {
    for (const [, texture] of this.tables) this.#card.gl.deleteTexture(texture);
    this.#card.forget(this.matrix);
  }
}

/** A texture of numbers, in whole rows of `width` texels. Leaves it bound. */
function textureOf(
  card: WebGlCard,
  unit: number,
  format: GLenum,
  width: number,
  numbers: Float32Array | Uint32Array | number,
): WebGLTexture {
  const { gl } = card;
  const texture = gl.createTexture();
  card.bind(unit, texture);
  const height =
    typeof numbers === "number" ? numbers : numbers.length / channels(gl, format) / width;
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  // Whole numbers and floats of 32 bits cannot be filtered.
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  }
  if (typeof numbers !== "number") write(gl, format, 0, width, height, numbers);
  return texture;
}

const channels = (gl: WebGL2RenderingContext, format: GLenum) =>
  format === gl.RG32F || format === gl.RG32UI ? 2 : 4;

/** Writes whole rows of the bound texture. */
function write(
  gl: WebGL2RenderingContext,
  format: GLenum,
  firstRow: number,
  width: number,
  height: number,
  numbers: Float32Array | Uint32Array,
): void {
  const isTwo = channels(gl, format) === 2;
  const [layout, type] =
    numbers instanceof Uint32Array
      ? [isTwo ? gl.RG_INTEGER : gl.RGBA_INTEGER, gl.UNSIGNED_INT]
      : [isTwo ? gl.RG : gl.RGBA, gl.FLOAT];
  const place = [0, 0, firstRow, width, height] as const;
  gl.texSubImage2D(gl.TEXTURE_2D, ...place, layout, type, numbers);
}

/** Room for some bodies of one decoder. */
class Pool extends CardPool<WebGlSeat> {
  readonly #card: WebGlCard;
  readonly #decoder: Decoder;
  readonly #textures: readonly [unit: number, texture: WebGLTexture][];
  readonly #decoded: WebGLTexture;
  readonly #target: WebGLFramebuffer;

  constructor(card: WebGlCard, decoder: Decoder, capacity: number) {
    super(card, decoder, capacity);
    const { gl } = card;
    this.#card = card;
    this.#decoder = decoder;
    const height = capacity * decoder.bodyRows;
    this.#textures = [
      [STILL, textureOf(card, STILL, gl.RGBA32F, WIDTH, height)],
      [CONTROLS, textureOf(card, CONTROLS, gl.RG32F, WIDTH, height)],
      [LATENTS, textureOf(card, LATENTS, gl.RGBA32F, this.latentWidth, capacity)],
    ];
    this.#decoded = textureOf(card, DECODED, gl.RGBA32F, WIDTH, height);
    this.#target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.#target);
    gl.framebufferTexture2D(
      ...[gl.DRAW_FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.#decoded, 0],
    );
  }

  override dispose(): void {
    const { gl } = this.#card;
    for (const [, texture] of this.#textures) gl.deleteTexture(texture);
    gl.deleteTexture(this.#decoded);
    gl.deleteFramebuffer(this.#target);
  }

  /** Decodes the bodies that have changed. */
  decode(): void {
    if (this.changed.size === 0) return;
    const { gl, positionsPass, meshPass } = this.#card;
    for (const [unit, texture] of [...this.#decoder.tables, ...this.#textures]) {
      this.#card.bind(unit, texture);
    }
    this.#upload(gl);
    this.#card.bind(DECODED, null);
    gl.useProgram(positionsPass.program);
    gl.bindVertexArray(this.#card.quad);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.#target);
    gl.viewport(0, 0, WIDTH, this.#decoder.bodyRows * this.seats.length);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, this.changed.size);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    this.#card.bind(DECODED, this.#decoded);
    gl.useProgram(meshPass.program);
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, this.#card.capture);
    let index = 0;
    for (const slot of this.changed) {
      gl.uniform1ui(meshPass.first, index);
      this.seats[slot]?.capture();
      index += 1;
    }
    gl.disable(gl.RASTERIZER_DISCARD);
    this.changed.clear();
  }

  #upload(gl: WebGL2RenderingContext): void {
    const { bodyRows } = this.#decoder;
    for (const [slot, undecoded] of this.constants) {
      const { stillPositions, controls } = undecoded.bodyTexels();
      const place = [slot * bodyRows, WIDTH, bodyRows] as const;
      gl.activeTexture(gl.TEXTURE0 + this.#card.firstUnit + STILL);
      write(gl, gl.RGBA32F, ...place, stillPositions);
      gl.activeTexture(gl.TEXTURE0 + this.#card.firstUnit + CONTROLS);
      write(gl, gl.RG32F, ...place, controls);
    }
    this.constants.clear();
    const { first, count, numbers } = this.beginBatch();
    gl.activeTexture(gl.TEXTURE0 + this.#card.firstUnit + LATENTS);
    write(gl, gl.RGBA32F, first, this.latentWidth, count, numbers);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, this.#card.bindingPoint, this.#card.batch);
    gl.bufferSubData(gl.UNIFORM_BUFFER, 0, this.batch);
  }
}

class WebGlSeat extends PoolSeat {
  readonly #card: WebGlCard;
  readonly #buffers: MeshBuffers;
  readonly #vertices: WebGLVertexArrayObject;
  readonly #vertexOf: WebGLBuffer;

  constructor(card: WebGlCard, pool: Pool, slot: number, buffers: MeshBuffers) {
    super(card, pool, slot, buffers.isShown);
    const { gl, meshPass } = card;
    this.#card = card;
    this.#buffers = buffers;
    this.#vertices = gl.createVertexArray();
    this.#vertexOf = gl.createBuffer();
    gl.bindVertexArray(this.#vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#vertexOf);
    gl.bufferData(gl.ARRAY_BUFFER, buffers.vertexOf, gl.STATIC_DRAW);
    const place = gl.getAttribLocation(meshPass.program, "_p2vs_location0");
    gl.enableVertexAttribArray(place);
    gl.vertexAttribIPointer(place, 1, gl.UNSIGNED_INT, 0, 0);
  }

  /** Has the vertices of the mesh written, with program, textures and number of the body as they are set. */
  capture(): void {
    const { gl } = this.#card;
    const { positions, normals, vertexOf } = this.#buffers;
    if (this.leaveDrawn()) this.copyToPrevious();
    gl.bindVertexArray(this.#vertices);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, positions);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 1, normals);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, vertexOf.length);
    gl.endTransformFeedback();
    // No engine can draw from a buffer that is bound here.
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 1, null);
  }

  protected override copyToPrevious(): void {
    const { gl } = this.#card;
    const { positions, previous, vertexOf } = this.#buffers;
    if (!previous) return;
    gl.bindBuffer(gl.COPY_READ_BUFFER, positions);
    gl.bindBuffer(gl.COPY_WRITE_BUFFER, previous);
    const bytes = VERTEX_BYTES * vertexOf.length;
    gl.copyBufferSubData(gl.COPY_READ_BUFFER, gl.COPY_WRITE_BUFFER, 0, 0, bytes);
    gl.bindBuffer(gl.COPY_READ_BUFFER, null);
    gl.bindBuffer(gl.COPY_WRITE_BUFFER, null);
  }

  protected override dispose(): void {
    this.#card.gl.deleteVertexArray(this.#vertices);
    this.#card.gl.deleteBuffer(this.#vertexOf);
  }
}
