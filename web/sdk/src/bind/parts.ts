// An avatar as an engine hands it over: arrays that travel to a worker.
import { DynaSkinError } from "../error.js";

/** A node of the avatar's tree. */
export interface AvatarNode {
  /** Its name in the file. */
  name: string;
  /** VRM's name of it, where it has one. */
  humanoid?: string;
  /** Place of its parent in the list; left out for the topmost. */
  parent?: number;
  /** From its own space to that of the avatar's root, right-handed, +Y up, column-major. */
  matrix: Float64Array;
}

/** A skinned mesh. */
export interface AvatarMesh {
  name: string;
  material: string;
  /** `[vertex][x, y, z]`, the mesh's own space. */
  positions: Float32Array;
  /** Joints of each vertex, the same number for each, as places in {@link joints}. */
  skinJoints: Uint16Array;
  /** Their weights. */
  skinWeights: Float32Array;
  /** Triangles, `[face][3]`. */
  indices: Uint32Array;
  /** Nodes that are the skin's joints. */
  joints: Uint32Array;
  /** From the mesh's space to each joint's where the mesh was bound, `[joint][16]`, column-major. */
  inverseBinds: Float64Array;
}

/** All that binding needs to know of an avatar. */
export interface AvatarParts {
  nodes: AvatarNode[];
  meshes: AvatarMesh[];
}

/** What is said of an avatar of which no mesh is skinned; `meshes`: how many it has. */
export function unskinned(meshes: number): DynaSkinError {
  if (meshes === 0) {
    return new DynaSkinError(
      "avatar",
      "There is no mesh under the object that was given: give the one that has the avatar's meshes and " +
        "skeleton in it.",
    );
  }
  const found =
    meshes === 1
      ? "The one mesh under the object that was given is not skinned"
      : `There are ${meshes} meshes under the object that was given and none of them is skinned`;
  return new DynaSkinError(
    "avatar",
    `${found}: soft tissue follows bones, so export the avatar with its armature and weights.`,
  );
}

/** What binding is told beside the avatar. */
export interface BindWish {
  depicts: string | undefined;
  /** Pairs of the body's joint and the node that turns it. */
  bones: string[];
}
