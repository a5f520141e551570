// What every engine's adapter does alike. An engine adds the functions of `EngineRig`.
import type { Undecoded } from "../decoding.js";
import { DynaSkinError } from "../error.js";
import { checkLength, JOINT_NAMES, POSE_LENGTH, type Pose } from "../pose.js";
import { isDualQuaternion } from "../skinning.js";
import type { CardSeat, MaybeUndecoded } from "./card.js";
import {
  checkPlaces,
  checkSource,
  checkVertices,
  claimMesh,
  copyVertices,
  type RigOptions,
  reachM,
  releaseMesh,
  restOffsetM,
  type TissueSource,
} from "./rig.js";
import { findVertexMap, type MeshSkin } from "./vertex-map.js";

/**
 * A skinned mesh as its engine has it: what a {@link SkinDriver} asks an engine to do. Joints are
 * counted as in `JOINT_NAMES`; none of the functions called in a frame may allocate.
 *
 * @internal
 */
export interface EngineRig {
  /** Positions that {@link upload} hands to the engine, `[vertex of the mesh][x, y, z]`, metres. */
  readonly positions: Float32Array;
  /** Normals, likewise. */
  readonly normals: Float32Array;
  /** Where the file has the pelvis at rest, metres. */
  readonly bindPelvisM: readonly [number, number, number];
  /** Rest positions of the mesh as it was given, from the pelvis, `[vertex][x, y, z]`, metres. */
  restFromPelvisM(): Float32Array;
  /** How the mesh as it was given follows the joints. */
  skin(): MeshSkin;
  /** Shows {@link positions} and {@link normals} from now on. Changes the mesh for the first time. */
  attach(): void;
  /** Gives the mesh back what it had. */
  detach(): void;
  /** Says where a joint is at rest: its inverse bind matrix is a translation. */
  bindJoint(joint: number, x: number, y: number, z: number): void;
  /** Takes over how far from the pelvis the surface may reach. */
  setReach(reachM: number, pelvisRestM: Float32Array): void;
  /** Moves the pelvis by this much. */
  movePelvis(x: number, y: number, z: number): void;
  /** Puts a joint there, in its parent's frame. */
  placeJoint(joint: number, x: number, y: number, z: number): void;
  /** Turns a joint as the quaternion at `pose[at]` says. */
  turnJoint(joint: number, pose: Pose, at: number): void;
  /**
   * Writes place and rotation of the pelvis into a pose, in the model's axes and in the body's own
   * size, and moves the bounds there.
   */
  readPelvis(pose: Pose): void;
  /** Writes the rotation of another joint at `pose[at]`, at unit length. */
  readTurn(joint: number, pose: Pose, at: number): void;
  /** Hands positions and normals to the engine. */
  upload(): void;
  /**
   * Has the graphics card write positions and normals from now on, until the next {@link upload}: a place among
   * those that it decodes. Null where it cannot, or where it is not known yet which card draws.
   *
   * @param vertexOf - the body's vertex for each of the mesh
   * @param refresh - brings {@link positions} and {@link normals} up to date, for whoever reads them
   */
  seat(
    undecoded: Undecoded,
    vertexOf: Uint32Array<ArrayBuffer>,
    refresh: () => void,
  ): CardSeat | null;
  /**
   * Has the engine blend dual quaternions, or skin as it does by itself, as it does at first.
   *
   * @throws DynaSkinError `argument` where the engine cannot; nothing has changed then
   */
  blendDualQuaternions(on: boolean): void;
}

/** Where the rotation of a joint begins in a pose. */
const turnAt = (joint: number) => 3 + joint * 4;

/** Moves the soft tissue of a skinned mesh of any engine: reads its pose, shows the surface. */
export abstract class SkinDriver<Mesh extends object> {
  /** The avatar passed to the constructor. It stays yours: dispose of it after this object. */
  readonly avatar: TissueSource;
  /** The mesh passed to the constructor. */
  readonly mesh: Mesh;
  /** The pose read at the last update; in a left-handed scene with z mirrored. */
  readonly pose: Pose = new Float64Array(POSE_LENGTH);
  readonly #vertexMap: RigOptions["vertexMap"];
  /** Of each joint against its parent at rest, metres. */
  readonly #restOffsetsM = new Float64Array(3 * JOINT_NAMES.length);
  #rig: EngineRig | null;
  #jointsM: Float32Array;
  /** Of the shape that the skeleton fits. */
  #revision: number;
  #isDual = false;
  /** What the card decodes for; null while the CPU does. */
  #seat: CardSeat | null = null;
  #vertexOf: Uint32Array<ArrayBuffer> | null = null;
  /** Whether the arrays of the rig are older than what is shown. */
  #isBehind = false;

  /** @internal */
  constructor(avatar: TissueSource, mesh: Mesh, options: RigOptions, rigOf: () => EngineRig) {
    checkSource(avatar, options);
    const rig = rigOf();
    const meshM = rig.restFromPelvisM();
    const vertexMap = options.vertexMap ?? findVertexMap(meshM, avatar, () => rig.skin());
    checkVertices(rig.positions.length / 3, avatar.positions.length / 3, vertexMap);
    this.avatar = avatar;
    this.mesh = mesh;
    this.#vertexMap = vertexMap;
    this.#jointsM = avatar.restJointsM();
    checkPlaces(meshM, avatar, this.#jointsM, vertexMap);
    this.#revision = avatar.revision;
    claimMesh(mesh);
    this.#rig = rig;
    this.#copySurface(rig);
    rig.attach();
    try {
      this.#followSkinning(rig);
    } catch (error) {
      this.dispose();
      throw error;
    }
    this.#fitSkeleton(rig, rig.bindPelvisM);
    this.#readPose(rig);
  }

  /**
   * Reads the bones, moves the tissue and updates the mesh's surface. Call it once per frame after
   * everything that moves bones, before rendering.
   *
   * @param deltaSeconds - time since the last call in seconds (three's `Timer` gives seconds,
   *   Babylon's `getDeltaTime` milliseconds); less than 0, as `Timer` gives for its first frame,
   *   counts as 0
   * @throws DynaSkinError `disposed`, `argument` for an `avatar.skinning` that the engine cannot do, or what
   *   `Avatar.step` throws; the mesh then keeps its surface
   */
  update(deltaSeconds: number): void {
    this.avatar.step(this.readPose(), Math.max(0, deltaSeconds));
    this.show();
  }

  /**
   * Reads the bones without moving the tissue, for pages that step avatars themselves, for example many
   * in one call. Then step the avatar to {@link pose}, and {@link show} it; {@link update} does all
   * three.
   *
   * @returns {@link pose}
   * @throws DynaSkinError `disposed`; `argument` for an `avatar.skinning` that the engine cannot do
   */
  readPose(): Pose {
    const rig = this.#alive;
    this.#followSkinning(rig);
    this.#followShape(rig);
    this.#placeJoints(rig);
    this.#readPose(rig);
    return this.pose;
  }

  /**
   * Updates the mesh with the avatar's present surface; see {@link readPose}.
   *
   * @throws DynaSkinError `disposed`; `argument` for an `avatar.skinning` that the engine cannot do
   */
  show(): void {
    const rig = this.#alive;
    this.#followSkinning(rig);
    if (this.#leaveToCard(rig)) return;
    this.#copySurface(rig);
    rig.upload();
  }

  /**
   * Whether the engine's graphics card decodes the surface that is shown: with the `decoding` `card` of the avatar
   * or of its crowd. False where the CPU does, such as before the engine has drawn the mesh for the first time.
   */
  get isDecodedOnCard(): boolean {
    return this.#seat !== null && !this.#seat.isLost;
  }

  #leaveToCard(rig: EngineRig): boolean {
    const { undecoded = null } = this.avatar as MaybeUndecoded;
    this.#seat = undecoded && rig.seat(undecoded, this.#vertices(rig), this.#refresh);
    if (!undecoded || !this.#seat) return false;
    this.#seat.take(undecoded);
    this.#isBehind = true;
    return true;
  }

  #vertices(rig: EngineRig): Uint32Array<ArrayBuffer> {
    const same = { length: rig.positions.length / 3 };
    this.#vertexOf ??= this.#vertexMap
      ? Uint32Array.from(this.#vertexMap)
      : Uint32Array.from(same, (_, vertex) => vertex);
    return this.#vertexOf;
  }

  readonly #refresh = (): void => {
    if (!this.#isBehind || !this.#rig) return;
    this.#isBehind = false;
    this.#copySurface(this.#rig);
  };

  /**
   * Poses the bones by a dynaskin pose, for motions that come from `Motion.poseAt` instead of
   * the engine's own animations. The pose is relative to the skeleton's parent.
   *
   * @throws DynaSkinError `argument` for a wrong length, `disposed`
   */
  writePose(pose: Pose): void {
    const rig = this.#alive;
    checkLength("pose", pose, POSE_LENGTH);
    this.#followShape(rig);
    for (let joint = 0; joint < JOINT_NAMES.length; joint += 1) {
      rig.turnJoint(joint, pose, turnAt(joint));
    }
    const [x = 0, y = 0, z = 0] = this.#jointsM;
    const [px = 0, py = 0, pz = 0] = pose;
    rig.placeJoint(0, x + px, y + py, z + pz);
  }

  /**
   * Restores the mesh's surface, bounds and skeleton. It does not dispose of the avatar. May be called
   * again.
   */
  dispose(): void {
    const rig = this.#rig;
    if (!rig) return;
    this.#rig = null;
    this.#seat = null;
    releaseMesh(this.mesh);
    if (this.#isDual) rig.blendDualQuaternions(false);
    rig.detach();
  }

  get #alive(): EngineRig {
    if (this.#rig) return this.#rig;
    throw new DynaSkinError("disposed", "This DynaSkin was used after dispose().");
  }

  #followSkinning(rig: EngineRig): void {
    const isDual = isDualQuaternion(this.avatar.skinning ?? "linear");
    if (isDual === this.#isDual) return;
    rig.blendDualQuaternions(isDual);
    this.#isDual = isDual;
  }

  #followShape(rig: EngineRig): void {
    const { revision } = this.avatar;
    if (revision === this.#revision) return;
    this.#revision = revision;
    const before = this.#jointsM;
    this.#jointsM = this.avatar.restJointsM();
    this.#fitSkeleton(rig, before);
  }

  /**
   * Distances, inverse bind matrices and bounds for the present shape. The feet stay where they are
   * when its pelvis is higher or lower than it was.
   */
  #fitSkeleton(rig: EngineRig, pelvisBeforeM: ArrayLike<number>): void {
    const joints = this.#jointsM;
    const moved = (axis: number) => (joints[axis] ?? 0) - (pelvisBeforeM[axis] ?? 0);
    rig.movePelvis(moved(0), moved(1), moved(2));
    for (let joint = 0; joint < JOINT_NAMES.length; joint += 1) {
      const [x = 0, y = 0, z = 0] = joints.subarray(joint * 3, joint * 3 + 3);
      rig.bindJoint(joint, x, y, z);
      this.#restOffsetsM.set(restOffsetM(joints, joint), joint * 3);
    }
    this.#placeJoints(rig);
    rig.setReach(reachM(this.avatar.positions, joints), joints);
  }

  /** A clip that was made for another shape moves the joints apart; the shape's distances hold. */
  #placeJoints(rig: EngineRig): void {
    const offsets = this.#restOffsetsM;
    for (let joint = 1; joint < JOINT_NAMES.length; joint += 1) {
      const at = joint * 3;
      rig.placeJoint(joint, offsets[at] ?? 0, offsets[at + 1] ?? 0, offsets[at + 2] ?? 0);
    }
  }

  /**
   * How large the body is, the scene says. Its lengths are brought to those that the avatar reckons
   * in, so a giant's tissue moves as if it were its own size.
   */
  #readPose(rig: EngineRig): void {
    const { pose } = this;
    const { scale } = this.avatar;
    rig.readPelvis(pose);
    for (let axis = 0; axis < 3; axis += 1) {
      pose[axis] = ((pose[axis] ?? 0) - (this.#jointsM[axis] ?? 0)) * scale;
    }
    for (let joint = 1; joint < JOINT_NAMES.length; joint += 1) {
      rig.readTurn(joint, pose, turnAt(joint));
    }
  }

  #copySurface(rig: EngineRig): void {
    this.#isBehind = false;
    copyVertices(this.avatar.positions, rig.positions, this.#vertexMap);
    copyVertices(this.avatar.normals, rig.normals, this.#vertexMap);
  }
}
