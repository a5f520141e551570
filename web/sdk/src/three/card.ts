// Surfaces that the graphics card decodes, as WebGLRenderer draws them.
import { BufferAttribute, type BufferGeometry, type SkinnedMesh, type WebGLRenderer } from "three";
import type { CardSeat } from "../adapter/card.js";
import { type WebGlCard, webGlCard } from "../adapter/webgl-card.js";
import type { Undecoded } from "../decoding.js";

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

/** The attributes of a mesh that a card writes. */
export class CardSurface implements CardSeat {
  readonly #card: WebGlCard;
  readonly #seat: CardSeat;
  readonly #attributes: readonly [name: string, attribute: CardAttribute][];

  static of(
    card: WebGlCard,
    undecoded: Undecoded,
    numbers: Readonly<Record<"position" | "normal", Float32Array>>,
    vertexOf: Uint32Array,
    refresh: () => void,
  ): CardSurface | null {
    const position = new CardAttribute(numbers.position, card.gl, refresh);
    const normal = new CardAttribute(numbers.normal, card.gl, refresh);
    const buffers = { positions: position.buffer, normals: normal.buffer, vertexOf };
    const seat = card.seat(undecoded, buffers);
    if (seat) return new CardSurface(card, seat, { position, normal });
    for (const { buffer } of [position, normal]) card.gl.deleteBuffer(buffer);
    return null;
  }

  private constructor(card: WebGlCard, seat: CardSeat, attributes: Record<string, CardAttribute>) {
    this.#card = card;
    this.#seat = seat;
    this.#attributes = Object.entries(attributes);
  }

  get isLost(): boolean {
    return this.#seat.isLost;
  }

  /** Has a geometry drawn with them. */
  attach(geometry: BufferGeometry): void {
    for (const [name, attribute] of this.#attributes) geometry.setAttribute(name, attribute);
  }

  take(undecoded: Undecoded): void {
    this.#seat.take(undecoded);
  }

  overwrite(): void {
    this.#seat.overwrite();
  }

  free(): void {
    this.#seat.free();
    if (this.isLost) return;
    for (const [, { buffer }] of this.#attributes) this.#card.gl.deleteBuffer(buffer);
  }
}

/** What decodes in the context of a renderer; null for other renderers, and where it cannot. */
export function cardOf(renderer: unknown): WebGlCard | null {
  const known = renderer as (WebGLRenderer & { isWebGLRenderer?: boolean }) | null;
  return known?.isWebGLRenderer ? webGlCard(known.getContext()) : null;
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
