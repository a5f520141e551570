import type { Avatar } from "../avatar.js";
import { checkFlag, checkObject } from "../check.js";
import { DynaSkinError } from "../error.js";
import { JOINT_NAMES, type JointName, type Pose } from "../pose.js";
import type { Skinning } from "../skinning.js";
import type { RestBody } from "./vertex-map.js";

/** What an adapter needs from an avatar in this thread, in a worker, or anywhere else. */
export interface RemoteAvatar {
  /** Moves to a pose, `dtSeconds` after the last; see `Avatar.step`. */
  step(pose: Pose, dtSeconds: number): void;
  /** Rest-pose positions with the offsets, `[vertex][x, y, z]` flattened, metres. */
  readonly positions: Float32Array;
  /** Unit normals of `positions`. */
  readonly normals: Float32Array;
  /** Changes whenever the shape may have changed; see `Avatar.revision`. */
  readonly revision: number;
  /** Metres of the world per metre of the body, for the translation of poses; see `Avatar.scale`. */
  readonly scale: number;
  /** How the motions of the joints are blended, `linear` if left out; see `Avatar.skinning`. */
  readonly skinning?: Skinning;
  /** Rest positions of the 24 joints for the present shape: `[joint][x, y, z]` flattened, metres. */
  restJointsM(): Float32Array;
  /** @internal */
  restBody?: (() => RestBody | null) | undefined;
}

/** What an adapter shows: an avatar in this thread, or one in a worker. */
export type TissueSource = Avatar | RemoteAvatar;

/**
 * How the joints of dynaskin's skeleton and the vertices of its body are found in a mesh. The
 * defaults fit the bodies in `models/`.
 */
export interface RigOptions {
  /** Names of bones that are not named like their joints. */
  boneNames?: Partial<Record<JointName, string>>;
  /**
   * The body's vertex for each vertex of the mesh, if they differ. The adapter finds it by rest positions for
   * meshes that were renumbered, split at seams or had parts left out.
   */
  vertexMap?: ArrayLike<number>;
  /**
   * Whether the engine's motion vectors follow the tissue, which takes the memory and time of one more set of
   * positions; see `previousPositions` in three.js. `false` if left out.
   */
  motionVectors?: boolean;
}

/** Parent of each joint in SMPL's order; -1 for the root. */
export const JOINT_PARENTS: readonly number[] = [
  -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
];

/** A joint's rest position relative to its parent's (the root's: to the origin), metres. */
export function restOffsetM(jointsM: Float32Array, joint: number): [number, number, number] {
  const parent = JOINT_PARENTS[joint] ?? -1;
  const part = (axis: number) =>
    (jointsM[joint * 3 + axis] ?? 0) - (parent < 0 ? 0 : (jointsM[parent * 3 + axis] ?? 0));
  return [part(0), part(1), part(2)];
}

/**
 * Radius of a sphere around the pelvis that holds the body in every pose, in metres. It is the longest
 * chain of bones, and twice the largest distance of skin from its nearest joint: skin may follow
 * another joint than the nearest.
 */
export function reachM(positions: Float32Array, jointsM: Float32Array): number {
  const chains: number[] = [];
  for (const [joint, parent] of JOINT_PARENTS.entries()) {
    chains.push(
      parent < 0 ? 0 : (chains[parent] ?? 0) + Math.hypot(...restOffsetM(jointsM, joint)),
    );
  }
  let farthest = 0;
  for (let at = 0; at < positions.length; at += 3) {
    let nearest = Number.POSITIVE_INFINITY;
    for (let joint = 0; joint < jointsM.length; joint += 3) {
      const x = (positions[at] ?? 0) - (jointsM[joint] ?? 0);
      const y = (positions[at + 1] ?? 0) - (jointsM[joint + 1] ?? 0);
      const z = (positions[at + 2] ?? 0) - (jointsM[joint + 2] ?? 0);
      nearest = Math.min(nearest, x * x + y * y + z * z);
    }
    farthest = Math.max(farthest, nearest);
  }
  return Math.max(...chains) + 2 * Math.sqrt(farthest);
}

/**
 * Refuses what is no avatar, or no options.
 *
 * @throws DynaSkinError `argument`
 */
export function checkSource(avatar: TissueSource, options: RigOptions): void {
  checkObject("options", options);
  checkFlag("motionVectors", options.motionVectors);
  if (avatar?.positions instanceof Float32Array) return;
  throw new DynaSkinError(
    "argument",
    "DynaSkin needs an avatar, as createAvatar() or createWorkerAvatar() gives it, and then a mesh.",
  );
}

/** Finds the 24 bones by name. */
export function findBones<Bone>(
  find: (name: string) => Bone | null | undefined,
  names: RigOptions["boneNames"] = {},
): Bone[] {
  const missing: string[] = [];
  const bones = JOINT_NAMES.flatMap((joint) => {
    const bone = find(names[joint] ?? joint);
    if (!bone) missing.push(names[joint] ?? joint);
    return bone ? [bone] : [];
  });
  if (missing.length === 0) return bones;
  throw new DynaSkinError(
    "argument",
    `The mesh's skeleton has no bone called ${missing.join(", ")}. ` +
      "Name the bones that stand for them in the option boneNames.",
  );
}

/**
 * Checks that a mesh and a body belong together.
 *
 * @throws DynaSkinError `argument`
 */
export function checkVertices(
  meshVertices: number,
  bodyVertices: number,
  map: RigOptions["vertexMap"],
): void {
  if (!map) {
    if (meshVertices === bodyVertices) return;
    throw new DynaSkinError(
      "argument",
      `The mesh has ${meshVertices} vertices and the avatar ${bodyVertices}. ` +
        "Not all of them lie where vertices of the body do, so that it cannot be told which they are. " +
        "Use the body.glb of the avatar's model, or give a vertexMap; for other avatars there is bindAvatar.",
    );
  }
  if (map.length !== meshVertices) {
    throw new DynaSkinError(
      "argument",
      `vertexMap must hold one number per vertex of the mesh, ${meshVertices}, got ${map.length}.`,
    );
  }
  for (let idx = 0; idx < map.length; idx += 1) {
    const vertex = map[idx] as number;
    if (Number.isInteger(vertex) && vertex >= 0 && vertex < bodyVertices) continue;
    throw new DynaSkinError(
      "argument",
      `vertexMap[${idx}] is ${vertex}; the body's vertices are 0 to ${bodyVertices - 1}.`,
    );
  }
}

/** Shapes of a body differ by less than this from the mesh of its file: the farthest, and half of all, metres. */
const MOST_APART_M = { farthest: 0.8, median: 0.25 };

/**
 * Checks that the mesh's vertices lie where the body's do: files whose vertices were renumbered, turned
 * or moved have as many, and would be torn.
 *
 * @param meshM - rest positions of the mesh from its pelvis, metres
 * @throws DynaSkinError `argument`
 */
export function checkPlaces(
  meshM: Float32Array,
  { positions }: TissueSource,
  pelvisM: ArrayLike<number>,
  map: RigOptions["vertexMap"],
): void {
  const apart = new Float32Array(meshM.length / 3);
  for (let idx = 0; idx < apart.length; idx += 1) {
    const vertex = map?.[idx] ?? idx;
    let square = 0;
    for (let axis = 0; axis < 3; axis += 1) {
      const ofBody = (positions[3 * vertex + axis] ?? 0) - (pelvisM[axis] ?? 0);
      square += ((meshM[3 * idx + axis] ?? 0) - ofBody) ** 2;
    }
    apart[idx] = Math.sqrt(square);
  }
  apart.sort();
  const [median = 0, farthest = 0] = [apart[apart.length >> 1], apart.at(-1)];
  // Written so that what is no number is refused.
  if (median <= MOST_APART_M.median && farthest <= MOST_APART_M.farthest) return;
  throw new DynaSkinError(
    "argument",
    `The mesh's vertices lie up to ${farthest.toFixed(1)} m from where the body has them: they were ` +
      "renumbered, turned or moved, or vertexMap is that of another mesh. Use body.glb as it comes with " +
      "the model; for other avatars there is bindAvatar.",
  );
}

const drivenMeshes = new WeakSet<object>();

/**
 * Marks a mesh as driven, until {@link releaseMesh}. Two at one mesh would each take the other's
 * surface for the mesh's own, and give back the wrong one.
 *
 * @throws DynaSkinError `argument` if it is driven already
 */
export function claimMesh(mesh: object): void {
  if (drivenMeshes.has(mesh)) {
    throw new DynaSkinError(
      "argument",
      "Another DynaSkin or AvatarTissue moves this mesh already; dispose of that one first, or clone " +
        "the mesh.",
    );
  }
  drivenMeshes.add(mesh);
}

/** The mesh may be driven by another. */
export function releaseMesh(mesh: object): void {
  drivenMeshes.delete(mesh);
}

/** Refuses rest frames that are turned against the model's axes, which a pose cannot express. */
export function checkAligned(joint: JointName, turnedBy: number): void {
  if (turnedBy < 0.01) return;
  throw new DynaSkinError(
    "argument",
    `The rest frame of the bone for ${joint} is turned against the model's axes. ` +
      "dynaskin's own bodies have aligned frames; other rigs are not supported yet.",
  );
}

/** Copies `[vertex][x, y, z]` arrays, through a vertex map if there is one. */
export function copyVertices(
  from: Float32Array,
  to: Float32Array,
  map: RigOptions["vertexMap"],
): void {
  if (!map) {
    to.set(from);
    return;
  }
  for (let idx = 0; idx < map.length; idx += 1) {
    const at = (map[idx] ?? 0) * 3;
    to[idx * 3] = from[at] ?? 0;
    to[idx * 3 + 1] = from[at + 1] ?? 0;
    to[idx * 3 + 2] = from[at + 2] ?? 0;
  }
}
