// Which vertex of the body each vertex of a mesh is, where rest positions tell.
import type { TissueSource } from "./rig.js";

/** The body without shape, at rest. */
export interface RestBody {
  /** `[vertex][x, y, z]`, metres. */
  positions: Float32Array;
  /** Of the pelvis, metres. */
  pelvisM: ArrayLike<number>;
}

/** Farther from every vertex of the body a vertex is none of them, metres: quantised files are off by less. */
const SAME_M = 1e-3;
/** Cells of space in which vertices are looked up, metres; not less than SAME_M. */
const CELL_M = 4e-3;
/** Numbers of cells along an axis, for keys: 20 m in each direction. */
const CELLS = 10_000;

/**
 * The body's vertex for each vertex of a mesh that is made of the body: renumbered, split at seams, or with
 * parts left out.
 *
 * @param meshM - rest positions of the mesh from its pelvis, metres
 * @returns undefined where the vertices are as the body's are, where the source does not know the body, and
 *   where any vertex is none of the body's
 */
export function findVertexMap(
  meshM: Float32Array,
  { restBody }: TissueSource,
): Uint32Array | undefined {
  const body = restBody?.();
  if (!body) return undefined;
  const bodyM = body.positions.map((metres, idx) => metres - (body.pelvisM[idx % 3] ?? 0));
  if (meshM.length === bodyM.length && isInOrder(meshM, bodyM)) return undefined;
  const cells = new Cells(bodyM);
  const map = new Uint32Array(meshM.length / 3);
  for (let vertex = 0; vertex < map.length; vertex += 1) {
    const found = cells.nearest(meshM, vertex);
    if (found < 0) return undefined;
    map[vertex] = found;
  }
  return map;
}

function isInOrder(meshM: Float32Array, bodyM: Float32Array): boolean {
  for (let vertex = 0; 3 * vertex < meshM.length; vertex += 1) {
    // Written so that what is no number is not in order.
    if (!(apartM(meshM, vertex, bodyM, vertex) <= SAME_M)) return false;
  }
  return true;
}

function apartM(a: Float32Array, at: number, b: Float32Array, other: number): number {
  const along = (axis: number) => (a[3 * at + axis] ?? 0) - (b[3 * other + axis] ?? 0);
  return Math.hypot(along(0), along(1), along(2));
}

/** The body's vertices by the cell of space in which they lie. */
class Cells {
  readonly #positionsM: Float32Array;
  readonly #vertices = new Map<number, number[]>();

  constructor(positionsM: Float32Array) {
    this.#positionsM = positionsM;
    for (let vertex = 0; 3 * vertex < positionsM.length; vertex += 1) {
      const [x, y, z] = cellOf(positionsM, vertex);
      const key = keyOf(x, y, z);
      const own = this.#vertices.get(key);
      if (own) own.push(vertex);
      else this.#vertices.set(key, [vertex]);
    }
  }

  /** The vertex that is nearest to one of another mesh; -1 where none is as near as to be the same. */
  nearest(positionsM: Float32Array, at: number): number {
    let [best, bestM] = [-1, SAME_M];
    const [x, y, z] = cellOf(positionsM, at);
    for (let dx = -1; dx <= 1; dx += 1) {
      for (let dy = -1; dy <= 1; dy += 1) {
        for (let dz = -1; dz <= 1; dz += 1) {
          for (const vertex of this.#vertices.get(keyOf(x + dx, y + dy, z + dz)) ?? []) {
            const distanceM = apartM(positionsM, at, this.#positionsM, vertex);
            if (distanceM <= bestM) [best, bestM] = [vertex, distanceM];
          }
        }
      }
    }
    return best;
  }
}

function cellOf(positionsM: Float32Array, vertex: number): [number, number, number] {
  const cell = (axis: number) => Math.floor((positionsM[3 * vertex + axis] ?? 0) / CELL_M);
  return [cell(0), cell(1), cell(2)];
}

/** What lies beyond the cells may have the key of another; distances tell. */
function keyOf(x: number, y: number, z: number): number {
  return (x * CELLS + y) * CELLS + z;
}
