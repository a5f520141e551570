// Where vertices were in the frame before, for the motion vectors of WebGPURenderer.
import { BufferAttribute, type BufferGeometry, type Material, type Object3D } from "three";
import type { CardSeat } from "../adapter/card.js";
import { DynaSkinError } from "../error.js";
import { USAGE } from "./own-geometry.js";

/** Name of the attribute in geometries of ours. */
export const PREVIOUS = "dynaskinPrevious";

/** Of the geometries that have the attribute. */
const known = new WeakMap<BufferGeometry, PreviousPositions>();

/** Positions before skinning as the last frame drew them. */
export class PreviousPositions {
  /** They, `[vertex][3]`. */
  readonly attribute: BufferAttribute;
  readonly #present: BufferAttribute;
  /** What the frame draws that is being drawn. */
  readonly #drawn: Float32Array;
  #drawnVersion: number;
  #frame: number | null = null;
  /** Whether that is what was drawn before. */
  #isStill = true;
  /** What keeps them instead, on a graphics card. */
  #seat: CardSeat | null = null;

  constructor(present: BufferAttribute) {
    this.#present = present;
    this.#drawn = Float32Array.from(present.array);
    this.#drawnVersion = present.version;
    this.attribute = new BufferAttribute(this.#drawn.slice(), 3).setUsage(USAGE);
  }

  /** Gives them to a geometry, under the name {@link PREVIOUS}. */
  attach(geometry: BufferGeometry): void {
    geometry.setAttribute(PREVIOUS, this.attribute);
    known.set(geometry, this);
  }

  /**
   * Leaves it to a graphics card, which copies positions that it has decoded; null takes it back, from when on the next
   * frame counts as the first.
   */
  leaveTo(seat: CardSeat | null): void {
    this.#seat = seat;
    this.#frame = null;
  }

  /** Is told before each drawing in which frame that is: where another begins, what was drawn moves on. */
  begin(frame: number): void {
    if (frame === this.#frame) return;
    if (this.#seat) {
      this.#frame = frame;
      this.#seat.beginFrame();
      return;
    }
    const { array, version } = this.#present;
    const isMoved = version !== this.#drawnVersion;
    // Before the first frame nothing was drawn anywhere else.
    if (this.#frame === null) this.#drawn.set(array);
    this.#frame = frame;
    if (!isMoved && this.#isStill) return;
    this.attribute.array.set(this.#drawn);
    this.attribute.needsUpdate = true;
    this.#drawn.set(array);
    this.#drawnVersion = version;
    this.#isStill = !isMoved;
  }
}

/** Nodes of three's shading language, as far as they are needed here. */
interface ShadingNode {
  add(other: unknown): ShadingNode;
  sub(other: unknown): ShadingNode;
  toVarying(name: string): ShadingNode;
}

/** What `import * as TSL from "three/tsl"` gives, as far as it is needed here. */
export interface ShadingLanguage<Context> {
  attribute(name: string, type: "vec3"): unknown;
  // biome-ignore lint/suspicious/noExplicitAny: three's types of nodes differ from version to version.
  overrideNode(node: any, callback: any): Context;
  // biome-ignore lint/suspicious/noExplicitAny: likewise.
  OnBeforeObjectUpdate(callback: (frame: any) => void): unknown;
  positionGeometry: unknown;
  positionLocal: unknown;
  positionPrevious: unknown;
}

/** What three's builder of shaders builds. */
interface Built {
  readonly geometry: BufferGeometry;
  readonly material: Material;
}

/** What three says of a drawing. */
interface Drawing {
  readonly object: Object3D & { geometry: BufferGeometry };
  readonly frameId: number;
}

/**
 * Lets the motion vectors of `WebGPURenderer` (`velocity`, which `TRAANode` and `motionBlur` read) follow the tissue
 * of meshes whose `DynaSkin` or `AvatarTissue` has the option `motionVectors`. Other objects are drawn as before.
 *
 * ```ts
 * import * as TSL from "three/tsl";
 * renderer.contextNode = previousPositions(TSL);
 * ```
 *
 * @param tsl - the module `three/tsl` of three 0.187 or newer
 * @returns a node for `renderer.contextNode`, before the first picture is drawn
 * @throws DynaSkinError `argument` for what is no such module
 */
export function previousPositions<Context>(tsl: ShadingLanguage<Context>): Context {
  if (typeof tsl?.overrideNode !== "function") {
    throw new DynaSkinError(
      "argument",
      'previousPositions() needs the module "three/tsl" of three 0.187 or newer: import * as TSL from "three/tsl".',
    );
  }
  const { positionPrevious } = tsl;
  return tsl.overrideNode(positionPrevious, ({ geometry }: Built) => {
    if (!geometry.hasAttribute(PREVIOUS)) return positionPrevious;
    tsl.OnBeforeObjectUpdate(({ object, frameId }: Drawing) => {
      known.get(object.geometry)?.begin(frameId);
    });
    // The engine leaves morph targets out of what was before; what they add now they most often added then.
    const previous = tsl.attribute(PREVIOUS, "vec3") as ShadingNode;
    const morphed = (tsl.positionLocal as ShadingNode).sub(tsl.positionGeometry);
    return previous.add(morphed).toVarying("dynaskinPreviousPosition");
  });
}
