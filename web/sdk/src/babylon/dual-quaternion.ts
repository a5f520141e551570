// Dual-quaternion skinning by the vertex stage of Babylon's standard materials.

import type { Material } from "@babylonjs/core/Materials/material.js";
import type { AbstractMesh } from "@babylonjs/core/Meshes/abstractMesh.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { bonesVertex } from "@babylonjs/core/Shaders/ShadersInclude/bonesVertex.js";
import { DUAL_QUATERNIONS } from "../adapter/dual-quaternion.js";
import { DynaSkinError } from "../error.js";
import {
  checkMesh,
  PluggedMeshes,
  type PluginKind,
  type Refusal,
  ShapingPlugin,
} from "./shared-plugin.js";

const PLUGIN = "dynaskin-dual-quaternion";
const DEFINE = "DYNASKIN_DUAL_QUATERNION";
/** Bones of a vertex; more would be left out. */
const MOST_BONES = 4;

/** Where Babylon's shaders take over the mean of the bones' matrices. */
const MEAN = "finalWorld=finalWorld*influence;";

const REFUSAL: Refusal = {
  what: 'skinning "dual-quaternion" cannot be added',
  otherwise:
    'Set avatar.skinning to "linear", or give the mesh a StandardMaterial or a PBRMaterial.',
  otherEngine:
    'Skinning "dual-quaternion" is for Babylon\'s engine with WebGL 2, and this is another one. ' +
    'Set avatar.skinning to "linear".',
};

const KIND: PluginKind = {
  name: PLUGIN,
  make: (material) => new DualQuaternionPlugin(material),
  refusal: REFUSAL,
};

/** Meshes that blend dual quaternions. */
const staged = new WeakSet<AbstractMesh>();

/**
 * Has the materials of a mesh blend dual quaternions, until `detach`.
 *
 * @throws DynaSkinError `argument` where they cannot; nothing has changed then
 */
export function blendDualQuaternions(mesh: Mesh): { detach(): void } {
  check(mesh);
  const plugged = new PluggedMeshes(KIND);
  staged.add(mesh);
  plugged.add(mesh);
  return {
    detach: () => {
      staged.delete(mesh);
      plugged.dispose();
    },
  };
}

function check(mesh: Mesh): void {
  checkMesh(mesh, REFUSAL);
  const why = !bonesVertex.shader.includes(MEAN)
    ? "this version of Babylon.js skins in another way"
    : !mesh.computeBonesUsingShaders
      ? "the mesh is skinned on the CPU (computeBonesUsingShaders is false)"
      : mesh.numBoneInfluencers > MOST_BONES
        ? `the mesh has ${mesh.numBoneInfluencers} bones a vertex, more than ${MOST_BONES}`
        : null;
  if (why === null) return;
  throw new DynaSkinError(
    "argument",
    `Skinning "dual-quaternion" cannot be added: ${why}. Set avatar.skinning to "linear".`,
  );
}

/** Blends dual quaternions in a material, on meshes that want it. */
class DualQuaternionPlugin extends ShapingPlugin {
  constructor(material: Material) {
    super(material, PLUGIN, [DEFINE]);
  }

  override getClassName(): string {
    return "DynaSkinDualQuaternionPlugin";
  }

  protected override definesOf(mesh: AbstractMesh): Record<string, boolean> {
    return { [DEFINE]: staged.has(mesh) };
  }

  override getCustomCode(shaderType: string): Record<string, string> | null {
    return shaderType === "vertex" ? VERTEX_CODE : null;
  }
}

const SLOTS = [0, 1, 2, 3];

/** Statements, one a bone: Babylon's inlining of functions takes no more than a call in each. */
const bones = (matrix: (slot: number) => string) =>
  SLOTS.map((slot) => `mat4 dynaskinBone${slot}=${matrix(slot)};`).join("\n");

/** Babylon takes a key that begins with `!` for a regular expression. */
const VERTEX_CODE = {
  CUSTOM_VERTEX_DEFINITIONS: `#ifdef ${DEFINE}\n${DUAL_QUATERNIONS}\n#endif`,
  [`!${MEAN.replace("*", "\\*")}`]: `
#ifdef ${DEFINE}
#ifdef BONETEXTURE
${bones((slot) => `readMatrixFromRawSampler(boneSampler,matricesIndices[${slot}])`)}
#else
${bones((slot) => `mBones[int(matricesIndices[${slot}])]`)}
#endif
finalWorld=finalWorld*dynaskinRigid(${SLOTS.map((slot) => `dynaskinBone${slot}`).join(",")},matricesWeights);
#else
${MEAN}
#endif
`,
};
