/**
 * dynaskin in three.js: soft tissue that follows bones. {@link DynaSkin} moves the bodies of dynaskin's
 * models, {@link bindAvatar} and {@link AvatarTissue} any other avatar. Works with `WebGLRenderer` and
 * `WebGPURenderer`.
 *
 * @module
 */
import {
  type Bone,
  type Box3,
  BufferAttribute,
  type BufferGeometry,
  Matrix4,
  type Object3D,
  Quaternion,
  Skeleton,
  type SkinnedMesh,
  Sphere,
  Vector3,
} from "three";
import type { CardSeat } from "../adapter/card.js";
import { type EngineRig, SkinDriver } from "../adapter/driver.js";
import { checkAligned, findBones, type RigOptions, type TissueSource } from "../adapter/rig.js";
import type { MeshSkin } from "../adapter/vertex-map.js";
import type { Undecoded } from "../decoding.js";
import { DynaSkinError } from "../error.js";
import { JOINT_NAMES, type Pose } from "../pose.js";
import { type CardSurface, cardOf, DrawWatch, type ThreeCard, type Uploaded } from "./card.js";
import { blendDualQuaternions } from "./dual-quaternion.js";
import { PreviousPositions } from "./motion-vectors.js";
import { USAGE, withAttributes } from "./own-geometry.js";
import { four, vectorsOf } from "./read-avatar.js";

export type { SkinDriver } from "../adapter/driver.js";
export type { RemoteAvatar, RigOptions, TissueSource } from "../adapter/rig.js";
export { Binding, type BindingReport } from "../bind/binding.js";
export type { SpringBones } from "../bind/springs.js";
export type { TissueDriver, TissueOptions } from "../bind/tissue.js";
export type { ThreadOptions, TrustedScriptAddress } from "../worker/start.js";
export { AvatarTissue, type BindOptions, bindAvatar } from "./avatar-tissue.js";
export { previousPositions, type ShadingLanguage } from "./motion-vectors.js";
export type { HumanoidSource } from "./read-avatar.js";

const position = new Vector3();
const scale = new Vector3();
const quaternion = new Quaternion();
const matrix = new Matrix4();

/**
 * Moves the soft tissue of a `SkinnedMesh` that was loaded from the avatar's `body.glb`.
 *
 * The mesh gets its own geometry and skeleton (with the same bones), so that the offsets are added before
 * skinning: every material, the shadow pass, raycasting and bounds use the same surface. The distances
 * between bones follow the avatar's shape.
 *
 * ```ts
 * const skin = new DynaSkin(avatar, gltf.scene);
 * function frame(deltaSeconds: number) {
 *   mixer.update(deltaSeconds);
 *   skin.update(deltaSeconds); // after everything that moves bones
 *   renderer.render(scene, camera);
 * }
 * ```
 */
export class DynaSkin extends SkinDriver<SkinnedMesh> {
  /**
   * @param avatar - an avatar of the mesh's model, in this thread or in a worker
   * @param object - the mesh of the same model's `body.glb`, or an object that contains it, such as the
   *   `scene` that `GLTFLoader` returns
   * @throws DynaSkinError `argument` if `object` contains no or several skinned meshes, bones are missing,
   *   vertices do not fit, the bones' rest frames are not aligned with the model's axes, or another DynaSkin
   *   moves the mesh; the mesh is then unchanged
   */
  constructor(avatar: TissueSource, object: Object3D, options: RigOptions = {}) {
    const mesh = skinnedMeshOf(object);
    super(avatar, mesh, options, () => new ThreeRig(mesh, options));
  }
}

/** The skinned mesh that is meant: a group that was loaded from body.glb holds one. */
function skinnedMeshOf(object: Object3D): SkinnedMesh {
  if ((object as SkinnedMesh | null)?.isSkinnedMesh) return object as SkinnedMesh;
  const found: SkinnedMesh[] = [];
  object?.traverse?.((part) => {
    if ((part as SkinnedMesh).isSkinnedMesh) found.push(part as SkinnedMesh);
  });
  const [mesh] = found;
  if (mesh && found.length === 1) return mesh;
  const names = found.map(({ name }) => JSON.stringify(name)).join(", ");
  throw new DynaSkinError(
    "argument",
    mesh
      ? `DynaSkin moves one SkinnedMesh; here are ${found.length}: ${names}. Give the one that is the body.`
      : "DynaSkin needs a SkinnedMesh with a skeleton, or a group that holds one.",
  );
}

/** A mesh of three.js, its bones, and what it was before. */
class ThreeRig implements EngineRig {
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  readonly bindPelvisM: readonly [number, number, number];
  readonly #mesh: SkinnedMesh;
  readonly #bones: Bone[];
  readonly #attributes: Uploaded;
  readonly #geometry: BufferGeometry;
  readonly #skeleton: Skeleton;
  readonly #bounds = new Sphere();
  readonly #bonePositions: Vector3[];
  #restore = () => {};
  #reachM = 0;
  #dualQuaternions: { detach(): void } | null = null;
  readonly #previous: PreviousPositions | null;
  /** Says which renderer draws the mesh, from when a card is first wanted on. */
  #draws: DrawWatch | null = null;
  /** That renderer; null before it has drawn. */
  #renderer: unknown = null;
  /** Whether others draw the mesh too: buffers are those of one context. */
  #isShared = false;
  #card: ThreeCard | null = null;
  /** What the card writes, and whether the mesh is drawn from it. */
  #surface: CardSurface | null = null;
  #isOnCard = false;

  constructor(mesh: SkinnedMesh, { boneNames, motionVectors = false }: RigOptions) {
    if (!mesh.skeleton) {
      throw new DynaSkinError("argument", "DynaSkin needs a SkinnedMesh with a skeleton.");
    }
    const { geometry, skeleton, bindMatrix } = mesh;
    const nNumbers = 3 * geometry.getAttribute("position").count;
    this.#mesh = mesh;
    this.#bones = findBones((name) => skeleton.getBoneByName(name), boneNames);
    checkRestFrames(this.#bones, skeleton, bindMatrix);
    this.bindPelvisM = bindPosition(this.#bones[0], skeleton, bindMatrix);
    this.#bonePositions = this.#bones.map((bone) => bone.position.clone());
    this.positions = new Float32Array(nNumbers);
    this.normals = new Float32Array(nNumbers);
    const uploaded = (numbers: Float32Array) => new BufferAttribute(numbers, 3).setUsage(USAGE);
    this.#attributes = { position: uploaded(this.positions), normal: uploaded(this.normals) };
    // The shape's morph targets are left out: the avatar's positions have the shape already.
    this.#geometry = withAttributes(geometry, new Map(Object.entries(this.#attributes)));
    this.#previous = motionVectors ? new PreviousPositions(this.#attributes.position) : null;
    this.#previous?.attach(this.#geometry);
    this.#skeleton = new Skeleton(
      skeleton.bones,
      skeleton.boneInverses.map((inverse) => inverse.clone()),
    );
  }

  restFromPelvisM(): Float32Array {
    const { geometry, skeleton, bindMatrix } = this.#mesh;
    bindMatrixOf(this.#bones[0], skeleton, bindMatrix).decompose(position, quaternion, scale);
    return vectorsOf(geometry.getAttribute("position")).map((number, idx) => {
      const axis = idx % 3;
      return (number - position.getComponent(axis)) / scale.getComponent(axis);
    });
  }

  skin(): MeshSkin {
    const { geometry, skeleton, bindMatrix } = this.#mesh;
    const { position: place, skinIndex, skinWeight } = geometry.attributes;
    const jointOf = skeleton.bones.map((bone) => this.#bones.indexOf(bone));
    const jointFromMesh = this.#bones.flatMap((bone) => {
      const inverse = skeleton.boneInverses[skeleton.bones.indexOf(bone)];
      return inverse ? matrix.multiplyMatrices(inverse, bindMatrix).toArray() : [];
    });
    const bones = four(skinIndex, place?.count ?? 0);
    return {
      positions: place ? vectorsOf(place) : new Float32Array(0),
      joints: Int16Array.from(bones, (bone) => jointOf[bone] ?? -1),
      weights: four(skinWeight, place?.count ?? 0),
      jointFromMesh: Float64Array.from(jointFromMesh),
    };
  }

  attach(): void {
    const mesh = this.#mesh;
    const { geometry, skeleton, boundingSphere, boundingBox } = mesh;
    const bindMatrix = mesh.bindMatrix.clone();
    this.#restore = () => {
      mesh.geometry = geometry;
      mesh.bind(skeleton, bindMatrix);
      mesh.boundingSphere = boundingSphere;
      mesh.boundingBox = boundingBox;
    };
    mesh.geometry = this.#geometry;
    mesh.bind(this.#skeleton, new Matrix4());
    mesh.boundingSphere = this.#bounds;
    // three takes null for none; raycasting would otherwise ask a box of another pose.
    (mesh as { boundingBox: Box3 | null }).boundingBox = null;
    this.upload();
  }

  detach(): void {
    this.#draws?.release();
    this.#drawUploaded();
    this.#surface?.free();
    this.#restore();
    for (const [joint, bone] of this.#bones.entries()) {
      bone.position.copy(this.#bonePositions[joint] ?? bone.position);
    }
    this.#geometry.dispose();
    this.#skeleton.dispose();
  }

  bindJoint(joint: number, x: number, y: number, z: number): void {
    const { bones, boneInverses } = this.#skeleton;
    boneInverses[bones.indexOf(this.#bone(joint))]?.makeTranslation(-x, -y, -z);
  }

  setReach(reachM: number, pelvisRestM: Float32Array): void {
    this.#reachM = reachM;
    this.#geometry.boundingSphere = new Sphere(new Vector3().fromArray(pelvisRestM), reachM);
  }

  movePelvis(x: number, y: number, z: number): void {
    this.#bone(0).position.add(position.set(x, y, z));
  }

  placeJoint(joint: number, x: number, y: number, z: number): void {
    this.#bone(joint).position.set(x, y, z);
  }

  turnJoint(joint: number, pose: Pose, at: number): void {
    this.#bone(joint).quaternion.fromArray(pose, at);
  }

  readPelvis(pose: Pose): void {
    const pelvis = this.#bone(0);
    pelvis.updateWorldMatrix(true, false);
    pelvis.matrixWorld.decompose(position, quaternion, scale);
    const worldScale = Math.cbrt(Math.abs(pelvis.matrixWorld.determinant())) || 1;
    for (let axis = 0; axis < 3; axis += 1) pose[axis] = position.getComponent(axis) / worldScale;
    quaternion.normalize().toArray(pose, 3);
    this.#mesh.updateWorldMatrix(true, false);
    this.#bounds.center.copy(position);
    this.#bounds.radius = this.#reachM * worldScale;
    this.#bounds.applyMatrix4(matrix.copy(this.#mesh.matrixWorld).invert());
  }

  readTurn(joint: number, pose: Pose, at: number): void {
    quaternion.copy(this.#bone(joint).quaternion).normalize().toArray(pose, at);
  }

  upload(): void {
    this.#drawUploaded();
    for (const attribute of Object.values(this.#attributes)) attribute.needsUpdate = true;
  }

  seat(
    undecoded: Undecoded,
    vertexOf: Uint32Array<ArrayBuffer>,
    refresh: () => void,
  ): CardSeat | null {
    if (!this.#draws) this.#draws = new DrawWatch(this.#mesh, (by) => this.#beforeDrawing(by));
    this.#draws.follow();
    if (this.#surface?.isLost) {
      this.#drawUploaded();
      this.#surface = null;
    }
    this.#card = this.#isShared ? null : cardOf(this.#renderer);
    if (!this.#card) return null;
    this.#surface ??= this.#card.surface(undecoded, {
      uploaded: this.#attributes,
      previous: this.#previous,
      vertexOf,
      refresh,
    });
    if (this.#surface && !this.#isOnCard) {
      this.#surface.attach(this.#geometry);
      this.#isOnCard = true;
    }
    return this.#surface;
  }

  blendDualQuaternions(on: boolean): void {
    // Each gives back the functions of the mesh that it found.
    this.#draws?.release();
    this.#dualQuaternions?.detach();
    this.#dualQuaternions = on ? blendDualQuaternions(this.#mesh) : null;
    this.#draws?.follow();
  }

  #beforeDrawing(renderer: unknown): void {
    this.#renderer ??= renderer;
    this.#isShared ||= renderer !== this.#renderer;
    this.#card?.flush();
  }

  /** Draws from what is uploaded. */
  #drawUploaded(): void {
    if (!this.#isOnCard) return;
    this.#isOnCard = false;
    this.#surface?.overwrite();
    this.#surface?.detach(this.#geometry);
  }

  #bone(joint: number): Bone {
    return this.#bones[joint] as Bone;
  }
}

function bindMatrixOf(bone: Bone | undefined, skeleton: Skeleton, bindMatrix: Matrix4): Matrix4 {
  const inverse = bone && skeleton.boneInverses[skeleton.bones.indexOf(bone)];
  if (!inverse) throw new DynaSkinError("argument", "A bone has no inverse bind matrix.");
  return matrix.copy(bindMatrix).invert().multiply(inverse.clone().invert());
}

/** In metres: quantised files keep the size of their units in the inverse bind matrices. */
function bindPosition(
  bone: Bone | undefined,
  skeleton: Skeleton,
  bindMatrix: Matrix4,
): [number, number, number] {
  bindMatrixOf(bone, skeleton, bindMatrix).decompose(position, quaternion, scale);
  return position.divide(scale).toArray();
}

function checkRestFrames(bones: Bone[], skeleton: Skeleton, bindMatrix: Matrix4): void {
  for (const [joint, bone] of bones.entries()) {
    bindMatrixOf(bone, skeleton, bindMatrix).decompose(position, quaternion, scale);
    const name = JOINT_NAMES[joint];
    if (name) checkAligned(name, quaternion.angleTo(new Quaternion()));
  }
}
