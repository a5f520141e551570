// Reads an avatar of Babylon.js into arrays, for binding.
import type { Bone } from "@babylonjs/core/Bones/bone.js";
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { Matrix } from "@babylonjs/core/Maths/math.vector.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import type { Node } from "@babylonjs/core/node.js";
import { type AvatarMesh, type AvatarNode, type AvatarParts, unskinned } from "../bind/parts.js";
import { DynaSkinError } from "../error.js";

/** Bones of a person by VRM's names, as a page that reads the VRM extension knows them. */
export type Humanoid = Readonly<Record<string, TransformNode>>;

const MIRROR_Z = Matrix.Scaling(1, 1, -1);

/** Refuses what is no node of Babylon.js. */
export function checkRoot(root: unknown): asserts root is TransformNode {
  if (typeof (root as TransformNode | null)?.getDescendants === "function") return;
  throw new DynaSkinError(
    "argument",
    "The avatar must be a node, such as the first mesh that Babylon's glTF loader gives.",
  );
}

/** The skinned meshes under a node. */
export function skinnedMeshes(root: TransformNode): Mesh[] {
  const meshes = [root, ...root.getDescendants(false)] as Mesh[];
  return meshes.filter(
    (mesh) => mesh.skeleton && mesh.geometry && "getIndices" in mesh && !("sourceMesh" in mesh),
  );
}

/** The matrix of a node in a right-handed world; column-major, as Babylon's are in memory. */
export function worldOf(node: Node, into: Matrix, refresh: boolean): Matrix {
  into.copyFrom(refresh ? node.computeWorldMatrix(true) : node.getWorldMatrix());
  return node.getScene().useRightHandedSystem ? into : into.multiplyToRef(MIRROR_Z, into);
}

/** The joints of a mesh's skin, in the order in which vertices name them. */
export function jointsOf({ skeleton }: Mesh): Bone[] {
  const joints: Bone[] = [];
  for (const bone of skeleton?.bones ?? []) {
    const idx = bone.getIndex();
    if (idx >= 0) joints[idx] = bone;
  }
  return joints;
}

/** Numbers of a mesh's vertices as they are meant, three a vertex. */
export function vectorsOf(mesh: Mesh, kind: string): Float32Array {
  return Float32Array.from(mesh.getVerticesData(kind, true) ?? []);
}

/**
 * Reads the nodes and skinned meshes under `root`, in the root's space.
 *
 * @throws DynaSkinError `avatar` where no mesh is skinned, and for a skin whose bones are no nodes under `root`
 */
export function readAvatar(root: TransformNode, humanoid: Humanoid = {}): AvatarParts {
  const meshes = skinnedMeshes(root);
  if (meshes.length === 0) throw unskinned(meshCount(root));
  const names = new Map(Object.entries(humanoid).map(([name, node]) => [node as Node, name]));
  root.computeWorldMatrix(true);
  const toRoot = worldOf(root, new Matrix(), true).clone().invert();
  const nodes: AvatarNode[] = [];
  const places = new Map<Node, number>();
  const add = (node: Node, parent: number | undefined) => {
    const place = nodes.length;
    const matrix = worldOf(node, new Matrix(), true).multiply(toRoot);
    const name = names.get(node);
    places.set(node, place);
    nodes.push({
      ...{ name: node.name, matrix: Float64Array.from(matrix.asArray()) },
      ...(name !== undefined && { humanoid: name }),
      ...(parent !== undefined && { parent }),
    });
    for (const child of node.getChildren()) add(child, place);
  };
  add(root, undefined);
  return { nodes, meshes: meshes.map((mesh) => readMesh(mesh, places)) };
}

function meshCount(root: TransformNode): number {
  const nodes = [root, ...root.getDescendants(false)] as Mesh[];
  return nodes.filter((node) => "getIndices" in node && node.geometry).length;
}

function readMesh(mesh: Mesh, places: Map<Node, number>): AvatarMesh {
  const joints = jointsOf(mesh);
  const skins = [
    [VertexBuffer.MatricesIndicesKind, VertexBuffer.MatricesIndicesExtraKind],
    [VertexBuffer.MatricesWeightsKind, VertexBuffer.MatricesWeightsExtraKind],
  ].map((kinds) => joined(...kinds.map((kind) => mesh.getVerticesData(kind))));
  const inverseBinds = joints.flatMap((bone) => [...bone.getAbsoluteInverseBindMatrix().asArray()]);
  return {
    name: mesh.name,
    material: mesh.material?.name ?? "",
    positions: vectorsOf(mesh, VertexBuffer.PositionKind),
    skinJoints: Uint16Array.from(skins[0] ?? []),
    skinWeights: Float32Array.from(skins[1] ?? []),
    indices: Uint32Array.from(mesh.getIndices() ?? []),
    joints: Uint32Array.from(joints, (bone) => placeOf(bone, mesh, places)),
    inverseBinds: Float64Array.from(inverseBinds),
  };
}

/** Four numbers a vertex, and four more where there are any. */
function joined(four?: ArrayLike<number> | null, more?: ArrayLike<number> | null): number[] {
  const numbers = Array.from(four ?? []);
  if (!more) return numbers;
  return numbers.flatMap((number, idx) =>
    idx % 4 < 3 ? number : [number, ...Array.from(more).slice(idx - 3, idx + 1)],
  );
}

function placeOf(bone: Bone, mesh: Mesh, places: Map<Node, number>): number {
  const node = bone.getTransformNode();
  const place = node ? places.get(node) : undefined;
  if (place !== undefined) return place;
  throw new DynaSkinError(
    "avatar",
    `The bone ${bone.name} of the mesh ${mesh.name} is moved by no node under the one that was given: ` +
      "give the one that has both meshes and skeleton in it, loaded from a glTF file.",
  );
}
