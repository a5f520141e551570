// Bones of three.js that move by themselves what tissue moves.
import { type Bone, Matrix4, type Object3D, Quaternion, type SkinnedMesh, Vector3 } from "three";
import { type SpringBones, type SpringNames, shareBeside } from "../bind/springs.js";
import { nameOf } from "./read-avatar.js";

/** The bones of these names and what hangs on them. */
export function springBonesOf(
  meshes: readonly SkinnedMesh[],
  { springs, mapped }: SpringNames,
): Set<Object3D> {
  const found = new Set<Object3D>();
  const add = (object: Object3D) => {
    if (mapped.has(nameOf(object))) return;
    found.add(object);
    object.children.forEach(add);
  };
  for (const { skeleton } of meshes) {
    for (const bone of skeleton.bones) if (springs.has(nameOf(bone))) add(bone);
  }
  return found;
}

/** How much of the tissue each vertex keeps beside these bones; empty for all of it. */
export function sharesBeside(
  { geometry, skeleton }: SkinnedMesh,
  bones: ReadonlySet<Object3D>,
  springBones: SpringBones,
): Float32Array {
  const joints = geometry.getAttribute("skinIndex");
  const weights = geometry.getAttribute("skinWeight");
  const isSpring = skeleton.bones.map((bone) => bones.has(bone));
  if (springBones === "replace" || !joints || !weights || !isSpring.includes(true)) {
    return new Float32Array(0);
  }
  const shares = new Float32Array(joints.count);
  for (let vertex = 0; vertex < joints.count; vertex += 1) {
    let weight = 0;
    for (let slot = 0; slot < joints.itemSize; slot += 1) {
      if (isSpring[joints.getComponent(vertex, slot)]) {
        weight += weights.getComponent(vertex, slot);
      }
    }
    shares[vertex] = shareBeside(springBones, weight);
  }
  return shares;
}

/** Keeps bones as they were bound, whatever turns them. */
export class HeldBones {
  readonly #bones: { bone: Object3D; position: Vector3; turn: Quaternion; scale: Vector3 }[];

  constructor(meshes: readonly SkinnedMesh[], bones: ReadonlySet<Object3D>) {
    this.#bones = [...bones].map((bone) => {
      const [position, turn, scale] = [new Vector3(), new Quaternion(), new Vector3()];
      boundMatrix(meshes, bone).decompose(position, turn, scale);
      return { bone, position, turn, scale };
    });
  }

  hold(): void {
    for (const { bone, position, turn, scale } of this.#bones) {
      bone.position.copy(position);
      bone.quaternion.copy(turn);
      bone.scale.copy(scale);
    }
  }
}

/** From its own space to its parent's where it was bound; as it is now where no skin says that. */
function boundMatrix(meshes: readonly SkinnedMesh[], bone: Object3D): Matrix4 {
  for (const { skeleton } of meshes) {
    const inverseOf = (object: Object3D | null) =>
      skeleton.boneInverses[skeleton.bones.indexOf(object as Bone)];
    const [own, parents] = [inverseOf(bone), inverseOf(bone.parent)];
    if (own && parents) return new Matrix4().multiplyMatrices(parents, own.clone().invert());
  }
  bone.updateMatrix();
  return bone.matrix.clone();
}
