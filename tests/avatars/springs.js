// Springs of three-vrm on bones. In JavaScript: the package's declarations are not for strict resolution.
import { VRMSpringBoneJoint, VRMSpringBoneManager } from "@pixiv/three-vrm-springbone";

/**
 * Springs that move bones by themselves.
 *
 * @param {typeof import("three")} THREE
 * @param {import("three").Object3D} root
 * @param {import("three").Bone[]} bones
 * @returns {{ update(deltaSeconds: number): void }}
 */
export function springsOn(THREE, root, bones) {
  const springs = new VRMSpringBoneManager();
  for (const bone of bones) {
    const end = new THREE.Bone();
    end.position.z = 0.07;
    bone.add(end);
    const settings = { stiffness: 1, dragForce: 0.2, gravityPower: 0, hitRadius: 0 };
    springs.addJoint(new VRMSpringBoneJoint(bone, end, settings));
  }
  root.updateMatrixWorld(true);
  springs.setInitState();
  return springs;
}
