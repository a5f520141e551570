import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import type { Material } from "@babylonjs/core/Materials/material.js";
import { Matrix, Quaternion, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import type { Geometry } from "@babylonjs/core/Meshes/geometry.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import { type BindOptions as AnyBindOptions, bindParts } from "../bind/bind.js";
import type { Binding } from "../bind/binding.js";
import { type SpringNames, springNames } from "../bind/springs.js";
import {
  type AvatarRig,
  type AvatarSurface,
  type RigBone,
  type SurfaceArrays,
  shareOf,
  TissueDriver,
  type TissueOptions,
} from "../bind/tissue.js";
import type { BodyChanges, SurfaceRows } from "../bind/vertex-stage.js";
import { DynaSkinError } from "../error.js";
import type { Model } from "../model.js";
import { MorphBases } from "./morph-base.js";
import { keepPositions, type LastPicture, plugMotionVectors } from "./motion-vectors.js";
import { withSurface } from "./own-geometry.js";
import {
  checkRoot,
  type Humanoid,
  jointsOf,
  readAvatar,
  skinnedMeshes,
  worldOf,
} from "./read-avatar.js";
import type { PluggedMeshes } from "./shared-plugin.js";
import { HeldBones, sharesBeside, springBonesOf } from "./spring-bones.js";
import { checkMeshes, VertexStage } from "./vertex-stage.js";

/** How an avatar of Babylon.js is bound. */
export interface BindOptions extends AnyBindOptions {
  /** The nodes that VRM calls a person's bones, by its names; without them the names of nodes tell. */
  humanoid?: Humanoid;
}

/**
 * Finds out how a body's tissue moves an avatar: its bones, its shape, and where its skin lies on the body.
 * Bind it as it was loaded, before an animation leans its pelvis; where it stands, and how large, does not
 * matter. Nothing of it is changed.
 *
 * ```ts
 * const { meshes } = await ImportMeshAsync("/me.glb", scene);
 * const binding = await bindAvatar(model, meshes[0], { depicts: "adult" });
 * ```
 *
 * @param model - a model of the avatar's sex
 * @param root - what has the avatar's skinned meshes and their bones in it, +Y up
 * @throws DynaSkinError `adult` for what is not declared or not proportioned as an adult, `avatar` for
 *   meshes and `humanoid` for bones that are no person's, `worker`, `fetch`, `wasm`, `argument`
 */
export function bindAvatar(
  model: Model,
  root: TransformNode,
  options: BindOptions,
): Promise<Binding> {
  return bindParts(model, options, () => {
    checkRoot(root);
    return readAvatar(root, options.humanoid);
  });
}

/**
 * Plays a binding: all skinned meshes under the root get a geometry of their own, on which the tissue's
 * offsets go in before skinning. Materials, shadows and morph targets see the same surface.
 *
 * ```ts
 * const tissue = new AvatarTissue(model, meshes[0], binding);
 * scene.onBeforeRenderObservable.add(() => {
 *   tissue.update(engine.getDeltaTime() / 1000); // seconds; animations have moved the bones by then
 * });
 * ```
 */
export class AvatarTissue extends TissueDriver<Mesh> {
  /** The avatar's root that was handed in. */
  readonly root: TransformNode;

  /**
   * @param model - a model of the body that the avatar was bound to
   * @param root - the avatar, or a clone of it
   * @throws DynaSkinError `binding` if meshes or bones are others than those that were bound, `argument`;
   *   nothing of the avatar is then changed
   */
  constructor(
    model: Model,
    root: TransformNode,
    binding: Binding,
    options: TissueOptions<Mesh, Material | null> = {},
  ) {
    super(model, binding, options, () => {
      checkRoot(root);
      return new BabylonAvatar(root, options, springNames(binding.report));
    });
    this.root = root;
  }
}

/** Of a geometry of ours: the one that it stands for, also on clones. */
const sources = new WeakMap<Geometry, Geometry>();

const matrix = new Matrix();
const scale = new Vector3();
const place = new Vector3();
const rotation = new Quaternion();
const wanted = new Quaternion();

/** Positions, normals and tangents of a geometry, which clones share. */
class Surface implements AvatarSurface {
  readonly name: string;
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  readonly tangents: Float32Array;
  readonly shares: Float32Array;
  readonly meshes: Mesh[] = [];
  readonly #source: Geometry;
  readonly #hasMotionVectors: boolean;
  #own: Geometry | null = null;
  #bases: MorphBases | null = null;
  #previous: LastPicture | null = null;

  constructor(mesh: Mesh, source: Geometry, shares: Float32Array, hasMotionVectors: boolean) {
    this.#source = source;
    this.name = `${mesh.name} (${mesh.material?.name ?? "no material"})`;
    this.positions = dataOf(source, VertexBuffer.PositionKind);
    this.normals = dataOf(source, VertexBuffer.NormalKind);
    this.tangents = dataOf(source, VertexBuffer.TangentKind);
    this.shares = shares;
    this.#hasMotionVectors = hasMotionVectors;
  }

  isShown(): boolean {
    return this.meshes.some((mesh) => mesh.isVisible && mesh.isEnabled());
  }

  attach(): void {
    const own = withSurface(this.#source, this.positions.slice(), this.normals.slice());
    if (this.tangents.length > 0) {
      own.setVerticesData(VertexBuffer.TangentKind, this.tangents.slice(), true, 4);
    }
    const scene = this.meshes[0]?.getScene();
    if (this.#hasMotionVectors && scene) {
      this.#previous = keepPositions(own, this.positions, scene);
    }
    sources.set(own, this.#source);
    for (const mesh of this.meshes) apply(own, mesh);
    this.#bases = new MorphBases(this.#source, this.meshes);
    this.#own = own;
  }

  detach(): void {
    for (const mesh of this.meshes) {
      // Whoever has given it another meanwhile keeps that.
      const { geometry } = mesh;
      if (!mesh.isDisposed() && geometry && sources.has(geometry)) apply(this.#source, mesh);
    }
    this.#previous?.dispose();
    this.#bases?.dispose();
    this.#own?.dispose();
    this.#own = null;
  }

  /** Gives clones of meshes with tissue the geometry without it. */
  makePlain(): void {
    for (const mesh of this.meshes) {
      if (mesh.geometry !== this.#source) apply(this.#source, mesh);
    }
  }

  upload({ positions, normals, tangents }: SurfaceArrays): void {
    this.#bases?.follow();
    this.#own?.updateVerticesData(VertexBuffer.PositionKind, positions, false);
    this.#previous?.follow(positions);
    if (normals.length > 0) {
      this.#own?.updateVerticesData(VertexBuffer.NormalKind, normals, false);
    }
    if (tangents.length > 0) {
      this.#own?.updateVerticesData(VertexBuffer.TangentKind, tangents, false);
    }
  }
}

function dataOf(geometry: Geometry, kind: string): Float32Array {
  return Float32Array.from(geometry.getVerticesData(kind, true) ?? []);
}

/** Gives a mesh a geometry; its bounds stay. */
function apply(geometry: Geometry, mesh: Mesh): void {
  const bounds = mesh.getBoundingInfo();
  geometry.applyToMesh(mesh);
  mesh.setBoundingInfo(bounds);
}

/** The avatar's meshes, surfaces and bones. */
class BabylonAvatar implements AvatarRig<Mesh> {
  readonly meshes: Mesh[] = [];
  readonly surfaces: Surface[] = [];
  readonly #root: TransformNode;
  #attached: Surface[] = [];
  #stage: VertexStage | null = null;
  #bones: TransformNode[] = [];
  /** Bones and what is above them, from the root downwards. */
  #path: TransformNode[] = [];

  readonly #held: HeldBones;
  readonly #hasMotionVectors: boolean;
  #plugged: PluggedMeshes | null = null;

  constructor(
    root: TransformNode,
    options: TissueOptions<Mesh, Material | null>,
    names: SpringNames,
  ) {
    this.#root = root;
    const { springBones = "replace", motionVectors = false } = options;
    this.#hasMotionVectors = motionVectors;
    const all = skinnedMeshes(root);
    if (all.length === 0) {
      throw new DynaSkinError("argument", "There is no skinned mesh under the node given.");
    }
    const springs = springBonesOf(all, names);
    this.#held = new HeldBones(all, springBones === "replace" ? springs : new Set());
    const known = new Map<Geometry, Map<string, Surface>>();
    for (const mesh of all) {
      const share = shareOf(options, mesh, mesh.material);
      const geometry = mesh.geometry as Geometry;
      const source = sources.get(geometry) ?? geometry;
      if (share === 0) continue;
      const shares = sharesOf(mesh, share, sharesBeside(mesh, springs, springBones));
      const ofShares = known.get(source) ?? new Map<string, Surface>();
      const key = `${share} ${shares.length > 0 ? mesh.skeleton?.uniqueId : ""}`;
      const surface = ofShares.get(key) ?? new Surface(mesh, source, shares, motionVectors);
      if (!ofShares.has(key)) this.surfaces.push(surface);
      known.set(source, ofShares.set(key, surface));
      surface.meshes.push(mesh);
      this.meshes.push(mesh);
    }
  }

  findBones(bones: readonly RigBone[], bound: readonly number[]): string[] {
    const missing: string[] = [];
    this.#bones = bones.flatMap((bone) => {
      const found = this.#find(bone, bound);
      if (!found) missing.push(bone.name || "(nameless)");
      return found ? [found] : [];
    });
    this.#path = pathTo(this.#bones, this.#root);
    return missing;
  }

  attach(moving: readonly number[]): void {
    this.#attached = moving.flatMap((idx) => this.surfaces[idx] ?? []);
    for (const surface of this.#attached) surface.attach();
    if (!this.#hasMotionVectors) return;
    this.#plugged = plugMotionVectors(this.#attached.flatMap(({ meshes }) => meshes));
  }

  checkVertexStage(): string[] {
    return checkMeshes(this.meshes);
  }

  attachVertexStage(changes: BodyChanges, moving: readonly SurfaceRows[]): void {
    const staged = moving.flatMap(({ idx, rows }) => {
      const surface = this.surfaces[idx];
      surface?.makePlain();
      return surface ? [{ meshes: surface.meshes, rows }] : [];
    });
    this.#stage = new VertexStage(changes, staged, {
      motionVectors: this.#hasMotionVectors,
    });
  }

  uploadChanges(): void {
    this.#stage?.upload();
  }

  detach(): void {
    for (const surface of this.#attached) surface.detach();
    this.#stage?.detach();
    this.#plugged?.dispose();
  }

  holdBones(): void {
    this.#held.hold();
  }

  readBones(into: Float64Array): void {
    this.#root.computeWorldMatrix(true);
    for (const node of this.#path) node.computeWorldMatrix(true);
    for (const [idx, bone] of this.#bones.entries()) {
      into.set(worldOf(bone, matrix, false).asArray(), 16 * idx);
    }
  }

  readRoot(): Float64Array {
    return Float64Array.from(worldOf(this.#root, matrix, true).asArray());
  }

  turnBone(idx: number, rotations: Float64Array, at: number): void {
    const bone = this.#bones[idx];
    if (!bone) return;
    worldOf(this.#root, matrix, true).decompose(scale, wanted, place);
    wanted.multiplyInPlace(Quaternion.FromArrayToRef(rotations, at, rotation));
    if (bone.parent) {
      worldAbove(bone).decompose(scale, rotation, place);
      rotation.conjugateInPlace().multiplyToRef(wanted, wanted);
    }
    bone.rotationQuaternion ??= new Quaternion();
    bone.rotationQuaternion.copyFrom(wanted);
  }

  moveBone(idx: number, by: Float64Array): void {
    const bone = this.#bones[idx];
    if (!bone) return;
    worldOf(bone, matrix, true).getTranslationToRef(place);
    place.addInPlaceFromFloats(by[0] ?? 0, by[1] ?? 0, by[2] ?? 0);
    if (bone.parent) {
      Vector3.TransformCoordinatesToRef(place, worldAbove(bone).invert(), place);
    }
    bone.position.copyFrom(place);
  }

  /** By its place in a skin, if it is called as it was there; else by name; else as a clone is called. */
  #find({ name, mesh, joint }: RigBone, bound: readonly number[]): TransformNode | undefined {
    const surface = this.surfaces[bound.indexOf(mesh ?? -1)];
    const bones = surface?.meshes[0] ? jointsOf(surface.meshes[0]) : [];
    const byPlace = bones[joint ?? -1]?.getTransformNode() ?? undefined;
    if (byPlace?.name === name || name === "") return byPlace;
    for (const own of this.meshes) {
      const found = jointsOf(own).find((bone) => bone?.getTransformNode()?.name === name);
      if (found) return found.getTransformNode() ?? undefined;
    }
    const nodes = [this.#root, ...this.#root.getDescendants(false)] as TransformNode[];
    const byName = nodes.find((node) => node.name === name);
    // instantiateModelsToScene gives nodes other names, such as "Clone of hips".
    return byName ?? (byPlace?.name.endsWith(name) ? byPlace : undefined);
  }
}

/** The lesser of a mesh's share and of those beside bones that move by themselves; empty for all of it. */
function sharesOf(mesh: Mesh, share: number, beside: Float32Array): Float32Array {
  if (beside.length > 0) return beside.map((own) => Math.min(own, share));
  return new Float32Array(share === 1 ? 0 : mesh.getTotalVertices()).fill(share);
}

/** The matrix of what is above a node, which has been computed already, or is now. */
function worldAbove(node: TransformNode): Matrix {
  const { parent } = node;
  return parent ? worldOf(parent, matrix, true) : Matrix.IdentityToRef(matrix);
}

/** The nodes and all between them and the root, parents first. */
function pathTo(nodes: readonly TransformNode[], root: TransformNode): TransformNode[] {
  const path = new Set<TransformNode>();
  for (const node of nodes) {
    const above: TransformNode[] = [];
    for (let next: TransformNode | null = node; next && next !== root; ) {
      above.push(next);
      next = next.parent as TransformNode | null;
    }
    for (const next of above.reverse()) path.add(next);
  }
  return [...path];
}
