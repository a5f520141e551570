/**
 * dynaskin in Babylon.js: a skinned mesh whose soft tissue follows its bones. Works with the WebGL
 * and the WebGPU engine, in left- and right-handed scenes.
 *
 * @module
 */
export type { RemoteAvatar, RigOptions, TissueSource } from "../adapter/rig.js";

import type { Bone } from "@babylonjs/core/Bones/bone.js";
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { BoundingInfo } from "@babylonjs/core/Culling/boundingInfo.js";
import { Matrix, Quaternion, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import type { Geometry } from "@babylonjs/core/Meshes/geometry.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import {
  checkAligned,
  checkSource,
  checkVertices,
  claimMesh,
  copyVertices,
  findBones,
  type RigOptions,
  reachM,
  releaseMesh,
  restJointsOf,
  restOffsetM,
  ShapeWatch,
  type TissueSource,
} from "../adapter/rig.js";
import { DynaSkinError } from "../error.js";
import { checkLength, JOINT_NAMES, POSE_LENGTH, type Pose } from "../pose.js";

/** What the mesh was before, for {@link DynaSkin.dispose}. */
interface Original {
  geometry: Geometry;
  morphTargetManager: Mesh["morphTargetManager"];
  boundingInfo: BoundingInfo;
  inverseBinds: Matrix[];
  nodePositions: Vector3[];
}

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
 * The offsets go in before skinning: every material and the shadow pass see the same surface. The
 * bones' distances follow the avatar's shape. The skeleton must serve this mesh alone.
 *
 * ```ts
 * const skin = new DynaSkin(avatar, mesh);
 * scene.onBeforeRenderObservable.add(() => {
 *   skin.update(engine.getDeltaTime() / 1000); // seconds; animations have moved the bones by then
 * });
 * ```
 */
export class DynaSkin {
  /** The avatar that was handed in. It stays the caller's: dispose of it after this. */
  readonly avatar: TissueSource;
  /** The mesh that was handed in. */
  readonly mesh: Mesh;
  /** The pose that was read at the last update; in a left-handed scene, with z mirrored. */
  readonly pose: Pose = new Float64Array(POSE_LENGTH);
  readonly #joints: Joint[];
  readonly #vertexMap: RigOptions["vertexMap"];
  readonly #shapeWatch: ShapeWatch;
  readonly #geometry: Geometry;
  readonly #positions: Float32Array;
  readonly #normals: Float32Array;
  #original: Original | null;
  #jointsM: Float32Array;
  /** Of each joint against its parent at rest, metres. */
  readonly #restOffsets = JOINT_NAMES.map(() => new Vector3());
  #reachM = 0;
  readonly #minimum = new Vector3();
  readonly #maximum = new Vector3();

  /**
   * @param avatar - an avatar of the mesh's model, here or in a worker
   * @param mesh - the mesh of that model's `body.glb`, as Babylon's glTF loader gives it
   * @throws DynaSkinError `argument` if bones are missing, vertices do not fit, the skeleton is
   *   shared, the bones' rest frames are not aligned with the model's axes, or another DynaSkin moves
   *   the mesh; the mesh is then unchanged
   */
  constructor(avatar: TissueSource, mesh: Mesh, options: RigOptions = {}) {
    const geometry = mesh?.geometry;
    if (!geometry || !mesh.skeleton) {
      throw new DynaSkinError("argument", "DynaSkin needs a mesh with a geometry and a skeleton.");
    }
    checkSource(avatar, options);
    const nVertices = mesh.getTotalVertices();
    checkVertices(nVertices, avatar.positions.length / 3, options.vertexMap);
    this.#joints = findJoints(mesh, options.boneNames);
    this.avatar = avatar;
    this.mesh = mesh;
    this.#vertexMap = options.vertexMap;
    this.#positions = new Float32Array(nVertices * 3);
    this.#normals = new Float32Array(nVertices * 3);
    this.#shapeWatch = new ShapeWatch(avatar);
    this.#jointsM = restJointsOf(avatar);
    const { morphTargetManager } = mesh;
    this.#original = {
      geometry,
      morphTargetManager,
      boundingInfo: mesh.getBoundingInfo(),
      inverseBinds: this.#joints.map(({ bone }) => bone.getAbsoluteInverseBindMatrix().clone()),
      nodePositions: this.#joints.map(({ node }) => node.position.clone()),
    };
    claimMesh(mesh);
    this.#geometry = geometry.copy(`${geometry.id} dynaskin`);
    this.#copySurface();
    this.#geometry.setVerticesData(VertexBuffer.PositionKind, this.#positions, true, 3);
    this.#geometry.setVerticesData(VertexBuffer.NormalKind, this.#normals, true, 3);
    this.#geometry.applyToMesh(mesh);
    // The avatar's positions have the shape already.
    mesh.morphTargetManager = null;
    const pelvis = this.#joints[0];
    if (pelvis) this.#movePelvis(bindPositionM(pelvis.bone));
    this.#fitSkeleton();
    mesh.setBoundingInfo(new BoundingInfo(new Vector3(), new Vector3()));
    this.#readPose();
  }

  /**
   * Reads the bones, moves the tissue and hands the surface to the mesh. Call it once a frame after
   * everything that moves bones, before rendering.
   *
   * @param deltaSeconds - time since the last call in seconds (Babylon's `getDeltaTime` gives
   *   milliseconds); less than 0 counts as 0
   * @throws DynaSkinError `disposed`, or what `Avatar.step` throws; the mesh then keeps its surface
   */
  update(deltaSeconds: number): void {
    this.avatar.step(this.readPose(), Math.max(0, deltaSeconds));
    this.show();
  }

  /**
   * Reads the bones without moving the tissue, for pages that step avatars by themselves, such as many
   * by one call. Then step the avatar to {@link DynaSkin.pose}, and {@link DynaSkin.show} it;
   * {@link DynaSkin.update} is all three.
   *
   * @returns {@link DynaSkin.pose}
   * @throws DynaSkinError `disposed`
   */
  readPose(): Pose {
    this.#assertAlive();
    this.#followShape();
    this.#placeNodes();
    this.#readPose();
    return this.pose;
  }

  /**
   * Hands the avatar's present surface to the mesh; see {@link DynaSkin.readPose}.
   *
   * @throws DynaSkinError `disposed`
   */
  show(): void {
    this.#assertAlive();
    this.#copySurface();
    this.#geometry.updateVerticesData(VertexBuffer.PositionKind, this.#positions, false);
    this.#geometry.updateVerticesData(VertexBuffer.NormalKind, this.#normals, false);
  }

  /**
   * Poses the bones as a dynaskin pose says, for motions that come from `Motion.poseAt` instead of
   * an `AnimationGroup`. The pose counts from where the mesh is.
   *
   * @throws DynaSkinError `argument` for a wrong length, `disposed`
   */
  writePose(pose: Pose): void {
    this.#assertAlive();
    checkLength("pose", pose, POSE_LENGTH);
    this.#followShape();
    for (const [joint, { node }] of this.#joints.entries()) {
      node.rotationQuaternion ??= new Quaternion();
      Quaternion.FromArrayToRef(pose, 3 + joint * 4, node.rotationQuaternion);
    }
    const [x = 0, y = 0, z = 0] = this.#jointsM;
    const [px = 0, py = 0, pz = 0] = pose;
    this.#joints[0]?.node.position.set(x + px, y + py, z + pz);
  }

  /**
   * Gives the mesh back its geometry, morph targets and bounds, and its skeleton its distances. The
   * avatar is not disposed of. May be called again.
   */
  dispose(): void {
    const original = this.#original;
    if (!original) return;
    this.#original = null;
    releaseMesh(this.mesh);
    for (const [joint, { bone, node }] of this.#joints.entries()) {
      const inverse = original.inverseBinds[joint];
      const before = original.nodePositions[joint];
      if (inverse) bone.getAbsoluteInverseBindMatrix().copyFrom(inverse);
      if (before) node.position.copyFrom(before);
    }
    if (!this.mesh.isDisposed()) {
      original.geometry.applyToMesh(this.mesh);
      this.mesh.morphTargetManager = original.morphTargetManager;
      this.mesh.setBoundingInfo(original.boundingInfo);
    }
    this.#geometry.dispose();
  }

  #assertAlive(): void {
    if (this.#original) return;
    throw new DynaSkinError("disposed", "This DynaSkin was used after dispose().");
  }

  #followShape(): void {
    if (!this.#shapeWatch.changed()) return;
    const before = Vector3.FromArray(this.#jointsM);
    this.#jointsM = restJointsOf(this.avatar);
    this.#movePelvis(before);
    this.#fitSkeleton();
  }

  /** Keeps the feet where they are when the pelvis of another shape is higher or lower. */
  #movePelvis(beforeM: Vector3): void {
    const [x = 0, y = 0, z = 0] = this.#jointsM;
    this.#joints[0]?.node.position.addInPlaceFromFloats(x, y, z).subtractInPlace(beforeM);
  }

  /** Distances, inverse bind matrices and reach for the present shape. */
  #fitSkeleton(): void {
    for (const [joint, { bone }] of this.#joints.entries()) {
      const [x = 0, y = 0, z = 0] = this.#jointsM.subarray(joint * 3, joint * 3 + 3);
      Matrix.TranslationToRef(-x, -y, -z, bone.getAbsoluteInverseBindMatrix());
      this.#restOffsets[joint]?.set(...restOffsetM(this.#jointsM, joint));
    }
    this.#placeNodes();
    this.#reachM = reachM(this.avatar.positions, this.#jointsM);
  }

  /** A clip that was made for another shape moves the joints apart; the shape's distances hold. */
  #placeNodes(): void {
    for (let joint = 1; joint < this.#joints.length; joint += 1) {
      this.#joints[joint]?.node.position.copyFrom(this.#restOffsets[joint] ?? position);
    }
  }

  /**
   * How large the body is, the scene says. Its lengths are brought to those that the avatar reckons
   * in, so a giant's tissue moves as if it were its own size.
   */
  #readPose(): void {
    const world = this.mesh.computeWorldMatrix(true);
    const pelvis = (this.#joints[0] as Joint).node;
    const worldScale = turnRightHanded(world);
    const { scale: avatarScale } = this.avatar;
    Vector3.TransformCoordinatesToRef(pelvis.position, world, position);
    // The loader turns glTF's handedness by mirroring z; mirrored back, the motion is the model's.
    if (world.determinant() < 0) position.z = -position.z;
    const [jointX = 0, jointY = 0, jointZ = 0] = this.#jointsM;
    this.pose[0] = (position.x / worldScale - jointX) * avatarScale;
    this.pose[1] = (position.y / worldScale - jointY) * avatarScale;
    this.pose[2] = (position.z / worldScale - jointZ) * avatarScale;
    writeTurn(rotation.multiplyInPlace(localRotation(pelvis)), this.pose, 0);
    for (let joint = 1; joint < this.#joints.length; joint += 1) {
      const { node } = this.#joints[joint] as Joint;
      writeTurn(rotation.copyFrom(localRotation(node)), this.pose, joint);
    }
    const reach = scale.setAll(this.#reachM);
    pelvis.position.subtractToRef(reach, this.#minimum);
    pelvis.position.addToRef(reach, this.#maximum);
    this.mesh.getBoundingInfo().reConstruct(this.#minimum, this.#maximum, world);
  }

  #copySurface(): void {
    copyVertices(this.avatar.positions, this.#positions, this.#vertexMap);
    copyVertices(this.avatar.normals, this.#normals, this.#vertexMap);
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

/** Writes a joint's rotation into a pose, at unit length. */
function writeTurn(turn: Quaternion, pose: Pose, joint: number): void {
  const { x, y, z, w } = turn.normalize();
  const at = 3 + joint * 4;
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
