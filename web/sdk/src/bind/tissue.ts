// What every engine does alike to play a binding. An engine adds the functions of `AvatarRig`.
import { claimMesh, releaseMesh } from "../adapter/rig.js";
import type { Avatar } from "../avatar.js";
import { checkCallback, checkFlag, checkObject } from "../check.js";
import type { Core } from "../core.js";
import { DynaSkinError } from "../error.js";
import type { Model } from "../model.js";
import { checkLength, POSE_LENGTH, type Pose } from "../pose.js";
import type { PoseSource } from "../pose-source.js";
import type { CoreTissue } from "../wasm/core.js";
import { Binding, checkModel } from "./binding.js";
import { addSurfaces, type Moving, meshOf } from "./moving.js";
import { checkSpringBones, type SpringBones } from "./springs.js";
import {
  BodyChanges,
  checkWrite,
  rowsOf,
  type SurfaceRows,
  type TissueWrite,
} from "./vertex-stage.js";

/** How tissue is played on an avatar. */
export interface TissueOptions<Mesh, Material> {
  /** Says which meshes, or materials of them, stay as plain skinning has them: armour, belts, pouches. */
  exclude?: (mesh: Mesh, material: Material) => boolean;
  /**
   * How stiff a mesh or a material of it is, 0 to 1: 0, as all that is left out, moves like the body, 1
   * stays still.
   */
  stiffness?: (mesh: Mesh, material: Material) => number;
  /**
   * What becomes of bones that move breasts or buttocks by themselves, such as VRM's spring bones. If left
   * out they are held still: the tissue takes their place.
   */
  springBones?: SpringBones;
  /** Where the poses come from; see `PoseSource`. `display` if left out. */
  poseSource?: PoseSource;
  /**
   * How the tissue reaches the meshes. `"attributes"`, if left out: positions, normals and tangents are written each
   * frame, for every material and renderer, rays and outlines. `"texture"`: one small texture is written, and the
   * vertex stage of the meshes' materials adds the tissue. That costs the processor less, and is for the standard
   * materials of WebGL; what else it leaves out is told by `notes` of the tissue.
   */
  write?: TissueWrite;
  /**
   * Whether the engine's motion vectors follow the tissue, which takes the memory and time of one more set of
   * positions; see `previousPositions` in three.js. `false` if left out.
   */
  motionVectors?: boolean;
}

/** Numbers of a matrix. */
const MATRIX = 16;

/** A bone that turns joints: its name, and where a skin has it. */
export interface RigBone {
  name: string;
  mesh: number | null;
  joint: number | null;
}

/**
 * Arrays of a surface with tissue, as those without it; empty where it has none.
 *
 * @internal
 */
export interface SurfaceArrays {
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  readonly tangents: Float32Array;
}

/**
 * A surface that an engine draws, and perhaps several meshes share: its arrays as they are without tissue.
 *
 * @internal
 */
export interface AvatarSurface {
  /** What it is called in messages. */
  readonly name: string;
  /** `[vertex][x, y, z]`, in its own space. */
  readonly positions: Float32Array;
  /** Unit normals, likewise; empty where it has none. */
  readonly normals: Float32Array;
  /** Unit tangents and their handedness, `[vertex][4]`; empty where it has none. */
  readonly tangents: Float32Array;
  /** How much of the tissue each vertex takes, `[vertex]`; empty for all of it. */
  readonly shares: Float32Array;
  /** Whether any mesh shows it. */
  isShown(): boolean;
  /** Shows other arrays, of the vertices from `first` to before `end`. */
  upload(arrays: SurfaceArrays, first: number, end: number): void;
}

/**
 * An avatar as its engine has it.
 *
 * @internal
 */
export interface AvatarRig<Mesh extends object> {
  /** Meshes that are to move. */
  readonly meshes: readonly Mesh[];
  readonly surfaces: readonly AvatarSurface[];
  /**
   * Finds the bones, before anything changes. `bound`: the number of each surface's mesh in the binding.
   *
   * @returns names of those that are not there
   */
  findBones(bones: readonly RigBone[], bound: readonly number[]): string[];
  /** What a vertex stage leaves out, a sentence each. Throws `argument` for materials or an engine that have none. */
  checkVertexStage(): string[];
  /** Shows surfaces of the avatar's own from now on; only those of these numbers move. */
  attach(moving: readonly number[]): void;
  /** Lets the materials' vertex stage move the surfaces from now on. */
  attachVertexStage(changes: BodyChanges, moving: readonly SurfaceRows[]): void;
  /** Hands the body's changes to the vertex stage. */
  uploadChanges(): void;
  /** Gives the meshes back what they had. */
  detach(): void;
  /** Puts bones back that are not to move by themselves. */
  holdBones(): void;
  /** Writes the matrices of the bones in the world, right-handed, column-major. */
  readBones(into: Float64Array): void;
  /** The matrix of the avatar's root in the world, as those of the bones. */
  readRoot(): Float64Array;
  /** Turns a bone as the quaternion at `rotations[at]` says, in the root's space. Parents come first. */
  turnBone(bone: number, rotations: Float64Array, at: number): void;
  /** Moves a bone by this much of the world. */
  moveBone(bone: number, by: Float64Array): void;
}

/** Plays a binding on the meshes of an avatar of any engine. */
export abstract class TissueDriver<Mesh extends object> {
  /** The body whose tissue moves the avatar: its controls, detail and timings. It is this object's own. */
  readonly avatar: Avatar;
  /** The binding that was handed in. */
  readonly binding: Binding;
  /** Vertices that move, over all meshes. */
  readonly movingVertices: number;
  /** How the tissue reaches the meshes. */
  readonly write: TissueWrite;
  /** What this way of writing leaves out, a sentence each; empty for attributes. */
  readonly notes: readonly string[];
  readonly #core: Core;
  readonly #rig: AvatarRig<Mesh>;
  readonly #bones: WorldMatrices;
  readonly #moving: Moving[];
  #raw: CoreTissue | null;

  /** @internal */
  constructor(
    model: Model,
    binding: Binding,
    options: TissueOptions<never, never>,
    rigOf: () => AvatarRig<Mesh>,
  ) {
    checkArguments(model, binding, options);
    const core = model.core;
    const write = checkWrite(options.write);
    const rig = rigOf();
    this.write = write;
    this.notes = write === "texture" ? rig.checkVertexStage() : [];
    const raw = binding.open(model);
    // Given back, last first, where the rest fails.
    const taken: (() => void)[] = [];
    try {
      const bound = rig.surfaces.map((surface) => meshOf(core, raw, surface));
      const bones = core.guard(() => raw.bones()) as RigBone[];
      checkBones(rig.findBones(bones, bound));
      for (const mesh of rig.meshes) {
        claimMesh(mesh);
        taken.push(() => releaseMesh(mesh));
      }
      const { poseSource } = options;
      const shape = core.guard(() => raw.shape());
      // Only its offsets are taken.
      const avatar = model.createAvatar({
        shape,
        poseCorrectives: false,
        ...(poseSource && { poseSource }),
      });
      taken.push(() => avatar.dispose());
      const tissue = core.guard(() => new core.glue.CoreTissue(raw, avatar.raw));
      taken.push(() => core.free(tissue));
      this.avatar = avatar;
      this.#raw = tissue;
      this.#bones = new WorldMatrices(core, tissue, bones.length);
      if (write === "texture") core.guard(() => tissue.leaveSurfaces());
      this.#moving = addSurfaces(core, tissue, { surfaces: rig.surfaces, bound, write });
    } catch (error) {
      for (const giveBack of taken.reverse()) giveBack();
      throw error;
    } finally {
      core.free(raw);
    }
    this.#core = core;
    this.#rig = rig;
    this.binding = binding;
    this.movingVertices = this.#moving.reduce((sum, { idx }) => sum + this.#countOf(idx), 0);
    this.#attach();
  }

  /**
   * Reads the bones, moves the tissue and hands the surface to the meshes. Call it once a frame after
   * everything that moves bones, before rendering. Meshes that are not visible cost nothing.
   *
   * @param deltaSeconds - time since the last call in seconds; less than 0 counts as 0
   * @throws DynaSkinError `disposed`, or what `Avatar.step` throws; the meshes then keep their surface
   */
  update(deltaSeconds: number): void {
    const raw = this.#alive;
    this.#rig.holdBones();
    this.#rig.readBones(this.#bones.view);
    this.#tellShown(raw);
    this.#core.guard(() => raw.step(this.avatar.raw, Math.max(0, deltaSeconds)));
    this.#upload();
  }

  /**
   * Hands the tissue's present surface to the meshes without moving it on, such as after a change of
   * `avatar.strength` while the page stands still.
   *
   * @throws DynaSkinError `disposed`
   */
  show(): void {
    const raw = this.#alive;
    this.#tellShown(raw);
    this.#core.guard(() => raw.refresh(this.avatar.raw));
    this.#upload();
  }

  /** The body's pose at the last update, 99 numbers. A copy. */
  get pose(): Pose {
    const raw = this.#alive;
    return this.#core.guard(() => raw.pose(this.avatar.raw));
  }

  /**
   * Poses the avatar's bones as a dynaskin pose says, for motions that come from `Motion.poseAt` instead
   * of the engine's own animations. The pose counts from where the avatar's root is.
   *
   * @throws DynaSkinError `argument` for a wrong length, `disposed`
   */
  writePose(pose: Pose): void {
    const raw = this.#alive;
    checkLength("pose", pose, POSE_LENGTH);
    const numbers = Float64Array.from(pose);
    const rotations = this.#core.guard(() => raw.rotationsOf(this.avatar.raw, numbers));
    for (let bone = 0; 4 * bone < rotations.length; bone += 1) {
      this.#rig.turnBone(bone, rotations, 4 * bone);
    }
    this.#rig.readBones(this.#bones.view);
    const root = this.#rig.readRoot();
    const move = this.#core.guard(() => raw.moveTo(this.avatar.raw, numbers, root));
    this.#rig.moveBone(move[0] ?? 0, move.subarray(1));
  }

  /**
   * Gives the meshes back their geometry, and frees the tissue. The binding stays good. May be called
   * again.
   */
  dispose(): void {
    const raw = this.#raw;
    if (!raw) return;
    this.#raw = null;
    this.#rig.meshes.forEach(releaseMesh);
    this.#rig.detach();
    this.#core.free(raw);
    this.avatar.dispose();
  }

  #attach(): void {
    const raw = this.#alive;
    if (this.write === "attributes") {
      this.#rig.attach(this.#moving.map(({ idx }) => idx));
      return;
    }
    const changes = new BodyChanges(this.#core, raw);
    const rows = this.#moving.map(({ idx }) => ({ idx, rows: rowsOf(this.#core, raw, idx) }));
    this.#rig.attachVertexStage(changes, rows);
  }

  get #alive(): CoreTissue {
    if (this.#raw) return this.#raw;
    throw new DynaSkinError("disposed", "This AvatarTissue was used after dispose().");
  }

  #countOf(idx: number): number {
    const raw = this.#alive;
    return this.#core.guard(() => raw.moving(idx))[2] ?? 0;
  }

  #tellShown(raw: CoreTissue): void {
    for (const moving of this.#moving) {
      const isShown = moving.surface.isShown();
      if (isShown === moving.isShown) continue;
      moving.isShown = isShown;
      this.#core.guard(() => raw.show(moving.idx, isShown));
    }
  }

  #upload(): void {
    if (this.write === "texture") {
      if (this.#moving.some(({ isShown }) => isShown)) this.#rig.uploadChanges();
      return;
    }
    for (const { surface, positions, normals, tangents, first, end, isShown } of this.#moving) {
      if (!isShown || !positions) continue;
      const arrays = {
        positions: positions.view,
        normals: normals?.view ?? NONE,
        tangents: tangents?.view ?? NONE,
      };
      surface.upload(arrays, first, end);
    }
  }
}

const NONE = new Float32Array(0);

/** The bones' matrices in the core's memory, which may move when it grows. */
class WorldMatrices {
  readonly #core: Core;
  readonly #address: number;
  readonly #length: number;
  #view: Float64Array;

  constructor(core: Core, raw: CoreTissue, bones: number) {
    this.#core = core;
    this.#address = core.guard(() => raw.bonesPtr());
    this.#length = MATRIX * bones;
    this.#view = new Float64Array(core.memory.buffer, this.#address, this.#length);
  }

  get view(): Float64Array {
    this.#core.assertSound();
    const { buffer } = this.#core.memory;
    if (this.#view.buffer !== buffer) {
      this.#view = new Float64Array(buffer, this.#address, this.#length);
    }
    return this.#view;
  }
}

function checkArguments(model: Model, binding: Binding, options: TissueOptions<never, never>) {
  checkModel(model);
  if (!(binding instanceof Binding)) {
    throw new DynaSkinError(
      "argument",
      "AvatarTissue needs a binding, as bindAvatar() or Binding.fromBytes() gives it.",
    );
  }
  checkObject("options", options);
  checkCallback("exclude", options.exclude);
  checkCallback("stiffness", options.stiffness);
  checkSpringBones(options.springBones);
  checkFlag("motionVectors", options.motionVectors);
}

function checkBones(missing: readonly string[]): void {
  if (missing.length === 0) return;
  throw new DynaSkinError(
    "binding",
    `The avatar has no bone called ${missing.join(", ")}, which the binding needs: it was made for ` +
      "another avatar. Bind this one again.",
  );
}

/**
 * How much of the tissue a mesh takes where it has this material: 0, none of it, to 1, all of it.
 *
 * @internal
 */
export function shareOf<Mesh, Material>(
  { exclude, stiffness }: TissueOptions<Mesh, Material>,
  mesh: Mesh,
  material: Material,
): number {
  if (exclude?.(mesh, material)) return 0;
  const stiff = stiffness?.(mesh, material) ?? 0;
  if (typeof stiff === "number" && stiff >= 0 && stiff <= 1) return 1 - stiff;
  throw new DynaSkinError("argument", `stiffness must give a number from 0 to 1, got ${stiff}.`);
}
