/**
 * dynaskin in Babylon.js: soft tissue that follows bones. {@link DynaSkin} moves the bodies of
 * dynaskin's models, {@link bindAvatar} and {@link AvatarTissue} any other avatar. Works with the WebGL and
 * the WebGPU engine, in left- and right-handed scenes.
 *
 * @module
 */
export type { SkinDriver } from "../adapter/driver.js";
export type { RemoteAvatar, RigOptions, TissueSource } from "../adapter/rig.js";
export { Binding, type BindingReport } from "../bind/binding.js";
export type { SpringBones } from "../bind/springs.js";
export type { TissueDriver, TissueOptions } from "../bind/tissue.js";
export type { ThreadOptions, TrustedScriptAddress } from "../worker/start.js";
export { AvatarTissue, type BindOptions, bindAvatar } from "./avatar-tissue.js";
export type { Humanoid } from "./read-avatar.js";

import type { Bone } from "@babylonjs/core/Bones/bone.js";
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { BoundingInfo } from "@babylonjs/core/Culling/boundingInfo.js";
import { Matrix, Quaternion, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import type { Geometry } from "@babylonjs/core/Meshes/geometry.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import type { CardSeat } from "../adapter/card.js";
import { type EngineRig, SkinDriver } from "../adapter/driver.js";
import { checkAligned, findBones, type RigOptions, type TissueSource } from "../adapter/rig.js";
import type { MeshSkin } from "../adapter/vertex-map.js";
import type { Undecoded } from "../decoding.js";
import { DynaSkinError } from "../error.js";
import { JOINT_NAMES, type Pose } from "../pose.js";
import { type BabylonCard, cardOf } from "./card.js";
import { blendDualQuaternions } from "./dual-quaternion.js";
import { keepPositions, type LastPicture, plugMotionVectors } from "./motion-vectors.js";
import { withSurface } from "./own-geometry.js";
import { vectorsOf } from "./read-avatar.js";
import type { PluggedMeshes } from "./shared-plugin.js";

/** A bone and the node of the scene that moves it. */
interface Joint {
  bone: Bone;
  node: TransformNode;
}

const scale = new Vector3();
const position = new Vector3();
const rotation = new Quaternion();
const identity = Quaternion.Identity();
const eulerRotation = new Quaternion();
const matrix = new Matrix();
const MIRROR_Z = Matrix.Scaling(1, 1, -1);

/**
 * Moves the soft tissue of a skinned `Mesh` that was loaded from the avatar's `body.glb`.
 *
 * The offsets are added before skinning: every material and the shadow pass use the same surface. The
 * distances between bones follow the avatar's shape. No other mesh may use the skeleton.
 *
 * ```ts
 * const skin = new DynaSkin(avatar, mesh);
 * scene.onBeforeRenderObservable.add(() => {
 *   skin.update(engine.getDeltaTime() / 1000); // seconds; animations have moved the bones by then
 * });
 * ```
 */
export class DynaSkin extends SkinDriver<Mesh> {
  /**
   * @param avatar - an avatar of the mesh's model, in this thread or in a worker
   * @param mesh - the mesh of that model's `body.glb`, as Babylon's glTF loader returns it
   * @throws DynaSkinError `argument` if bones are missing, vertices do not fit, the skeleton is
   *   shared, the bones' rest frames are not aligned with the model's axes, or another DynaSkin moves
   *   the mesh; the mesh is then unchanged
   */
  constructor(avatar: TissueSource, mesh: Mesh, options: RigOptions = {}) {
    super(avatar, mesh, options, () => new BabylonRig(mesh, options));
  }
}

/** A mesh of Babylon.js, its bones, and what it was before. */
class BabylonRig implements EngineRig {
  readonly positions: Float32Array<ArrayBuffer>;
  readonly normals: Float32Array<ArrayBuffer>;
  readonly bindPelvisM: readonly [number, number, number];
  readonly #mesh: Mesh;
  readonly #joints: Joint[];
  readonly #nodePositions: Vector3[];
  readonly #minimum = new Vector3();
  readonly #maximum = new Vector3();
  readonly #hasMotionVectors: boolean;
  #geometry: Geometry;
  #previous: LastPicture | null = null;
  #plugged: PluggedMeshes | null = null;
  #restore = () => {};
  #reachM = 0;
  #dualQuaternions: { detach(): void } | null = null;
  /** What decodes in the engine's context, from when it is first wanted on. */
  #card: BabylonCard | null = null;
  #seat: CardSeat | null = null;
  #drawing: { remove(): void } | null = null;
  /** The frame that is being drawn. */
  #frame = -1;

  constructor(mesh: Mesh, { boneNames, motionVectors = false }: RigOptions) {
    const geometry = mesh?.geometry;
    if (!geometry || !mesh.skeleton) {
      throw new DynaSkinError("argument", "DynaSkin needs a mesh with a geometry and a skeleton.");
    }
    this.#mesh = mesh;
    this.#geometry = geometry;
    this.#hasMotionVectors = motionVectors;
    this.#joints = findJoints(mesh, boneNames);
    this.#nodePositions = this.#joints.map(({ node }) => node.position.clone());
    this.bindPelvisM = bindPositionM(this.#joint(0).bone).asArray() as [number, number, number];
    this.positions = new Float32Array(mesh.getTotalVertices() * 3);
    this.normals = new Float32Array(mesh.getTotalVertices() * 3);
  }

  restFromPelvisM(): Float32Array {
    const pelvisM = bindPositionM(this.#joint(0).bone).asArray();
    const perM = scale.asArray();
    return vectorsOf(this.#mesh, VertexBuffer.PositionKind).map(
      (number, idx) => number / (perM[idx % 3] ?? 1) - (pelvisM[idx % 3] ?? 0),
    );
  }

  skin(): MeshSkin {
    const mesh = this.#mesh;
    const bones = this.#joints.map(({ bone }) => bone.getIndex());
    const inverses = this.#joints.map(({ bone }) => bone.getAbsoluteInverseBindMatrix().asArray());
    return {
      positions: vectorsOf(mesh, VertexBuffer.PositionKind),
      joints: Int16Array.from(vectorsOf(mesh, VertexBuffer.MatricesIndicesKind), (bone) =>
        bones.indexOf(bone),
      ),
      weights: vectorsOf(mesh, VertexBuffer.MatricesWeightsKind),
      jointFromMesh: Float64Array.from(inverses.flatMap((inverse) => [...inverse])),
    };
  }

  attach(): void {
    const mesh = this.#mesh;
    const geometry = this.#geometry;
    const { morphTargetManager } = mesh;
    const boundingInfo = mesh.getBoundingInfo();
    const inverseBinds = this.#joints.map(({ bone }) =>
      bone.getAbsoluteInverseBindMatrix().clone(),
    );
    this.#restore = () => {
      for (const [joint, inverse] of inverseBinds.entries()) {
        this.#joint(joint).bone.getAbsoluteInverseBindMatrix().copyFrom(inverse);
      }
      if (mesh.isDisposed()) return;
      geometry.applyToMesh(mesh);
      mesh.morphTargetManager = morphTargetManager;
      mesh.setBoundingInfo(boundingInfo);
    };
    this.#geometry = withSurface(geometry, this.positions, this.normals);
    if (this.#hasMotionVectors) {
      this.#previous = keepPositions(this.#geometry, this.positions, mesh.getScene());
    }
    this.#geometry.applyToMesh(mesh);
    if (this.#hasMotionVectors) this.#plugged = plugMotionVectors([mesh]);
    // The avatar's positions have the shape already.
    mesh.morphTargetManager = null;
    mesh.setBoundingInfo(new BoundingInfo(new Vector3(), new Vector3()));
  }

  detach(): void {
    this.#drawing?.remove();
    this.#seat?.free();
    this.#restore();
    this.#plugged?.dispose();
    this.#previous?.dispose();
    for (const [joint, before] of this.#nodePositions.entries()) {
      this.#joint(joint).node.position.copyFrom(before);
    }
    this.#geometry.dispose();
  }

  bindJoint(joint: number, x: number, y: number, z: number): void {
    Matrix.TranslationToRef(-x, -y, -z, this.#joint(joint).bone.getAbsoluteInverseBindMatrix());
  }

  setReach(reachM: number): void {
    this.#reachM = reachM;
  }

  movePelvis(x: number, y: number, z: number): void {
    this.#joint(0).node.position.addInPlaceFromFloats(x, y, z);
  }

  placeJoint(joint: number, x: number, y: number, z: number): void {
    this.#joint(joint).node.position.set(x, y, z);
  }

  turnJoint(joint: number, pose: Pose, at: number): void {
    const { node } = this.#joint(joint);
    node.rotationQuaternion ??= new Quaternion();
    Quaternion.FromArrayToRef(pose, at, node.rotationQuaternion);
  }

  readPelvis(pose: Pose): void {
    const { node: pelvis } = this.#joint(0);
    const world = this.#mesh.computeWorldMatrix(true);
    const worldScale = turnRightHanded(world);
    Vector3.TransformCoordinatesToRef(pelvis.position, world, position);
    // The loader turns glTF's handedness by mirroring z; mirrored back, the motion is the model's.
    if (world.determinant() < 0) position.z = -position.z;
    pose[0] = position.x / worldScale;
    pose[1] = position.y / worldScale;
    pose[2] = position.z / worldScale;
    writeTurn(rotation.multiplyInPlace(localRotation(pelvis)), pose, 3);
    const reach = scale.setAll(this.#reachM);
    pelvis.position.subtractToRef(reach, this.#minimum);
    pelvis.position.addToRef(reach, this.#maximum);
    this.#mesh.getBoundingInfo().reConstruct(this.#minimum, this.#maximum, world);
  }

  readTurn(joint: number, pose: Pose, at: number): void {
    writeTurn(rotation.copyFrom(localRotation(this.#joint(joint).node)), pose, at);
  }

  upload(): void {
    // First what keeps the positions that were drawn.
    this.#previous?.follow(this.positions);
    this.#seat?.overwrite();
    this.#geometry.updateVerticesData(VertexBuffer.PositionKind, this.positions, false);
    this.#geometry.updateVerticesData(VertexBuffer.NormalKind, this.normals, false);
  }

  seat(undecoded: Undecoded, vertexOf: Uint32Array<ArrayBuffer>): CardSeat | null {
    if (this.#seat && !this.#seat.isLost) return this.#seat;
    // Before shadows and other textures, and again before each camera's picture.
    this.#drawing ??= this.#mesh
      .getScene()
      .onBeforeRenderTargetsRenderObservable.add(() => this.#beforeDrawing());
    this.#card = cardOf(this.#mesh.getEngine());
    const isShown = this.#previous?.isShown ?? true;
    const mesh = { geometry: this.#geometry, uploaded: this.positions, vertexOf, isShown };
    this.#seat = this.#card?.seat(undecoded, mesh) ?? null;
    return this.#seat;
  }

  #beforeDrawing(): void {
    this.#card?.flush();
    const frame = this.#mesh.getScene().getFrameId();
    if (frame === this.#frame) return;
    this.#frame = frame;
    this.#seat?.beginFrame();
  }

  blendDualQuaternions(on: boolean): void {
    this.#dualQuaternions?.detach();
    this.#dualQuaternions = on ? blendDualQuaternions(this.#mesh) : null;
  }

  #joint(joint: number): Joint {
    return this.#joints[joint] as Joint;
  }
}

/** Writes the rotation of a matrix to `rotation`, z mirrored if need be; returns its scale. */
function turnRightHanded(world: Matrix): number {
  const determinant = world.determinant();
  matrix.copyFrom(world);
  if (determinant < 0) matrix.multiplyToRef(MIRROR_Z, matrix);
  matrix.decompose(scale, rotation, position);
  return Math.cbrt(Math.abs(determinant)) || 1;
}

/** Writes a rotation into a pose, at unit length. */
function writeTurn(turn: Quaternion, pose: Pose, at: number): void {
  const { x, y, z, w } = turn.normalize();
  pose[at] = x;
  pose[at + 1] = y;
  pose[at + 2] = z;
  pose[at + 3] = w;
}

function localRotation(node: TransformNode): Quaternion {
  if (node.rotationQuaternion) return node.rotationQuaternion;
  return Quaternion.FromEulerVectorToRef(node.rotation, eulerRotation);
}

function findJoints(mesh: Mesh, names: RigOptions["boneNames"]): Joint[] {
  const { skeleton } = mesh;
  const bones = findBones((name) => skeleton?.bones.find((bone) => bone.name === name), names);
  if (mesh.getScene().meshes.some((other) => other !== mesh && other.skeleton === skeleton)) {
    throw new DynaSkinError(
      "argument",
      "Other meshes use the same skeleton, which follows the avatar's shape; " +
        "give this mesh a skeleton of its own.",
    );
  }
  return bones.map((bone, joint) => {
    const name = JOINT_NAMES[joint] ?? "pelvis";
    const node = bone.getTransformNode();
    if (!node) {
      throw new DynaSkinError("argument", `The bone for ${name} has no node that moves it.`);
    }
    if (joint === 0 && bone.getParent()) {
      throw new DynaSkinError("argument", "The bone for pelvis must be the skeleton's root.");
    }
    bindPositionM(bone);
    checkAligned(name, 2 * Math.acos(Math.min(1, Math.abs(Quaternion.Dot(rotation, identity)))));
    return { bone, node };
  });
}

/**
 * Where a bone is at rest, in metres: quantised files keep the size of their units in the inverse
 * bind matrices. Leaves its rotation in `rotation`.
 */
function bindPositionM(bone: Bone): Vector3 {
  bone.getAbsoluteInverseBindMatrix().clone().invert().decompose(scale, rotation, position);
  return position.divide(scale);
}
