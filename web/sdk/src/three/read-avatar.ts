// Reads an avatar of three.js into arrays, for binding.
import {
  type BufferAttribute,
  type InterleavedBufferAttribute,
  type Material,
  Matrix4,
  type Object3D,
  type Skeleton,
  type SkinnedMesh,
} from "three";
import { type AvatarMesh, type AvatarNode, type AvatarParts, unskinned } from "../bind/parts.js";
import { DynaSkinError } from "../error.js";
import { plainMaterial } from "./mirror-material.js";

/** What is asked of three-vrm's `VRM`: the bones that it calls a person's. */
export interface HumanoidSource {
  humanoid: {
    readonly humanBones: { readonly [name: string]: { readonly node: Object3D } | undefined };
  } | null;
}

/** An attribute of a geometry. */
export type Attribute = BufferAttribute | InterleavedBufferAttribute;

/** The normalised bones that three-vrm adds beside the file's own. */
const NORMALISED_BONES = "VRMHumanoidRig";

/** Refuses what is no object of three.js. */
export function checkRoot(root: unknown): asserts root is Object3D {
  if ((root as Object3D | null)?.isObject3D) return;
  throw new DynaSkinError(
    "argument",
    "The avatar must be an Object3D, such as the scene that GLTFLoader gives.",
  );
}

/** The skinned meshes under an object. */
export function skinnedMeshes(root: Object3D): SkinnedMesh[] {
  const meshes: SkinnedMesh[] = [];
  root.traverse((object) => {
    const mesh = object as SkinnedMesh;
    if (mesh.isSkinnedMesh && mesh.skeleton && mesh.geometry.getAttribute("position")) {
      meshes.push(mesh);
    }
  });
  return meshes;
}

/** A node's name as its file has it: loaders drop letters that three.js does not like. */
export function nameOf({ name, userData }: Object3D): string {
  const own: unknown = userData.name ?? userData.originalName;
  return typeof own === "string" ? own : name;
}

/** The materials of a mesh, as they are without tissue. */
export function materialsOf({ material }: SkinnedMesh): Material[] {
  return (Array.isArray(material) ? material : [material]).map(plainMaterial);
}

/** Numbers of an attribute as they are meant, three a vertex, or what it has if that is less. */
export function vectorsOf(attribute: Attribute): Float32Array {
  const { array, count, itemSize } = attribute;
  const isPlain = "isBufferAttribute" in attribute && itemSize === 3;
  if (isPlain && array instanceof Float32Array) return array.slice(0, 3 * count);
  const vectors = new Float32Array(3 * count);
  for (let idx = 0; idx < count; idx += 1) {
    vectors[3 * idx] = attribute.getX(idx);
    vectors[3 * idx + 1] = attribute.getY(idx);
    vectors[3 * idx + 2] = attribute.getZ(idx);
  }
  return vectors;
}

/**
 * Reads the nodes and skinned meshes under `root`, in the root's space.
 *
 * @throws DynaSkinError `avatar` where no mesh is skinned, and for a skin whose bones lie outside of `root`
 */
export function readAvatar(root: Object3D, vrm: HumanoidSource | undefined): AvatarParts {
  const meshes = skinnedMeshes(root);
  if (meshes.length === 0) throw unskinned(meshCount(root));
  root.updateWorldMatrix(true, true);
  const toRoot = root.matrixWorld.clone().invert();
  const humanoid = humanoidOf(vrm);
  const nodes: AvatarNode[] = [];
  const places = new Map<Object3D, number>();
  const add = (object: Object3D, parent: number | undefined) => {
    if (object.name === NORMALISED_BONES) return;
    const place = nodes.length;
    const matrix = new Matrix4().multiplyMatrices(toRoot, object.matrixWorld);
    const name = humanoid.get(object);
    places.set(object, place);
    nodes.push({
      ...{ name: nameOf(object), matrix: Float64Array.from(matrix.elements) },
      ...(name !== undefined && { humanoid: name }),
      ...(parent !== undefined && { parent }),
    });
    for (const child of object.children) add(child, place);
  };
  add(root, undefined);
  return { nodes, meshes: meshes.map((mesh) => readMesh(mesh, places)) };
}

function meshCount(root: Object3D): number {
  let count = 0;
  root.traverse((object) => {
    if ((object as SkinnedMesh).isMesh) count += 1;
  });
  return count;
}

function humanoidOf(vrm: HumanoidSource | undefined): Map<Object3D, string> {
  const names = new Map<Object3D, string>();
  for (const [name, bone] of Object.entries(vrm?.humanoid?.humanBones ?? {})) {
    if (bone?.node) names.set(bone.node, name);
  }
  return names;
}

function readMesh(mesh: SkinnedMesh, places: Map<Object3D, number>): AvatarMesh {
  const { geometry, skeleton } = mesh;
  const positions = vectorsOf(geometry.getAttribute("position"));
  const count = positions.length / 3;
  return {
    name: mesh.name,
    material: materialsOf(mesh)[0]?.name ?? "",
    positions,
    skinJoints: Uint16Array.from(four(geometry.getAttribute("skinIndex"), count)),
    skinWeights: four(geometry.getAttribute("skinWeight"), count),
    indices: geometry.index
      ? Uint32Array.from(geometry.index.array)
      : Uint32Array.from({ length: count }, (_, idx) => idx),
    joints: jointsOf(mesh, skeleton, places),
    inverseBinds: inverseBinds(mesh, skeleton),
  };
}

/** Four numbers a vertex; none where the attribute is missing, which the core refuses for skins. */
export function four(attribute: Attribute | undefined, count: number): Float32Array {
  if (!attribute) return new Float32Array(0);
  const numbers = new Float32Array(4 * count);
  for (let idx = 0; idx < count; idx += 1) {
    numbers[4 * idx] = attribute.getX(idx);
    numbers[4 * idx + 1] = attribute.getY(idx);
    numbers[4 * idx + 2] = attribute.getZ(idx);
    numbers[4 * idx + 3] = attribute.getW(idx);
  }
  return numbers;
}

function jointsOf(mesh: SkinnedMesh, { bones }: Skeleton, places: Map<Object3D, number>) {
  return Uint32Array.from(bones, (bone) => {
    const place = places.get(bone);
    if (place !== undefined) return place;
    throw new DynaSkinError(
      "avatar",
      `The bone ${nameOf(bone)} of the mesh ${mesh.name} is not under the object that was given: ` +
        "give the one that has both meshes and skeleton in it.",
    );
  });
}

/** From the space of the mesh's vertices, whatever matrix it was bound with. */
function inverseBinds({ bindMatrix }: SkinnedMesh, { boneInverses }: Skeleton): Float64Array {
  const numbers = new Float64Array(16 * boneInverses.length);
  const matrix = new Matrix4();
  for (const [joint, inverse] of boneInverses.entries()) {
    numbers.set(matrix.multiplyMatrices(inverse, bindMatrix).elements, 16 * joint);
  }
  return numbers;
}
