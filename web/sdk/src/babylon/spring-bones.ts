// Bones of Babylon.js that move by themselves what tissue moves.
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { Matrix, Quaternion, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import type { Node } from "@babylonjs/core/node.js";
import { type SpringBones, type SpringNames, shareBeside } from "../bind/springs.js";
import { jointsOf } from "./read-avatar.js";

const JOINTS = [VertexBuffer.MatricesIndicesKind, VertexBuffer.MatricesIndicesExtraKind];
const WEIGHTS = [VertexBuffer.MatricesWeightsKind, VertexBuffer.MatricesWeightsExtraKind];

/** The nodes of these names and what hangs on them. Clones have something before their names. */
export function springBonesOf(
  meshes: readonly Mesh[],
  { springs, mapped }: SpringNames,
): Set<TransformNode> {
  const isOf = (names: ReadonlySet<string>, { name }: Node) =>
    names.has(name) || [...names].some((known) => known !== "" && name.endsWith(` ${known}`));
  const found = new Set<TransformNode>();
  const add = (node: TransformNode) => {
    if (isOf(mapped, node)) return;
    found.add(node);
    for (const child of node.getChildTransformNodes(true)) add(child);
  };
  for (const bone of meshes.flatMap(jointsOf)) {
    const node = bone?.getTransformNode();
    if (node && isOf(springs, node)) add(node);
  }
  return found;
}

/** How much of the tissue each vertex keeps beside these bones; empty for all of it. */
export function sharesBeside(
  mesh: Mesh,
  nodes: ReadonlySet<TransformNode>,
  springBones: SpringBones,
): Float32Array {
  const isSpring = jointsOf(mesh).map((bone) =>
    nodes.has(bone.getTransformNode() as TransformNode),
  );
  if (springBones === "replace" || !isSpring.includes(true)) return new Float32Array(0);
  const sums = new Float32Array(mesh.getTotalVertices());
  for (const [set, kind] of JOINTS.entries()) {
    const joints = mesh.getVerticesData(kind) ?? [];
    const weights = mesh.getVerticesData(WEIGHTS[set] ?? "") ?? [];
    for (let at = 0; at < joints.length; at += 1) {
      const vertex = Math.floor(at / 4);
      if (isSpring[joints[at] ?? -1]) sums[vertex] = (sums[vertex] ?? 0) + (weights[at] ?? 0);
    }
  }
  return sums.map((weight) => shareBeside(springBones, weight));
}

/** Keeps bones as they were bound, whatever turns them. */
export class HeldBones {
  readonly #nodes: { node: TransformNode; position: Vector3; turn: Quaternion; scale: Vector3 }[];

  constructor(meshes: readonly Mesh[], nodes: ReadonlySet<TransformNode>) {
    this.#nodes = [...nodes].map((node) => {
      const [position, turn, scale] = [new Vector3(), new Quaternion(), new Vector3()];
      boundMatrix(meshes, node).decompose(scale, turn, position);
      return { node, position, turn, scale };
    });
  }

  hold(): void {
    for (const { node, position, turn, scale } of this.#nodes) {
      node.position.copyFrom(position);
      node.rotationQuaternion ??= new Quaternion();
      node.rotationQuaternion.copyFrom(turn);
      node.scaling.copyFrom(scale);
    }
  }
}

/** From its own space to its parent's where it was bound; as it is now where no skin says that. */
function boundMatrix(meshes: readonly Mesh[], node: TransformNode): Matrix {
  for (const mesh of meshes) {
    const joints = jointsOf(mesh);
    const inverseOf = (of: Node | null) =>
      joints.find((bone) => bone?.getTransformNode() === of)?.getAbsoluteInverseBindMatrix();
    const [own, parents] = [inverseOf(node), inverseOf(node.parent)];
    if (own && parents) return own.clone().invert().multiply(parents);
  }
  const { position, rotation, rotationQuaternion, scaling } = node;
  const turn = rotationQuaternion ?? Quaternion.FromEulerVector(rotation);
  return Matrix.Compose(scaling, turn, position);
}
