// Dual-quaternion skinning by the vertex stage of WebGLRenderer's materials.
import type { SkinnedMesh } from "three";
import { DUAL_QUATERNIONS } from "../adapter/dual-quaternion.js";
import { MAIN, type VertexEdit } from "./mirror-material.js";
import { Mirrors, StagedMesh } from "./staged-mesh.js";

const BONES = "#include <skinbase_vertex>";

/** Whatever three blends of four bones of one motion, with weights that sum to 1, is that motion. */
const BLEND = `
${BONES}
#ifdef USE_SKINNING
boneMatX = dynaskinRigid(boneMatX, boneMatY, boneMatZ, boneMatW, skinWeight);
boneMatY = boneMatX;
boneMatZ = boneMatX;
boneMatW = boneMatX;
#endif
`;

const EDIT: VertexEdit = {
  key: "dynaskin-dual-quaternion",
  needs: BONES,
  refusal: 'skinning "dual-quaternion" cannot be added',
  otherwise: 'Set avatar.skinning to "linear", or give the mesh a standard material of three.js.',
  otherRenderer:
    'Skinning "dual-quaternion" is for WebGLRenderer: other renderers compile materials by themselves. ' +
    'Set avatar.skinning to "linear".',
  uniforms: {},
  apply(shader) {
    const declared = shader.replace(MAIN, (main) => `${DUAL_QUATERNIONS}\n${main}`);
    return declared.replace(BONES, BLEND);
  },
};

/** Has the materials of a mesh blend dual quaternions, until `detach`. */
export function blendDualQuaternions(mesh: SkinnedMesh): { detach(): void } {
  const mirrors = new Mirrors(EDIT);
  const staged = new StagedMesh(mesh, mirrors);
  return {
    detach: () => {
      staged.detach();
      mirrors.dispose();
    },
  };
}
