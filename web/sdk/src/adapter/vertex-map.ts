// Which vertex of the body each vertex of a mesh is, where rest positions tell.
import type { TissueSource } from "./rig.js";

/** The body without shape, at rest. */
export interface RestBody {
  /** `[vertex][x, y, z]`, metres. */
  positions: Float32Array;
  /** Of the joints, `[joint][x, y, z]`, metres. */
  jointsM: Float32Array;
}

/** How a mesh follows the body's joints. */
export interface MeshSkin {
  /** `[vertex][x, y, z]`, the mesh's own space. */
  positions: Float32Array;
  /** Joints that move each vertex, four a vertex; -1 for bones that are none. */
  joints: Int16Array;
  /** Their weights. */
  weights: Float32Array;
  /** From the mesh's space to each joint's where the mesh was bound, `[joint][16]`, column-major, metres. */
  jointFromMesh: Float64Array;
}

/** Farther from every vertex of the body a vertex is none of them, metres: quantised files are off by less. */
const SAME_M = 1e-3;
/** The same where a vertex is placed by its joints, beside what numbers are rounded by, metres. */
const SAME_BY_JOINTS_M = 2e-4;
/** How much of a number two roundings to single precision may change. */
const ROUNDED = 2 ** -22;
/** Cells of space in which vertices are looked up, metres; nothing farther is the same. */
const CELL_M = 4e-3;
/** Numbers of cells along an axis, for keys: 20 m in each direction. */
const CELLS = 10_000;

/**
 * The body's vertex for each vertex of a mesh that is made of the body: renumbered, split at seams, or with
 * parts left out.
 *
 * Where the mesh lies is tried first. Then where its vertices lie from their own joints: Blender puts the skeleton
 * of a quantised file kilometres away, where numbers are so coarse that joints and skin move against each other.
 *
 * @param meshM - rest positions of the mesh from its pelvis, metres
 * @param skinOf - gives how it follows the joints
 * @returns undefined where the vertices are as the body's are, where the source does not know the body, and
 *   where any vertex is none of the body's
 */
export function findVertexMap(
  meshM: Float32Array,
  { restBody }: TissueSource,
  skinOf: () => MeshSkin,
): Uint32Array | undefined {
  const body = restBody?.();
  if (!body) return undefined;
  const bodyM = body.positions.map((metres, idx) => metres - (body.jointsM[idx % 3] ?? 0));
  const cells = new Cells(bodyM);
  const same = [SAME_M, SAME_M, SAME_M] as const;
  for (const placedOf of [() => ({ placedM: meshM, same }), () => byJoints(skinOf(), body)]) {
    const placed = placedOf();
    const { length } = placed.placedM;
    if (length === bodyM.length && isInOrder(placed, bodyM)) return undefined;
    const map = cells.mapOf(placed);
    if (map) return map;
  }
  return undefined;
}

/** Rest positions of a mesh from its pelvis. */
interface Placed {
  placedM: Float32Array;
  /** How far along each axis a vertex may be from the one that it is, metres. */
  same: readonly [x: number, y: number, z: number];
}

/** By its joints, and how coarse the numbers are there. */
function byJoints(skin: MeshSkin, { jointsM }: RestBody): Placed {
  const same = [0, 1, 2].map((axis) => {
    let farthestM = 0;
    for (let at = 12 + axis; at < skin.jointFromMesh.length; at += 16) {
      farthestM = Math.max(farthestM, Math.abs(skin.jointFromMesh[at] ?? 0));
    }
    return Math.min(CELL_M, SAME_BY_JOINTS_M + ROUNDED * farthestM);
  });
  const [x = 0, y = 0, z = 0] = same;
  return { placedM: fromJoints(skin, jointsM), same: [x, y, z] };
}

/** Rest positions from the pelvis of a mesh whose joints are put where those of the body are, metres. */
function fromJoints(skin: MeshSkin, jointsM: Float32Array): Float32Array {
  const { positions, joints, weights, jointFromMesh } = skin;
  const placed = new Float32Array(positions.length);
  for (let vertex = 0; 3 * vertex < positions.length; vertex += 1) {
    const [x = 0, y = 0, z = 0] = positions.subarray(3 * vertex, 3 * vertex + 3);
    const sum = [0, 0, 0];
    let whole = 0;
    for (let at = 4 * vertex; at < 4 * vertex + 4; at += 1) {
      const [joint = -1, weight = 0] = [joints[at], weights[at]];
      if (joint < 0) continue;
      whole += weight;
      const from = (row: number, column: number) =>
        jointFromMesh[16 * joint + 4 * column + row] ?? 0;
      for (const [axis, before] of sum.entries()) {
        const own = from(axis, 0) * x + from(axis, 1) * y + from(axis, 2) * z + from(axis, 3);
        const jointM = (jointsM[3 * joint + axis] ?? 0) - (jointsM[axis] ?? 0);
        sum[axis] = before + weight * (jointM + own);
      }
    }
    // No number where no joint moves it: it is nowhere.
    placed.set(
      sum.map((metres) => metres / whole),
      3 * vertex,
    );
  }
  return placed;
}

function isInOrder({ placedM, same }: Placed, bodyM: Float32Array): boolean {
  for (let vertex = 0; 3 * vertex < placedM.length; vertex += 1) {
    // Written so that what is no number is not in order.
    if (!(apart(placedM, vertex, bodyM, vertex, same) <= 1)) return false;
  }
  return true;
}

/** How far two vertices are apart, in what counts as the same along each axis. */
function apart(
  a: Float32Array,
  at: number,
  b: Float32Array,
  other: number,
  same: Placed["same"],
): number {
  const along = (axis: 0 | 1 | 2) =>
    ((a[3 * at + axis] ?? 0) - (b[3 * other + axis] ?? 0)) / same[axis];
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

  /** The vertex that each of another mesh is; undefined where any is none. */
  mapOf(placed: Placed): Uint32Array | undefined {
    const map = new Uint32Array(placed.placedM.length / 3);
    for (let vertex = 0; vertex < map.length; vertex += 1) {
      const found = this.#nearest(placed, vertex);
      if (found < 0) return undefined;
      map[vertex] = found;
    }
    return map;
  }

  /** The vertex that is nearest to one of another mesh; -1 where none is as near as to be the same. */
  #nearest({ placedM, same }: Placed, at: number): number {
    let [best, nearest] = [-1, 1];
    const [x, y, z] = cellOf(placedM, at);
    for (let dx = -1; dx <= 1; dx += 1) {
      for (let dy = -1; dy <= 1; dy += 1) {
        for (let dz = -1; dz <= 1; dz += 1) {
          for (const vertex of this.#vertices.get(keyOf(x + dx, y + dy, z + dz)) ?? []) {
            const distance = apart(placedM, at, this.#positionsM, vertex, same);
            if (distance <= nearest) [best, nearest] = [vertex, distance];
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
