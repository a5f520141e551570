// One body of three.js that carries both: dynaskin's skin, and spring bones on the same skeleton.
// Runs in Node and in a page.
import { VRMSpringBoneJoint, VRMSpringBoneManager } from "@pixiv/three-vrm-springbone";
import { load } from "dynaskin";
import { DynaSkin } from "dynaskin/three";
import { Bone, Scene, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

/** From a spring bone's root, inside the body, to its tip at the skin. */
export const BONE_LENGTH_M = 0.08;

/** Default of three-vrm-springbone, and what VRM files commonly have. */
export const DRAG = 0.4;

/** The regions that get spring bones, the bone that carries them, and where their tips point. */
const GROUPS = [
  { region: "chest", parent: "spine3", forward: 1 },
  { region: "buttocks", parent: "pelvis", forward: -1 },
];

/** Vertices whose mean is a tip: the outermost of the region's side. */
const TIP_VERTICES = 20;

/** Reads a file beside the page or on the disk. */
async function readFile(url) {
  if (!url.startsWith("file:")) return (await fetch(url)).arrayBuffer();
  const { readFile: read } = await import("node:fs/promises");
  const { buffer, byteOffset, length } = await read(new URL(url));
  return buffer.slice(byteOffset, byteOffset + length);
}

/** Loads the model and its mesh once; figures are made of them. */
export async function loadFigures(modelUrl) {
  const model = await load({ model: modelUrl });
  const glb = await readFile(new URL("body.glb", modelUrl).href);
  return {
    softCount: model.bundle.vertices.length,
    createFigure: (stiffness) => createFigure(model, glb, stiffness),
  };
}

/**
 * @param stiffness - of the springs per region, in three-vrm-springbone's unit (metres per second
 *   towards the rest direction)
 */
async function createFigure(model, glb, stiffness) {
  const { scene: body } = await new GLTFLoader().parseAsync(glb.slice(0), "");
  const scene = new Scene().add(body);
  const mesh = scene.getObjectByProperty("isSkinnedMesh", true);
  const avatar = model.createAvatar();
  const skin = new DynaSkin(avatar, mesh);
  const regionVertices = softVertices(model);
  const tips = GROUPS.flatMap(({ region, parent, forward }) =>
    [1, -1].map((side) => ({
      region,
      bone: mesh.skeleton.getBoneByName(parent),
      tipM: tipOf(avatar.positions, regionVertices.get(region), side, forward),
      forward,
    })),
  );
  const manager = new VRMSpringBoneManager();
  scene.updateMatrixWorld(true);
  const springs = tips.map((tip) => addSpring(manager, tip, stiffness[tip.region]));
  return {
    avatar,
    springs,
    vertices: [...new Set([...regionVertices.values()].flat())],
    regionVertices,
    /** Moves the skeleton, not yet what hangs on it. */
    pose(pose) {
      skin.writePose(pose);
      scene.updateMatrixWorld(true);
    },
    stepTissue: (dtSeconds) => skin.update(dtSeconds),
    stepSprings: (dtSeconds) => manager.update(dtSeconds),
    /** Springs at rest in the present pose. */
    settleSprings: () => manager.reset(),
    dispose() {
      skin.dispose();
      avatar.dispose();
    },
  };
}

/** Vertices that belong to a region by more than half. */
function softVertices({ body }) {
  return new Map(
    GROUPS.map(({ region }) => {
      const weights = body.regionWeights(region);
      const indices = [...weights.keys()].filter((vertex) => weights[vertex] > 0.5);
      return [region, indices];
    }),
  );
}

function tipOf(positionsM, vertices, side, forward) {
  const outermost = vertices
    .filter((vertex) => positionsM[vertex * 3] * side > 0)
    .sort((a, b) => (positionsM[b * 3 + 2] - positionsM[a * 3 + 2]) * forward)
    .slice(0, TIP_VERTICES);
  const sum = new Vector3();
  for (const vertex of outermost) sum.add(new Vector3().fromArray(positionsM, vertex * 3));
  return sum.divideScalar(outermost.length);
}

/** A bone from inside the body to the tip, and its spring. The rest pose must be set. */
function addSpring(manager, { region, bone: parent, tipM, forward }, stiffness) {
  const bone = new Bone();
  bone.position.copy(parent.worldToLocal(tipM.clone())).z -= BONE_LENGTH_M * forward;
  const child = new Bone();
  child.position.z = BONE_LENGTH_M * forward;
  parent.add(bone.add(child));
  parent.updateWorldMatrix(true, true);
  bone.updateMatrix();
  const joint = new VRMSpringBoneJoint(bone, child, { stiffness, dragForce: DRAG });
  manager.addJoint(joint);
  joint.setInitState();
  const rest = parent.worldToLocal(tipM.clone());
  const now = new Vector3();
  return {
    region,
    /** How far the tip is from its place at rest, in its parent's frame, metres. */
    offsetM: () => parent.worldToLocal(child.getWorldPosition(now)).sub(rest),
  };
}
