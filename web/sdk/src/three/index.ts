/**
 * dynaskin in three.js: a skinned mesh whose soft tissue follows its bones. Works with
 * `WebGLRenderer` and `WebGPURenderer`.
 *
 * @module
 */
import {
  type Bone,
  type Box3,
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  Matrix4,
  Quaternion,
  Skeleton,
  type SkinnedMesh,
  Sphere,
  Vector3,
} from "three";
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

export type { RemoteAvatar, RigOptions, TissueSource } from "../adapter/rig.js";

/** What the mesh was before, for {@link DynaSkin.dispose}. */
interface Original {
  geometry: BufferGeometry;
  skeleton: Skeleton;
  bindMatrix: Matrix4;
  boundingSphere: SkinnedMesh["boundingSphere"];
  boundingBox: SkinnedMesh["boundingBox"];
  bonePositions: Vector3[];
}

const position = new Vector3();
const scale = new Vector3();
const quaternion = new Quaternion();
const matrix = new Matrix4();

/**
 * Moves the soft tissue of a `SkinnedMesh` that was loaded from the avatar's `body.glb`.
 *
 * The mesh gets a geometry and a skeleton of its own (same bones), so that the offsets go in before
 * skinning: every material, the shadow pass, raycasting and bounds see the same surface. The bones'
 * distances follow the avatar's shape.
 *
 * ```ts
 * const skin = new DynaSkin(avatar, mesh);
 * function frame(deltaSeconds: number) {
 *   mixer.update(deltaSeconds);
 *   skin.update(deltaSeconds); // after everything that moves bones
 *   renderer.render(scene, camera);
 * }
 * ```
 */
export class DynaSkin {
  /** The avatar that was handed in. It stays the caller's: dispose of it after this. */
  readonly avatar: TissueSource;
  /** The mesh that was handed in. */
  readonly mesh: SkinnedMesh;
  /** The pose that was read at the last update. */
  readonly pose: Pose = new Float64Array(POSE_LENGTH);
  readonly #bones: Bone[];
  readonly #vertexMap: RigOptions["vertexMap"];
  readonly #shapeWatch: ShapeWatch;
  readonly #geometry: BufferGeometry;
  readonly #skeleton: Skeleton;
  readonly #positions: BufferAttribute;
  readonly #normals: BufferAttribute;
  readonly #bounds = new Sphere();
  #original: Original | null;
  #jointsM: Float32Array;
  /** Of each joint against its parent at rest, metres. */
  readonly #restOffsets = JOINT_NAMES.map(() => new Vector3());
  #reachM = 0;

  /**
   * @param avatar - an avatar of the mesh's model, here or in a worker
   * @param mesh - the mesh of the same model's `body.glb`, as `GLTFLoader` gives it
   * @throws DynaSkinError `argument` if bones are missing, vertices do not fit, the bones' rest
   *   frames are not aligned with the model's axes, or another DynaSkin moves the mesh; the mesh is
   *   then unchanged
   */
  constructor(avatar: TissueSource, mesh: SkinnedMesh, options: RigOptions = {}) {
    if (!mesh?.isSkinnedMesh || !mesh.skeleton) {
      throw new DynaSkinError("argument", "DynaSkin needs a SkinnedMesh with a skeleton.");
    }
    checkSource(avatar, options);
    const { geometry, skeleton, bindMatrix, boundingSphere, boundingBox } = mesh;
    const nVertices = geometry.getAttribute("position").count;
    checkVertices(nVertices, avatar.positions.length / 3, options.vertexMap);
    this.#bones = findBones((name) => skeleton.getBoneByName(name), options.boneNames);
    checkRestFrames(this.#bones, skeleton, bindMatrix);
    this.avatar = avatar;
    this.mesh = mesh;
    this.#vertexMap = options.vertexMap;
    this.#positions = dynamicAttribute(nVertices);
    this.#normals = dynamicAttribute(nVertices);
    this.#geometry = withOwnSurface(geometry, this.#positions, this.#normals);
    this.#skeleton = new Skeleton(
      skeleton.bones,
      skeleton.boneInverses.map((inverse) => inverse.clone()),
    );
    this.#shapeWatch = new ShapeWatch(avatar);
    this.#jointsM = restJointsOf(avatar);
    this.#original = {
      geometry,
      skeleton,
      boundingSphere,
      boundingBox,
      bindMatrix: bindMatrix.clone(),
      bonePositions: this.#bones.map((bone) => bone.position.clone()),
    };
    claimMesh(mesh);
    this.#movePelvis(bindPosition(this.#bones[0], skeleton, bindMatrix));
    this.#fitSkeleton();
    this.#writeSurface();
    mesh.geometry = this.#geometry;
    mesh.bind(this.#skeleton, new Matrix4());
    mesh.boundingSphere = this.#bounds;
    // three takes null for none; raycasting would otherwise ask a box of another pose.
    (mesh as { boundingBox: Box3 | null }).boundingBox = null;
    this.#readPose();
  }

  /**
   * Reads the bones, moves the tissue and hands the surface to the mesh. Call it once a frame after
   * everything that moves bones, before rendering.
   *
   * @param deltaSeconds - time since the last call in seconds (not milliseconds); less than 0, as
   *   three's `Timer` gives for its first frame, counts as 0
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
    this.#placeBones();
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
    this.#writeSurface();
  }

  /**
   * Poses the bones as a dynaskin pose says, for motions that come from `Motion.poseAt` instead of
   * an `AnimationMixer`. The pose counts from where the skeleton's parent is.
   *
   * @throws DynaSkinError `argument` for a wrong length, `disposed`
   */
  writePose(pose: Pose): void {
    this.#assertAlive();
    checkLength("pose", pose, POSE_LENGTH);
    this.#followShape();
    for (const [joint, bone] of this.#bones.entries()) {
      bone.quaternion.fromArray(pose, 3 + joint * 4);
    }
    this.#bones[0]?.position.fromArray(this.#jointsM).add(position.fromArray(pose, 0));
  }

  /**
   * Gives the mesh back its geometry, skeleton and bounds, and its bones their distances. The
   * avatar is not disposed of. May be called again.
   */
  dispose(): void {
    const original = this.#original;
    if (!original) return;
    this.#original = null;
    releaseMesh(this.mesh);
    this.mesh.geometry = original.geometry;
    this.mesh.bind(original.skeleton, original.bindMatrix);
    this.mesh.boundingSphere = original.boundingSphere;
    this.mesh.boundingBox = original.boundingBox;
    for (const [joint, bone] of this.#bones.entries()) {
      const before = original.bonePositions[joint];
      if (before) bone.position.copy(before);
    }
    this.#geometry.dispose();
    this.#skeleton.dispose();
  }

  #assertAlive(): void {
    if (this.#original) return;
    throw new DynaSkinError("disposed", "This DynaSkin was used after dispose().");
  }

  #followShape(): void {
    if (!this.#shapeWatch.changed()) return;
    const before = new Vector3().fromArray(this.#jointsM);
    this.#jointsM = restJointsOf(this.avatar);
    this.#movePelvis(before);
    this.#fitSkeleton();
  }

  /** Keeps the feet where they are when the pelvis of another shape is higher or lower. */
  #movePelvis(previousRestM: Vector3): void {
    this.#bones[0]?.position.add(position.fromArray(this.#jointsM)).sub(previousRestM);
  }

  /** Distances, inverse bind matrices and bounds for the present shape. */
  #fitSkeleton(): void {
    const joints = this.#jointsM;
    for (const [joint, bone] of this.#bones.entries()) {
      const inverse = this.#skeleton.boneInverses[this.#skeleton.bones.indexOf(bone)];
      const [x = 0, y = 0, z = 0] = joints.subarray(joint * 3, joint * 3 + 3);
      inverse?.makeTranslation(-x, -y, -z);
      this.#restOffsets[joint]?.set(...restOffsetM(joints, joint));
    }
    this.#placeBones();
    this.#reachM = reachM(this.avatar.positions, joints);
    const [x = 0, y = 0, z = 0] = joints;
    this.#geometry.boundingSphere = new Sphere(new Vector3(x, y, z), this.#reachM);
  }

  /** A clip that was made for another shape moves the joints apart; the shape's distances hold. */
  #placeBones(): void {
    for (let joint = 1; joint < this.#bones.length; joint += 1) {
      this.#bones[joint]?.position.copy(this.#restOffsets[joint] ?? position);
    }
  }

  /**
   * How large the body is, the scene says. Its lengths are brought to those that the avatar reckons
   * in, so a giant's tissue moves as if it were its own size.
   */
  #readPose(): void {
    const pelvis = this.#bones[0] as Bone;
    pelvis.updateWorldMatrix(true, false);
    pelvis.matrixWorld.decompose(position, quaternion, scale);
    const worldScale = Math.cbrt(Math.abs(pelvis.matrixWorld.determinant())) || 1;
    const { scale: avatarScale } = this.avatar;
    for (let axis = 0; axis < 3; axis += 1) {
      const bodyM = position.getComponent(axis) / worldScale - (this.#jointsM[axis] ?? 0);
      this.pose[axis] = bodyM * avatarScale;
    }
    quaternion.normalize().toArray(this.pose, 3);
    for (let joint = 1; joint < this.#bones.length; joint += 1) {
      const bone = this.#bones[joint] as Bone;
      quaternion
        .copy(bone.quaternion)
        .normalize()
        .toArray(this.pose, 3 + joint * 4);
    }
    this.mesh.updateWorldMatrix(true, false);
    this.#bounds.center.copy(position);
    this.#bounds.radius = this.#reachM * worldScale;
    this.#bounds.applyMatrix4(matrix.copy(this.mesh.matrixWorld).invert());
  }

  #writeSurface(): void {
    copyVertices(this.avatar.positions, this.#positions.array as Float32Array, this.#vertexMap);
    copyVertices(this.avatar.normals, this.#normals.array as Float32Array, this.#vertexMap);
    this.#positions.needsUpdate = true;
    this.#normals.needsUpdate = true;
  }
}

function dynamicAttribute(nVertices: number): BufferAttribute {
  return new BufferAttribute(new Float32Array(nVertices * 3), 3).setUsage(DynamicDrawUsage);
}

/** The geometry with other positions and normals; everything else is shared with `source`. */
function withOwnSurface(
  source: BufferGeometry,
  positions: BufferAttribute,
  normals: BufferAttribute,
): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.name = source.name;
  geometry.userData = source.userData;
  geometry.setIndex(source.index);
  for (const [name, attribute] of Object.entries(source.attributes)) {
    geometry.setAttribute(name, attribute);
  }
  geometry.setAttribute("position", positions);
  geometry.setAttribute("normal", normals);
  for (const { start, count, materialIndex } of source.groups) {
    geometry.addGroup(start, count, materialIndex);
  }
  geometry.setDrawRange(source.drawRange.start, source.drawRange.count);
  // The shape's morph targets are left out: the avatar's positions have the shape already.
  return geometry;
}

function bindMatrixOf(bone: Bone | undefined, skeleton: Skeleton, bindMatrix: Matrix4): Matrix4 {
  const inverse = bone && skeleton.boneInverses[skeleton.bones.indexOf(bone)];
  if (!inverse) throw new DynaSkinError("argument", "A bone has no inverse bind matrix.");
  return matrix.copy(bindMatrix).invert().multiply(inverse.clone().invert());
}

/** In metres: quantised files keep the size of their units in the inverse bind matrices. */
function bindPosition(bone: Bone | undefined, skeleton: Skeleton, bindMatrix: Matrix4): Vector3 {
  bindMatrixOf(bone, skeleton, bindMatrix).decompose(position, quaternion, scale);
  return new Vector3().copy(position).divide(scale);
}

function checkRestFrames(bones: Bone[], skeleton: Skeleton, bindMatrix: Matrix4): void {
  for (const [joint, bone] of bones.entries()) {
    bindMatrixOf(bone, skeleton, bindMatrix).decompose(position, quaternion, scale);
    const name = JOINT_NAMES[joint];
    if (name) checkAligned(name, quaternion.angleTo(new Quaternion()));
  }
}
