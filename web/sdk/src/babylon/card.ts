// Surfaces that the graphics card decodes, as Babylon's engines draw them.
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import type { AbstractEngine } from "@babylonjs/core/Engines/abstractEngine.js";
import type { ThinEngine } from "@babylonjs/core/Engines/thinEngine.js";
import type { Geometry } from "@babylonjs/core/Meshes/geometry.js";
import type { CardSeat } from "../adapter/card.js";
import { webGlCard } from "../adapter/webgl-card.js";
import { takesVertices, webGpuCard } from "../adapter/webgpu-card.js";
import type { Undecoded } from "../decoding.js";
import { PREVIOUS } from "./motion-vectors.js";

/** A card, and meshes' places on it. */
export interface BabylonCard {
  /** Decodes what has changed. */
  flush(): void;
  /** A place for a mesh; null where the card cannot, or the mesh has no buffers. */
  seat(undecoded: Undecoded, mesh: CardMesh): CardSeat | null;
}

/** A mesh whose positions and normals a card writes. */
export interface CardMesh {
  readonly geometry: Geometry;
  /** Its positions as the CPU has uploaded them last. */
  readonly uploaded: Float32Array<ArrayBuffer>;
  /** Which vertex of the body each of its vertices is. */
  readonly vertexOf: Uint32Array<ArrayBuffer>;
  /** Whether a frame has drawn it. */
  readonly isShown: boolean;
}

const KINDS = [VertexBuffer.PositionKind, VertexBuffer.NormalKind, PREVIOUS] as const;

/** What decodes for an engine; null where nothing can. */
export function cardOf(engine: AbstractEngine): BabylonCard | null {
  const { isWebGPU, _gl: gl, _device: device } = engine as ThinEngine & { _device?: GPUDevice };
  if (isWebGPU) return device ? webGpuCardOf(device) : null;
  return gl ? webGlCardOf(gl) : null;
}

function webGlCardOf(gl: WebGL2RenderingContext): BabylonCard | null {
  const card = webGlCard(gl);
  return (
    card && {
      flush: () => card.flush(),
      seat(undecoded, { geometry, vertexOf, isShown }) {
        const [positions, normals, previous] = buffersOf<WebGLBuffer>(geometry);
        if (!positions || !normals) return null;
        return card.seat(undecoded, { positions, normals, previous, vertexOf, isShown });
      },
    }
  );
}

function webGpuCardOf(device: GPUDevice): BabylonCard | null {
  const card = webGpuCard(device);
  if (!card) return null;
  return {
    flush: () => card.flush(),
    seat(undecoded, { geometry, ...mesh }) {
      const buffers = () => {
        const [positions, normals, previous] = buffersOf<GPUBuffer>(geometry).map((buffer) =>
          buffer && takesVertices(buffer, mesh.vertexOf.length) ? buffer : undefined,
        );
        return positions && normals ? { positions, normals, previous } : null;
      };
      return buffers() && card.seat(undecoded, { ...mesh, buffers });
    },
  };
}

/** Of positions, normals, and the previous positions where there are any. */
function buffersOf<Buffer>(geometry: Geometry): (Buffer | undefined)[] {
  return KINDS.map((kind) => geometry.getVertexBuffer(kind)?.getBuffer()?.underlyingResource);
}
