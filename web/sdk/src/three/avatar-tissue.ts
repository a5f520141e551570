import {
  BufferAttribute,
  type BufferGeometry,
  type LOD,
  type Material,
  Matrix4,
  type Object3D,
  Quaternion,
  type SkinnedMesh,
  type Sphere,
  Vector3,
} from "three";
import { type BindOptions as AnyBindOptions, bindParts } from "../bind/bind.js";
import type { Binding } from "../bind/binding.js";
import { type SpringNames, springNames } from "../bind/springs.js";
import {
  type AvatarRig,
  type AvatarSurface,
  type RigBone,
  type SurfaceArrays,
  TissueDriver,
  type TissueOptions,
} from "../bind/tissue.js";
import type { BodyChanges, SurfaceRows } from "../bind/vertex-stage.js";
import { DynaSkinError } from "../error.js";
import type { Model } from "../model.js";
import { PREVIOUS, PreviousPositions } from "./motion-vectors.js";
import { USAGE, withAttributes } from "./own-geometry.js";
import {
  checkRoot,
  four,
  type HumanoidSource,
  materialsOf,
  nameOf,
  readAvatar,
  skinnedMeshes,
  vectorsOf,
} from "./read-avatar.js";
import { lesser, sharesOf } from "./shares.js";
import { HeldBones, sharesBeside, springBonesOf } from "./spring-bones.js";
import { makePlain } from "./staged-mesh.js";
import { checkMeshes, VertexStage } from "./vertex-stage.js";

/** How an avatar of three.js is bound. */
export interface BindOptions extends AnyBindOptions {
  /** What three-vrm's `VRMLoaderPlugin` gives as `gltf.userData.vrm`: it says which bones are a person's. */
  vrm?: HumanoidSource | undefined;
}

/**
 * Finds out how a body's tissue moves an avatar: its bones, its shape, and where its skin lies on the body.
 * Bind it as it was loaded, before an animation leans its pelvis; where it stands, and how large, does not
 * matter. Nothing of it is changed.
 *
 * ```ts
 * const { scene, userData: { vrm } } = await loader.loadAsync("/me.vrm");
 * const binding = await bindAvatar(model, scene, { depicts: "adult", vrm });
 * ```
 *
 * @param model - a model of the avatar's sex
 * @param root - what has the avatar's skinned meshes and their bones in it, +Y up
 * @throws DynaSkinError `adult` for what is not declared or not proportioned as an adult, `avatar` for
 *   meshes and `humanoid` for bones that are no person's, `worker`, `fetch`, `wasm`, `argument`
 */
export function bindAvatar(model: Model, root: Object3D, options: BindOptions): Promise<Binding> {
  return bindParts(model, options, () => {
    checkRoot(root);
    return readAvatar(root, options.vrm);
  });
}

/**
 * Plays a binding: all skinned meshes under the root get a geometry of their own, on which the tissue's
 * offsets go in before skinning. Materials, shadows, raycasting and morph targets see the same surface.
 *
 * ```ts
 * const tissue = new AvatarTissue(model, scene, binding);
 * function frame(deltaSeconds: number) {
 *   mixer.update(deltaSeconds);
 *   vrm?.update(deltaSeconds);
 *   tissue.update(deltaSeconds); // after everything that moves bones
 *   renderer.render(view, camera);
 * }
 * ```
 */
export class AvatarTissue extends TissueDriver<SkinnedMesh> {
  /** The avatar's root that was handed in. */
  readonly root: Object3D;

  /**
   * @param model - a model of the body that the avatar was bound to
   * @param root - the avatar, or a clone of it
   * @throws DynaSkinError `binding` if meshes or bones are others than those that were bound, `argument`;
   *   nothing of the avatar is then changed
   */
  constructor(
    model: Model,
    root: Object3D,
    binding: Binding,
    options: TissueOptions<SkinnedMesh, Material> = {},
  ) {
    super(model, binding, options, () => {
      checkRoot(root);
      return new ThreeAvatar(root, options, springNames(binding.report));
    });
    this.root = root;
  }
}

/** Of a geometry of ours: the one that it stands for, also on clones. */
const sources = new WeakMap<BufferGeometry, BufferGeometry>();

/** Bounds of a geometry with tissue, against those without: offsets reach some centimetres. */
const ENLARGED = 1.2;

const matrix = new Matrix4();
const rotation = new Quaternion();
const wanted = new Quaternion();
const place = new Vector3();

/** The geometry that a mesh has without tissue. */
function sourceOf({ geometry }: SkinnedMesh): BufferGeometry {
  return sources.get(geometry) ?? geometry;
}

/** Positions, normals and tangents that one or several meshes show. */
class Surface implements AvatarSurface {
  readonly name: string;
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  readonly tangents: Float32Array;
  readonly shares: Float32Array;
  readonly meshes: SkinnedMesh[] = [];
  readonly #attributes: Map<string, BufferAttribute>;
  readonly #hasMotionVectors: boolean;
  readonly #geometries = new Map<BufferGeometry, BufferGeometry>();

  constructor(mesh: SkinnedMesh, shares: Float32Array, hasMotionVectors: boolean) {
    const { position, normal, tangent } = sourceOf(mesh).attributes;
    this.name = `${nameOf(mesh)} (${materialsOf(mesh)[0]?.name ?? "no material"})`;
    this.positions = position ? vectorsOf(position) : new Float32Array(0);
    this.normals = normal ? vectorsOf(normal) : new Float32Array(0);
    this.tangents = four(tangent, tangent?.count ?? 0);
    this.shares = shares;
    this.#hasMotionVectors = hasMotionVectors;
    this.#attributes = new Map();
  }

  isShown(): boolean {
    return this.meshes.some(isShown);
  }

  attach(): void {
    const position = dynamic(this.positions, 3);
    const previous = this.#hasMotionVectors ? new PreviousPositions(position) : null;
    this.#attributes.set("position", position);
    if (previous) this.#attributes.set(PREVIOUS, previous.attribute);
    if (this.normals.length > 0) this.#attributes.set("normal", dynamic(this.normals, 3));
    if (this.tangents.length > 0) this.#attributes.set("tangent", dynamic(this.tangents, 4));
    for (const mesh of this.meshes) {
      const source = sourceOf(mesh);
      const own = this.#geometries.get(source) ?? withTissue(source, this.#attributes);
      this.#geometries.set(source, own);
      previous?.attach(own);
      sources.set(own, source);
      makePlain(mesh);
      mesh.geometry = own;
    }
  }

  detach(): void {
    for (const mesh of this.meshes) {
      // Whoever has given it another meanwhile keeps that.
      if (sources.has(mesh.geometry)) mesh.geometry = sourceOf(mesh);
    }
    for (const own of this.#geometries.values()) {
      // What is shared with the source stays on the graphics card.
      for (const name of Object.keys(own.attributes)) {
        if (!this.#attributes.has(name)) own.deleteAttribute(name);
      }
      own.setIndex(null);
      own.dispose();
    }
    this.#geometries.clear();
  }

  upload({ positions, normals, tangents }: SurfaceArrays, first: number, end: number): void {
    this.#write("position", positions, first, end);
    this.#write("normal", normals, first, end);
    this.#write("tangent", tangents, first, end);
  }

  #write(name: string, from: Float32Array, first: number, end: number): void {
    const attribute = this.#attributes.get(name);
    if (!attribute || from.length === 0) return;
    const { itemSize } = attribute;
    const [start, stop] = [itemSize * first, itemSize * end];
    (attribute.array as Float32Array).set(from.subarray(start, stop), start);
    attribute.clearUpdateRanges();
    attribute.addUpdateRange(start, stop - start);
    attribute.needsUpdate = true;
  }
}

function dynamic(numbers: Float32Array, itemSize: number): BufferAttribute {
  return new BufferAttribute(numbers.slice(), itemSize).setUsage(USAGE);
}

function isShown(mesh: SkinnedMesh): boolean {
  for (let object: Object3D | null = mesh; object; object = object.parent) {
    if (!object.visible && !isChosenLate(object)) return false;
  }
  return true;
}

/** Whether it is a level of detail, of which the renderer shows one only when it draws. */
function isChosenLate({ parent }: Object3D): boolean {
  const lod = parent as LOD | null;
  return lod?.isLOD === true && lod.autoUpdate;
}

/** The avatar's meshes, surfaces and bones. */
class ThreeAvatar implements AvatarRig<SkinnedMesh> {
  readonly meshes: SkinnedMesh[] = [];
  readonly surfaces: Surface[] = [];
  readonly #root: Object3D;
  #attached: Surface[] = [];
  #stage: VertexStage | null = null;
  #bones: Object3D[] = [];
  /** Bones and what is above them, from the root downwards. */
  #path: Object3D[] = [];

  readonly #held: HeldBones;
  readonly #hasMotionVectors: boolean;

  constructor(root: Object3D, options: TissueOptions<SkinnedMesh, Material>, names: SpringNames) {
    this.#root = root;
    const { springBones = "replace", motionVectors = false } = options;
    this.#hasMotionVectors = motionVectors;
    const all = skinnedMeshes(root);
    if (all.length === 0) {
      throw new DynaSkinError("argument", "There is no skinned mesh under the object given.");
    }
    const springs = springBonesOf(all, names);
    this.#held = new HeldBones(all, springBones === "replace" ? springs : new Set());
    const known = new Map<string, Surface>();
    const numberOf = numbering();
    for (const mesh of all) {
      const beside = sharesBeside(mesh, springs, springBones);
      const shares = lesser(sharesOf(mesh, options), beside);
      if (shares.every((share) => share === 0) && shares.length > 0) continue;
      // Primitives of one mesh often share their vertices.
      const { position, normal, tangent } = sourceOf(mesh).attributes;
      const isWhole = shares.length === 0;
      const key = [position, normal, tangent, isWhole ? null : mesh].map(numberOf).join();
      const surface = known.get(key) ?? new Surface(mesh, shares, motionVectors);
      if (!known.has(key)) this.surfaces.push(surface);
      known.set(key, surface);
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
  }

  checkVertexStage(): string[] {
    if (this.#hasMotionVectors) {
      throw new DynaSkinError(
        "argument",
        'motionVectors are for WebGPURenderer and write: "texture" for WebGLRenderer, which has none. Leave one out.',
      );
    }
    return checkMeshes(this.meshes);
  }

  attachVertexStage(changes: BodyChanges, moving: readonly SurfaceRows[]): void {
    const staged = moving.map(({ idx, rows }) => ({
      meshes: this.surfaces[idx]?.meshes ?? [],
      rows,
    }));
    for (const mesh of staged.flatMap(({ meshes }) => meshes)) {
      makePlain(mesh);
      mesh.geometry = sourceOf(mesh);
    }
    this.#stage = new VertexStage(changes, staged);
  }

  uploadChanges(): void {
    this.#stage?.upload();
  }

  detach(): void {
    for (const surface of this.#attached) surface.detach();
    this.#stage?.detach();
  }

  holdBones(): void {
    this.#held.hold();
  }

  readBones(into: Float64Array): void {
    this.#root.updateWorldMatrix(true, false);
    for (const object of this.#path) object.updateWorldMatrix(false, false);
    for (const [idx, bone] of this.#bones.entries()) into.set(bone.matrixWorld.elements, 16 * idx);
  }

  readRoot(): Float64Array {
    return Float64Array.from(this.#root.matrixWorld.elements);
  }

  turnBone(idx: number, rotations: Float64Array, at: number): void {
    const bone = this.#bones[idx];
    if (!bone) return;
    this.#root.getWorldQuaternion(wanted).multiply(rotation.fromArray(rotations, at));
    if (bone.parent) wanted.premultiply(bone.parent.getWorldQuaternion(rotation).invert());
    bone.quaternion.copy(wanted);
  }

  moveBone(idx: number, by: Float64Array): void {
    const bone = this.#bones[idx];
    if (!bone) return;
    bone.getWorldPosition(place);
    place.set(place.x + (by[0] ?? 0), place.y + (by[1] ?? 0), place.z + (by[2] ?? 0));
    if (bone.parent) place.applyMatrix4(matrix.copy(bone.parent.matrixWorld).invert());
    bone.position.copy(place);
  }

  /** By its place in a skin, if it is called as it was there; else by name. */
  #find({ name, mesh, joint }: RigBone, bound: readonly number[]): Object3D | undefined {
    const surface = this.surfaces[bound.indexOf(mesh ?? -1)];
    const byPlace = surface?.meshes[0]?.skeleton.bones[joint ?? -1];
    if (byPlace && nameOf(byPlace) === name) return byPlace;
    if (name === "") return undefined;
    for (const { skeleton } of this.meshes) {
      const found = skeleton.bones.find((bone) => nameOf(bone) === name);
      if (found) return found;
    }
    let found: Object3D | undefined;
    this.#root.traverse((object) => {
      if (!found && nameOf(object) === name) found = object;
    });
    return found;
  }
}

/** The objects and all between them and the root, parents first. */
function pathTo(objects: readonly Object3D[], root: Object3D): Object3D[] {
  const path = new Set<Object3D>();
  for (const object of objects) {
    const above: Object3D[] = [];
    for (let next: Object3D | null = object; next && next !== root; next = next.parent) {
      above.push(next);
    }
    for (const next of above.reverse()) path.add(next);
  }
  return [...path];
}

/** A number for each object. */
function numbering(): (object: object | null | undefined) => number {
  const numbers = new Map<object | null | undefined, number>();
  return (object) => {
    const number = numbers.get(object) ?? numbers.size;
    numbers.set(object, number);
    return number;
  };
}

/** The geometry with attributes of its own, whose morph targets add to them. */
function withTissue(
  source: BufferGeometry,
  attributes: ReadonlyMap<string, BufferAttribute>,
): BufferGeometry {
  const geometry = withAttributes(source, attributes);
  geometry.morphAttributes = morphsOf(source);
  geometry.morphTargetsRelative = true;
  geometry.boundingSphere = enlarged(source.boundingSphere);
  return geometry;
}

/** Morph targets as differences, to which offsets add. */
function morphsOf(source: BufferGeometry): BufferGeometry["morphAttributes"] {
  if (source.morphTargetsRelative) return source.morphAttributes;
  const morphs: BufferGeometry["morphAttributes"] = {};
  for (const [name, targets] of Object.entries(source.morphAttributes)) {
    const base = source.getAttribute(name);
    const still = base ? vectorsOf(base) : null;
    morphs[name as keyof typeof morphs] = (targets ?? []).map((target) => {
      if (!still || name === "color") return target as BufferAttribute;
      const relative = vectorsOf(target).map((number, idx) => number - (still[idx] ?? 0));
      return Object.assign(new BufferAttribute(relative, 3), { name: target.name });
    });
  }
  return morphs;
}

function enlarged(sphere: Sphere | null): Sphere | null {
  const larger = sphere?.clone() ?? null;
  if (larger) larger.radius *= ENLARGED;
  return larger;
}
