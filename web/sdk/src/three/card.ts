// Surfaces that the graphics card decodes, as three's renderers draw them.
import { BufferAttribute, type BufferGeometry, type SkinnedMesh, type WebGLRenderer } from "three";
import type { CardSeat } from "../adapter/card.js";
import { type WebGlCard, webGlCard } from "../adapter/webgl-card.js";
import { takesVertices, type WebGpuCard, webGpuCard } from "../adapter/webgpu-card.js";
import type { Undecoded } from "../decoding.js";
import type { PreviousPositions } from "./motion-vectors.js";

/** A card, and how meshes are drawn from what it writes. */
export interface ThreeCard {
  /** Decodes what has changed. */
  flush(): void;
  /** Null where the card cannot, or has no buffers for the mesh yet. */
  surface(undecoded: Undecoded, mesh: CardMesh): CardSurface | null;
}

/** Positions and normals of a mesh as they are uploaded where the CPU decodes. */
export type Uploaded = Readonly<Record<"position" | "normal", BufferAttribute>>;

/** A mesh whose surface a card writes. */
export interface CardMesh {
  readonly uploaded: Uploaded;
  /** Of the frame before, where motion vectors are drawn. */
  readonly previous: PreviousPositions | null;
  /** Which vertex of the body each of its vertices is. */
  readonly vertexOf: Uint32Array<ArrayBuffer>;
  /** Brings the numbers of {@link uploaded} up to date, for whoever reads them. */
  refresh(): void;
}

/** What a card writes of a mesh. */
export interface CardSurface extends CardSeat {
  /** Has a geometry drawn with it. */
  attach(geometry: BufferGeometry): void;
  /** Has it drawn with what is uploaded again. */
  detach(geometry: BufferGeometry): void;
}

/** Of each renderer. */
const known = new WeakMap<
  object,
  { readonly card: WebGlCard | WebGpuCard; readonly of: ThreeCard }
>();

/** What decodes for a renderer; null for those that are unknown, and where nothing can. */
export function cardOf(renderer: unknown): ThreeCard | null {
  const { isWebGLRenderer, backend } = (renderer ?? {}) as SomeRenderer;
  if (isWebGLRenderer) {
    const card = webGlCard((renderer as WebGLRenderer).getContext());
    return card && keep(renderer as object, card, () => webGlCardOf(card));
  }
  if (!backend?.isWebGPUBackend || !backend.device || !backend.get) return null;
  const card = webGpuCard(backend.device);
  return card && keep(renderer as object, card, () => webGpuCardOf(card, backend as WebGpuBackend));
}

interface SomeRenderer {
  readonly isWebGLRenderer?: boolean;
  readonly backend?: Partial<WebGpuBackend>;
}

/** A context that was lost gets a card of its own. */
function keep(renderer: object, card: WebGlCard | WebGpuCard, make: () => ThreeCard): ThreeCard {
  const kept = known.get(renderer);
  if (kept?.card === card) return kept.of;
  const made = make();
  known.set(renderer, { card, of: made });
  return made;
}

function webGlCardOf(card: WebGlCard): ThreeCard {
  return {
    flush: () => card.flush(),
    surface: (undecoded, mesh) => WebGlSurface.of(card, undecoded, mesh),
  };
}

/** Bytes of a vertex in a buffer. */
const VERTEX_BYTES = 12;

/**
 * An attribute whose buffer the graphics card writes. three.js takes it for its `GLBufferAttribute`; for rays and
 * bounds it has numbers too, which are made when they are read.
 */
class CardAttribute extends BufferAttribute {
  readonly isGLBufferAttribute = true;
  readonly type: number;
  readonly elementSize = 4;
  readonly buffer: WebGLBuffer;

  constructor(numbers: Float32Array, gl: WebGL2RenderingContext, refresh: () => void) {
    super(numbers, 3);
    this.type = gl.FLOAT;
    this.buffer = gl.createBuffer();
    const before = gl.getParameter(gl.ARRAY_BUFFER_BINDING);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, (numbers.length / 3) * VERTEX_BYTES, gl.DYNAMIC_COPY);
    gl.bindBuffer(gl.ARRAY_BUFFER, before);
    Object.defineProperty(this, "array", {
      get: () => {
        refresh();
        return numbers;
      },
    });
  }

  /** Of the numbers, which nobody else writes. */
  override clone(): this {
    return new BufferAttribute(this.array.slice(), 3) as this;
  }
}

/** Attributes whose buffers a card writes with WebGL. */
class WebGlSurface implements CardSurface {
  readonly #card: WebGlCard;
  readonly #seat: CardSeat;
  readonly #uploaded: Uploaded;
  readonly #attributes: readonly [name: string, attribute: CardAttribute][];

  static of(
    card: WebGlCard,
    undecoded: Undecoded,
    { uploaded, vertexOf, refresh }: CardMesh,
  ): WebGlSurface | null {
    const position = new CardAttribute(uploaded.position.array as Float32Array, card.gl, refresh);
    const normal = new CardAttribute(uploaded.normal.array as Float32Array, card.gl, refresh);
    const [positions, normals] = [position.buffer, normal.buffer];
    const buffers = { positions, normals, vertexOf, isShown: true };
    const seat = card.seat(undecoded, buffers);
    if (seat) return new WebGlSurface(card, seat, uploaded, { position, normal });
    for (const { buffer } of [position, normal]) card.gl.deleteBuffer(buffer);
    return null;
  }

  private constructor(
    card: WebGlCard,
    seat: CardSeat,
    uploaded: Uploaded,
    attributes: Record<string, CardAttribute>,
  ) {
    this.#card = card;
    this.#seat = seat;
    this.#uploaded = uploaded;
    this.#attributes = Object.entries(attributes);
  }

  get isLost(): boolean {
    return this.#seat.isLost;
  }

  attach(geometry: BufferGeometry): void {
    for (const [name, attribute] of this.#attributes) geometry.setAttribute(name, attribute);
  }

  detach(geometry: BufferGeometry): void {
    for (const [name, attribute] of Object.entries(this.#uploaded)) {
      geometry.setAttribute(name, attribute);
    }
  }

  take(undecoded: Undecoded): void {
    this.#seat.take(undecoded);
  }

  overwrite(): void {
    this.#seat.overwrite();
  }

  beginFrame(): void {
    this.#seat.beginFrame();
  }

  free(): void {
    this.#seat.free();
    if (this.isLost) return;
    for (const [, { buffer }] of this.#attributes) this.#card.gl.deleteBuffer(buffer);
  }
}

/** What is used of three's `WebGPUBackend`. */
interface WebGpuBackend {
  readonly isWebGPUBackend: boolean;
  readonly device: GPUDevice;
  /** What it has made of an attribute: its buffer, once the attribute is drawn. */
  get(attribute: BufferAttribute): { readonly buffer?: GPUBuffer };
}

function webGpuCardOf(card: WebGpuCard, backend: WebGpuBackend): ThreeCard {
  return {
    flush: () => card.flush(),
    surface(undecoded, mesh) {
      const { uploaded, previous, vertexOf } = mesh;
      const of = (attribute: BufferAttribute | undefined) => {
        const buffer = attribute && backend.get(attribute).buffer;
        return buffer && takesVertices(buffer, vertexOf.length) ? buffer : undefined;
      };
      const buffers = () => {
        const [positions, normals] = [of(uploaded.position), of(uploaded.normal)];
        return positions && normals
          ? { positions, normals, previous: of(previous?.attribute) }
          : null;
      };
      const seat =
        buffers() &&
        card.seat(undecoded, {
          vertexOf,
          uploaded: uploaded.position.array as Float32Array<ArrayBuffer>,
          // Before that its buffers are not made.
          isShown: true,
          buffers,
        });
      return seat && new WebGpuSurface(seat, mesh);
    },
  };
}

/** Attributes whose buffers, which three has made, a card writes with WebGPU. */
class WebGpuSurface implements CardSurface {
  readonly #seat: CardSeat;
  readonly #mesh: CardMesh;

  constructor(seat: CardSeat, mesh: CardMesh) {
    this.#seat = seat;
    this.#mesh = mesh;
  }

  get isLost(): boolean {
    return this.#seat.isLost;
  }

  /** For rays and bounds, numbers are made when they are read. */
  attach(): void {
    const { uploaded, previous, refresh } = this.#mesh;
    previous?.leaveTo(this.#seat);
    for (const attribute of Object.values(uploaded)) {
      let { array } = attribute;
      Object.defineProperty(attribute, "array", {
        get: () => {
          refresh();
          return array;
        },
        set: (numbers: typeof array) => {
          array = numbers;
        },
        configurable: true,
        enumerable: true,
      });
    }
  }

  detach(): void {
    const { uploaded, previous } = this.#mesh;
    previous?.leaveTo(null);
    for (const attribute of Object.values(uploaded)) {
      const { array } = attribute;
      const plain = { value: array, writable: true, configurable: true, enumerable: true };
      Object.defineProperty(attribute, "array", plain);
    }
  }

  take(undecoded: Undecoded): void {
    this.#seat.take(undecoded);
  }

  overwrite(): void {
    this.#seat.overwrite();
  }

  beginFrame(): void {
    this.#seat.beginFrame();
  }

  free(): void {
    this.#seat.free();
  }
}

const HOOKS = ["onBeforeRender", "onBeforeShadow"] as const;

/** Says when a mesh is about to be drawn, and by which renderer. */
export class DrawWatch {
  readonly #mesh: SkinnedMesh;
  readonly #before: (renderer: unknown) => void;
  readonly #hooks: {
    readonly name: (typeof HOOKS)[number];
    readonly own: unknown;
    readonly had: PropertyDescriptor | undefined;
  }[] = [];

  constructor(mesh: SkinnedMesh, before: (renderer: unknown) => void) {
    this.#mesh = mesh;
    this.#before = before;
    this.follow();
  }

  /** Takes the place of functions that the page has assigned since, and calls them. */
  follow(): void {
    const [mesh, before] = [this.#mesh, this.#before];
    for (const name of HOOKS) {
      if (this.#hooks.some((hook) => hook.own === mesh[name])) continue;
      const [had, page] = [Object.getOwnPropertyDescriptor(mesh, name), mesh[name]];
      const own = function (this: SkinnedMesh, ...args: unknown[]) {
        before(args[0]);
        (page as (...all: unknown[]) => void).apply(this, args);
      };
      mesh[name] = own as typeof mesh.onBeforeRender & typeof mesh.onBeforeShadow;
      this.#hooks.push({ name, own, had });
    }
  }

  /** Gives the mesh back what it had. */
  release(): void {
    for (const { name, own, had } of this.#hooks.splice(0).reverse()) {
      // Whoever has set another meanwhile keeps that.
      if (this.#mesh[name] !== own) continue;
      if (had) Object.defineProperty(this.#mesh, name, had);
      else delete (this.#mesh as Partial<SkinnedMesh>)[name];
    }
  }
}
