// Decoding with WebGPU, on the device that an engine draws with: a compute pass decodes the positions of many bodies,
// then the vertices of each mesh, which are copied into the very buffers that the engine draws from. So every material,
// shadow and pass of the engine sees them as if they had been uploaded.
//
// The shaders and the layout of their textures are those of the Rust crate `dynaskin-decoding`.
import type { DecoderMatrix, Undecoded } from "../decoding.js";
import type { CardSeat } from "./card.js";
import { CardDecoder, CardPool, type PoolCard, PoolSeat } from "./card-pools.js";
import { COMPUTE, WIDTH } from "./decoding-shaders.js";

// TypeScript's DOM has the interfaces of WebGPU without their constants.
declare const GPUBufferUsage: Readonly<
  Record<"COPY_SRC" | "COPY_DST" | "UNIFORM" | "STORAGE", GPUBufferUsageFlags>
>;
declare const GPUTextureUsage: Readonly<
  Record<"COPY_DST" | "TEXTURE_BINDING", GPUTextureUsageFlags>
>;
declare const GPUShaderStage: Readonly<Record<"COMPUTE", GPUShaderStageFlags>>;

/** Threads of a workgroup in the shaders. */
const WORKGROUP = 64;
/** Bytes of a position or normal in a buffer. */
const VERTEX_BYTES = 12;
/** Storage buffers that the pass of a mesh has. */
const STORAGE_BUFFERS = 5;
/** Numbers of the shaders' textures and buffers. */
const [STILL, CONTROLS, LATENTS, POSITIONS, SIZES] = [4, 5, 6, 7, 9];

/** Buffers that an engine draws a mesh from, three floats a vertex. */
export interface GpuMeshBuffers {
  readonly positions: GPUBuffer;
  readonly normals: GPUBuffer;
  /** Positions as the frame before has them, where motion vectors are drawn. */
  readonly previous?: GPUBuffer | undefined;
}

/** A mesh of an engine. */
export interface GpuMesh {
  /** Which vertex of the body each of its vertices is. */
  readonly vertexOf: Uint32Array<ArrayBuffer>;
  /** Its positions as the CPU has uploaded them last. */
  readonly uploaded: Float32Array<ArrayBuffer>;
  /** Whether a frame has drawn the mesh. */
  readonly isShown: boolean;
  /** Its buffers at present: engines may make them anew. Null while there are none, or none that can be copied to. */
  buffers(): GpuMeshBuffers | null;
}

const cards = new WeakMap<GPUDevice, WebGpuCard>();

/** What decodes on a device; null where its limits are too small, as in compatibility mode, or it is lost. */
export function webGpuCard(device: GPUDevice): WebGpuCard | null {
  const known = cards.get(device);
  if (known) return known.isLost ? null : known;
  if (device.limits.maxStorageBuffersPerShaderStage < STORAGE_BUFFERS) return null;
  const card = new WebGpuCard(device);
  cards.set(device, card);
  return card;
}

/** Whether numbers of so many vertices can be copied into a buffer. */
export function takesVertices(buffer: GPUBuffer, count: number): boolean {
  return (buffer.usage & GPUBufferUsage.COPY_DST) !== 0 && buffer.size >= VERTEX_BYTES * count;
}

/** Decodes on one device. */
export class WebGpuCard implements PoolCard {
  readonly device: GPUDevice;
  readonly batchLayout: GPUBindGroupLayout;
  readonly meshLayout: GPUBindGroupLayout;
  readonly positionsPass: GPUComputePipeline;
  readonly meshPass: GPUComputePipeline;
  readonly #decoders = new Map<DecoderMatrix, Decoder>();
  readonly #dirty = new Set<Pool>();
  #isLost = false;

  constructor(device: GPUDevice) {
    this.device = device;
    this.batchLayout = batchLayoutOf(device);
    this.meshLayout = meshLayoutOf(device);
    const module = device.createShaderModule({ label: "dynaskin decoding", code: COMPUTE });
    const pipeline = (entryPoint: string, bindGroupLayouts: GPUBindGroupLayout[]) =>
      device.createComputePipeline({
        label: `dynaskin ${entryPoint}`,
        layout: device.createPipelineLayout({ bindGroupLayouts }),
        compute: { module, entryPoint },
      });
    this.positionsPass = pipeline("decode_positions", [this.batchLayout]);
    this.meshPass = pipeline("decode_mesh", [this.batchLayout, this.meshLayout]);
    void device.lost.then(() => {
      this.#isLost = true;
      this.#dirty.clear();
    });
  }

  get isLost(): boolean {
    return this.#isLost;
  }

  /** A place for a mesh that shows avatars of this decoder; null where the device's limits are too small. */
  seat(undecoded: Undecoded, mesh: GpuMesh): CardSeat | null {
    let decoder = this.#decoders.get(undecoded.matrix);
    if (!decoder) {
      decoder = new Decoder(this, undecoded);
      this.#decoders.set(undecoded.matrix, decoder);
    }
    if (!decoder.fits) return null;
    return new WebGpuSeat(this, ...decoder.take(), mesh);
  }

  touch(pool: CardPool): void {
    // Recorded bundles of draws are played without a word: what they draw is decoded after this frame's functions.
    if (this.#dirty.size === 0) queueMicrotask(() => this.flush());
    this.#dirty.add(pool as Pool);
  }

  forget(matrix: DecoderMatrix): void {
    this.#decoders.delete(matrix);
  }

  /** Decodes what has changed, before whatever is submitted to the device next. */
  flush(): void {
    if (this.#dirty.size === 0 || this.#isLost) return;
    const encoder = this.device.createCommandEncoder({ label: "dynaskin decoding" });
    for (const pool of this.#dirty) pool.decode(encoder);
    this.#dirty.clear();
    this.device.queue.submit([encoder.finish()]);
  }
}

function batchLayoutOf(device: GPUDevice): GPUBindGroupLayout {
  const visibility = GPUShaderStage.COMPUTE;
  const texture = (binding: number, sampleType: GPUTextureSampleType) => ({
    binding,
    visibility,
    texture: { sampleType },
  });
  const written = (binding: number) => ({
    binding,
    visibility,
    buffer: { type: "storage" as const },
  });
  return device.createBindGroupLayout({
    label: "dynaskin batch",
    entries: [
      { binding: 0, visibility, buffer: { type: "uniform" } },
      ...[texture(1, "uint"), texture(2, "unfilterable-float"), texture(3, "uint")],
      ...[STILL, CONTROLS, LATENTS].map((binding) => texture(binding, "unfilterable-float")),
      ...[POSITIONS, SIZES].map(written),
    ],
  });
}

function meshLayoutOf(device: GPUDevice): GPUBindGroupLayout {
  const kinds = ["uniform", "read-only-storage", "storage", "storage"] as const;
  return device.createBindGroupLayout({
    label: "dynaskin mesh",
    entries: kinds.map((type, binding) => ({
      binding,
      visibility: GPUShaderStage.COMPUTE,
      buffer: { type },
    })),
  });
}

/** The tables of one decoder, and its bodies. */
class Decoder extends CardDecoder<Pool> {
  /** Whether the device's limits are large enough. */
  readonly fits: boolean;
  readonly tables: readonly GPUTexture[];
  readonly #card: WebGpuCard;

  constructor(card: WebGpuCard, undecoded: Undecoded) {
    const { device } = card;
    const { vertices, weights, corners } = undecoded.tables();
    const { maxTextureDimension2D, maxStorageBufferBindingSize } = device.limits;
    const texels = vertices.length / 4;
    const maxBodies = Math.floor(maxStorageBufferBindingSize / (VERTEX_BYTES * texels));
    const maxRows = Math.min(maxTextureDimension2D, (maxBodies * texels) / WIDTH);
    super(undecoded.matrix, texels, maxRows);
    this.#card = card;
    const rows = [texels, weights.length / 4, corners.length / 2].map((count) => count / WIDTH);
    this.fits = maxBodies > 0 && Math.max(...rows, WIDTH) <= maxTextureDimension2D;
    this.tables = this.fits
      ? [
          filled(device, "rgba32uint", vertices),
          filled(device, "rgba32float", weights),
          filled(device, "rg32uint", corners),
        ]
      : [];
  }

  protected override makePool(capacity: number): Pool {
    return new Pool(this.#card, this, capacity);
  }

  protected override dispose(): void {
    for (const texture of this.tables) texture.destroy();
    this.#card.forget(this.matrix);
  }
}

const CHANNELS = { rgba32uint: 4, rgba32float: 4, rg32uint: 2, rg32float: 2 } as const;

type Format = keyof typeof CHANNELS;

function textureOf(device: GPUDevice, format: Format, width: number, height: number): GPUTexture {
  return device.createTexture({
    label: "dynaskin decoding",
    size: [width, height],
    format,
    usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST,
  });
}

/** A texture of numbers, in whole rows of {@link WIDTH} texels. */
function filled(
  device: GPUDevice,
  format: Format,
  numbers: Uint32Array | Float32Array,
): GPUTexture {
  const texture = textureOf(device, format, WIDTH, numbers.length / CHANNELS[format] / WIDTH);
  write(device, texture, 0, numbers);
  return texture;
}

/** Writes whole rows from one on. */
function write(
  device: GPUDevice,
  texture: GPUTexture,
  firstRow: number,
  numbers: Uint32Array | Float32Array,
): void {
  const { width, format } = texture;
  const perRow = width * CHANNELS[format as Format];
  const { buffer, byteOffset, byteLength } = numbers;
  device.queue.writeTexture(
    { texture, origin: [0, firstRow] },
    new Uint8Array(buffer as ArrayBuffer, byteOffset, byteLength),
    { bytesPerRow: 4 * perRow },
    [width, numbers.length / perRow],
  );
}

/** Room for some bodies of one decoder. */
class Pool extends CardPool<WebGpuSeat> {
  readonly #device: GPUDevice;
  readonly #card: WebGpuCard;
  readonly #bodyRows: number;
  readonly #still: GPUTexture;
  readonly #controls: GPUTexture;
  readonly #latents: GPUTexture;
  readonly #buffers: Record<"batch" | "positions" | "sizes", GPUBuffer>;
  readonly #group: GPUBindGroup;

  constructor(card: WebGpuCard, decoder: Decoder, capacity: number) {
    super(card, decoder, capacity);
    const { device, batchLayout } = card;
    this.#card = card;
    this.#device = device;
    this.#bodyRows = decoder.bodyRows;
    const height = capacity * decoder.bodyRows;
    this.#still = textureOf(device, "rgba32float", WIDTH, height);
    this.#controls = textureOf(device, "rg32float", WIDTH, height);
    this.#latents = textureOf(device, "rgba32float", this.latentWidth, capacity);
    const { STORAGE, UNIFORM, COPY_DST } = GPUBufferUsage;
    this.#buffers = {
      batch: bufferOf(device, this.batch.byteLength, UNIFORM | COPY_DST),
      positions: bufferOf(device, VERTEX_BYTES * WIDTH * height, STORAGE),
      sizes: bufferOf(device, 4 * WIDTH * height, STORAGE),
    };
    const textures = [...decoder.tables, this.#still, this.#controls, this.#latents];
    const { batch, positions, sizes } = this.#buffers;
    this.#group = device.createBindGroup({
      label: "dynaskin batch",
      layout: batchLayout,
      entries: [
        { binding: 0, resource: { buffer: batch } },
        ...textures.map((texture, idx) => ({ binding: 1 + idx, resource: texture.createView() })),
        { binding: POSITIONS, resource: { buffer: positions } },
        { binding: SIZES, resource: { buffer: sizes } },
      ],
    });
  }

  override dispose(): void {
    for (const texture of [this.#still, this.#controls, this.#latents]) texture.destroy();
    for (const buffer of Object.values(this.#buffers)) buffer.destroy();
  }

  /** Decodes the bodies that have changed. */
  decode(encoder: GPUCommandEncoder): void {
    if (this.changed.size === 0) return;
    this.#upload();
    const seats = [...this.changed].flatMap((slot) => this.seats[slot] ?? []);
    for (const seat of seats) seat.leave(encoder);
    const pass = encoder.beginComputePass({ label: "dynaskin decoding" });
    pass.setBindGroup(0, this.#group);
    pass.setPipeline(this.#card.positionsPass);
    pass.dispatchWorkgroups(groups(this.#bodyRows * WIDTH), this.changed.size);
    pass.setPipeline(this.#card.meshPass);
    for (const seat of seats) seat.decode(pass);
    pass.end();
    for (const seat of seats) seat.copy(encoder);
    this.changed.clear();
  }

  #upload(): void {
    const device = this.#device;
    for (const [slot, undecoded] of this.constants) {
      const { stillPositions, controls } = undecoded.bodyTexels();
      write(device, this.#still, slot * this.#bodyRows, stillPositions);
      write(device, this.#controls, slot * this.#bodyRows, controls);
    }
    this.constants.clear();
    const { first, numbers } = this.beginBatch();
    write(device, this.#latents, first, numbers);
    device.queue.writeBuffer(this.#buffers.batch, 0, this.batch);
  }
}

const groups = (threads: number) => Math.ceil(threads / WORKGROUP);

function bufferOf(device: GPUDevice, size: number, usage: GPUBufferUsageFlags): GPUBuffer {
  return device.createBuffer({ label: "dynaskin decoding", size, usage });
}

class WebGpuSeat extends PoolSeat {
  readonly #device: GPUDevice;
  readonly #mesh: GpuMesh;
  /** Whether the engine draws what is decoded here, and not what the CPU has uploaded. */
  #isDecoded = false;
  /** Where previous positions were copied to last: engines may make the buffer anew. */
  #previous: GPUBuffer | undefined;
  readonly #buffers: Record<"mesh" | "vertices" | "positions" | "normals", GPUBuffer>;
  readonly #group: GPUBindGroup;

  constructor(card: WebGpuCard, pool: Pool, slot: number, mesh: GpuMesh) {
    super(card, pool, slot, mesh.isShown);
    const { device, meshLayout } = card;
    const { STORAGE, UNIFORM, COPY_SRC, COPY_DST } = GPUBufferUsage;
    const count = mesh.vertexOf.length;
    this.#device = device;
    this.#mesh = mesh;
    this.#buffers = {
      mesh: bufferOf(device, 8, UNIFORM | COPY_DST),
      vertices: bufferOf(device, 4 * count, STORAGE | COPY_DST),
      positions: bufferOf(device, VERTEX_BYTES * count, STORAGE | COPY_SRC | COPY_DST),
      normals: bufferOf(device, VERTEX_BYTES * count, STORAGE | COPY_SRC),
    };
    device.queue.writeBuffer(this.#buffers.mesh, 0, Uint32Array.of(slot, count));
    device.queue.writeBuffer(this.#buffers.vertices, 0, mesh.vertexOf);
    this.#group = device.createBindGroup({
      label: "dynaskin mesh",
      layout: meshLayout,
      entries: Object.values(this.#buffers).map((buffer, binding) => ({
        binding,
        resource: { buffer },
      })),
    });
  }

  override overwrite(): void {
    super.overwrite();
    this.#isDecoded = false;
  }

  override beginFrame(): void {
    if (this.#mesh.buffers()?.previous !== this.#previous) this.forgetPrevious();
    super.beginFrame();
  }

  /** Before what the engine draws is decoded anew. */
  leave(encoder: GPUCommandEncoder): void {
    if (this.leaveDrawn()) this.#keep(encoder);
    this.#isDecoded = true;
  }

  /** Decodes the vertices of the mesh, with the pass's pipeline and batch as they are set. */
  decode(pass: GPUComputePassEncoder): void {
    pass.setBindGroup(1, this.#group);
    pass.dispatchWorkgroups(groups(this.#mesh.vertexOf.length));
  }

  /** Hands them to the engine. */
  copy(encoder: GPUCommandEncoder): void {
    const target = this.#mesh.buffers();
    if (!target) {
      // New ones are written the next time that the surface is taken.
      this.overwrite();
      return;
    }
    const size = VERTEX_BYTES * this.#mesh.vertexOf.length;
    encoder.copyBufferToBuffer(this.#buffers.positions, 0, target.positions, 0, size);
    encoder.copyBufferToBuffer(this.#buffers.normals, 0, target.normals, 0, size);
  }

  protected override copyToPrevious(): void {
    if (!this.#mesh.buffers()?.previous) return;
    const encoder = this.#device.createCommandEncoder({ label: "dynaskin previous positions" });
    this.#keep(encoder);
    this.#device.queue.submit([encoder.finish()]);
  }

  #keep(encoder: GPUCommandEncoder): void {
    const previous = this.#mesh.buffers()?.previous;
    this.#previous = previous;
    if (!previous) return;
    const { positions } = this.#buffers;
    const { uploaded, vertexOf } = this.#mesh;
    if (!this.#isDecoded) this.#device.queue.writeBuffer(positions, 0, uploaded);
    encoder.copyBufferToBuffer(positions, 0, previous, 0, VERTEX_BYTES * vertexOf.length);
  }

  protected override dispose(): void {
    for (const buffer of Object.values(this.#buffers)) buffer.destroy();
  }
}
