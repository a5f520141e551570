// Meshes whose materials have something added to their vertex stage, for as long as it is wanted.

import type { AbstractEngine } from "@babylonjs/core/Engines/abstractEngine.js";
import type { Material } from "@babylonjs/core/Materials/material.js";
import type { MaterialDefines } from "@babylonjs/core/Materials/materialDefines.js";
import { MaterialPluginBase } from "@babylonjs/core/Materials/materialPluginBase.js";
import type { MultiMaterial } from "@babylonjs/core/Materials/multiMaterial.js";
import { ShadowDepthWrapper } from "@babylonjs/core/Materials/shadowDepthWrapper.js";
import type { AbstractMesh } from "@babylonjs/core/Meshes/abstractMesh.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { Observer } from "@babylonjs/core/Misc/observable.js";
import type { Scene } from "@babylonjs/core/scene.js";
import { DynaSkinError } from "../error.js";

/** Materials whose vertex shaders take code of plugins. */
const STANDARD = new Set([
  "StandardMaterial",
  "PBRMaterial",
  "PBRMetallicRoughnessMaterial",
  "PBRSpecularGlossinessMaterial",
]);

/** Babylon's number for WebGL without integers in shaders. */
const WEBGL_1 = 1;
/** After plugins that change shapes usually do. */
const PRIORITY = 200;

/** What is added to the vertex stage of materials. */
export interface VertexEdit {
  /** The plugin's name. */
  readonly plugin: string;
  /** Makes the plugin for a material. */
  make(material: Material): StagePlugin;
  /** What cannot be done to an unfit material, as a part of a message: "write: ... cannot add tissue". */
  readonly refusal: string;
  /** The sentence behind it: what to do instead. */
  readonly otherwise: string;
  /** What is said where another engine than that of WebGL 2 draws. */
  readonly otherEngine: string;
}

/**
 * Refuses what has no vertex stage to which `edit` can be added.
 *
 * @throws DynaSkinError `argument`
 */
export function checkMesh(mesh: Mesh, edit: VertexEdit): void {
  const { isWebGPU, version } = mesh.getEngine() as AbstractEngine & { version?: number };
  if (isWebGPU || version === WEBGL_1) throw new DynaSkinError("argument", edit.otherEngine);
  for (const material of materialsOf(mesh)) checkMaterial(material, edit);
}

function checkMaterial(material: Material, edit: VertexEdit): void {
  if (STANDARD.has(material.getClassName())) return;
  throw new DynaSkinError(
    "argument",
    `The material ${material.name || "without a name"} is a ${material.getClassName()}, to which ` +
      `${edit.refusal}. ${edit.otherwise}`,
  );
}

function materialsOf(mesh: Mesh): Material[] {
  const material = mesh.material ?? mesh.getScene().defaultMaterial;
  const { subMaterials } = material as MultiMaterial;
  return subMaterials ? subMaterials.flatMap((one) => one ?? []) : [material];
}

/** Meshes with one addition, whatever materials they are given. */
export class StagedMeshes {
  readonly #edit: VertexEdit;
  /** The meshes, and what tells of other materials of theirs. */
  readonly #meshes = new Map<Mesh, Observer<AbstractMesh>>();
  readonly #plugins = new Set<StagePlugin>();

  constructor(edit: VertexEdit) {
    this.#edit = edit;
  }

  /** @throws DynaSkinError `argument` for a material to which nothing can be added */
  add(mesh: Mesh): void {
    this.#take(mesh);
    this.#meshes.set(mesh, this.#follow(mesh));
  }

  detach(): void {
    for (const observer of this.#meshes.values()) observer.remove();
    for (const plugin of this.#plugins) plugin.release();
  }

  /** Takes other materials that the mesh is given; it keeps what it has where another cannot be taken. */
  #follow(mesh: Mesh): Observer<AbstractMesh> {
    let { material } = mesh;
    return mesh.onMaterialChangedObservable.add(() => {
      try {
        this.#take(mesh);
        material = mesh.material;
      } catch (error) {
        mesh.material = material;
        throw error;
      }
    });
  }

  #take(mesh: Mesh): void {
    const materials = materialsOf(mesh);
    for (const material of materials) checkMaterial(material, this.#edit);
    for (const material of materials) {
      const known = material.pluginManager?.getPlugin<StagePlugin>(this.#edit.plugin);
      const plugin = known ?? this.#edit.make(material);
      if (this.#plugins.has(plugin)) continue;
      this.#plugins.add(plugin);
      plugin.claim();
    }
  }
}

/** Shadows as the material itself draws: Babylon's usual shader of shadows knows nothing of plugins. */
const shadows = new WeakMap<Material, { wrapper: ShadowDepthWrapper; users: number }>();

function claimShadow(material: Material): void {
  const known = shadows.get(material);
  if (known) {
    known.users += 1;
    return;
  }
  // A wrapper of the page's knows of plugins as well.
  if (material.shadowDepthWrapper) return;
  const wrapper = new ShadowDepthWrapper(material, material.getScene());
  material.shadowDepthWrapper = wrapper;
  shadows.set(material, { wrapper, users: 1 });
}

function releaseShadow(material: Material): void {
  const known = shadows.get(material);
  if (!known) return;
  known.users -= 1;
  if (known.users > 0) return;
  shadows.delete(material);
  if (material.shadowDepthWrapper === known.wrapper) material.shadowDepthWrapper = null;
  known.wrapper.dispose();
}

/**
 * Adds code to a material, on meshes that are staged; other meshes are drawn as without it. Babylon asks for code and
 * class name before the constructor of a subclass runs: they must not depend on fields.
 */
export abstract class StagePlugin extends MaterialPluginBase {
  /** Stages that use it: Babylon cannot take a plugin off, but put it out of use. */
  #users = 0;
  readonly #define: string;

  constructor(material: Material, name: string, define: string) {
    super(material, name, PRIORITY, { [define]: false });
    this.#define = define;
    this.doNotSerialize = true;
  }

  /** Whether the code is for this mesh. */
  protected abstract isStaged(mesh: AbstractMesh): boolean;

  claim(): void {
    this.#users += 1;
    if (this.#users === 1) claimShadow(this._material);
    this._enable(true);
    this.markAllDefinesAsDirty();
  }

  release(): void {
    this.#users -= 1;
    if (this.#users === 0) releaseShadow(this._material);
    this.markAllDefinesAsDirty();
  }

  override prepareDefines(defines: MaterialDefines, _: Scene, mesh: AbstractMesh): void {
    const isStaged = this.isStaged(mesh);
    if ((defines as unknown as Record<string, boolean>)[this.#define] === isStaged) return;
    Object.assign(defines, { [this.#define]: isStaged });
    defines.markAsUnprocessed();
  }
}
