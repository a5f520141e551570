// A copy of a geometry whose positions and normals are written each frame.
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import type { Geometry } from "@babylonjs/core/Meshes/geometry.js";

/**
 * A copy of the geometry with positions and normals of its own, `[vertex][3]`; normals empty where it has
 * none. All its numbers are floats: where one attribute has another type than before, Babylon's WebGPU engine
 * compiles shaders anew and forgets about other attributes that hold whole numbers.
 */
export function withSurface(
  source: Geometry,
  positions: Float32Array,
  normals: Float32Array,
): Geometry {
  const own = source.copy(`${source.id} dynaskin`);
  for (const [kind, buffer] of Object.entries(own.getVertexBuffers() ?? {})) {
    if (buffer.type === VertexBuffer.FLOAT || buffer.normalized) continue;
    const numbers = own.getVerticesData(kind, true);
    if (numbers) own.setVerticesData(kind, numbers, false, buffer.getSize());
  }
  own.setVerticesData(VertexBuffer.PositionKind, positions, true, 3);
  if (normals.length > 0) own.setVerticesData(VertexBuffer.NormalKind, normals, true, 3);
  return own;
}
