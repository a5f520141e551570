// How much of the tissue the vertices of a mesh take.
import type { Material, SkinnedMesh } from "three";
import { shareOf, type TissueOptions } from "../bind/tissue.js";
import { materialsOf } from "./read-avatar.js";

/** How much of the tissue each vertex takes; empty where it is all of it. */
export function sharesOf(
  mesh: SkinnedMesh,
  options: TissueOptions<SkinnedMesh, Material>,
): Float32Array {
  const { geometry } = mesh;
  const { count } = geometry.getAttribute("position");
  const of = materialsOf(mesh).map((material) => shareOf(options, mesh, material));
  const [first = 1] = of;
  if (of.every((share) => share === first)) {
    return first === 1 ? new Float32Array(0) : new Float32Array(count).fill(first);
  }
  // Where materials meet, the stiffer one keeps its shape.
  const shares = new Float32Array(count).fill(1);
  const vertexAt = (at: number) => geometry.index?.getX(at) ?? at;
  const corners = geometry.index?.count ?? count;
  for (const { start, count: length, materialIndex } of geometry.groups) {
    const share = of[materialIndex ?? 0] ?? 1;
    for (let at = start; at < Math.min(start + length, corners); at += 1) {
      const vertex = vertexAt(at);
      shares[vertex] = Math.min(shares[vertex] ?? 1, share);
    }
  }
  return shares;
}

/** The lesser of two shares for each vertex; empty lists stand for all of the tissue. */
export function lesser(a: Float32Array, b: Float32Array): Float32Array {
  if (a.length === 0 || b.length === 0) return a.length === 0 ? b : a;
  return a.map((share, vertex) => Math.min(share, b[vertex] ?? 1));
}
