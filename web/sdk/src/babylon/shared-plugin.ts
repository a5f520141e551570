// Plugins of Babylon's materials, which several of our objects use at once.

import type { AbstractEngine } from "@babylonjs/core/Engines/abstractEngine.js";
import type { Material } from "@babylonjs/core/Materials/material.js";
import type { MaterialDefines } from "@babylonjs/core/Materials/materialDefines.js";
import { MaterialPluginBase } from "@babylonjs/core/Materials/materialPluginBase.js";
import type { MultiMaterial } from "@babylonjs/core/Materials/multiMaterial.js";
import type { AbstractMesh } from "@babylonjs/core/Meshes/abstractMesh.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { Observer } from "@babylonjs/core/Misc/observable.js";
import type { Scene } from "@babylonjs/core/scene.js";
import { DynaSkinError } from "../error.js";
import { castAsDrawn } from "./material-shadows.js";

/** Materials whose shaders take code of plugins before they skin. */
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

/** A plugin that materials are given. */
export interface PluginKind {
  /** The plugin's name. */
  readonly name: string;
  /** Makes the plugin for a material. */
  make(material: Material): SharedPlugin;
  /** What is said of materials that take no plugins; null where these stay as they are. */
  readonly refusal: Refusal | null;
}

/** What is said where a plugin is of no use. */
export interface Refusal {
  /** What cannot be done to a material, as a part of a message: "write: ... cannot add tissue". */
  readonly what: string;
  /** The sentence behind it: what to do instead. */
  readonly otherwise: string;
  /** What is said where another engine than that of WebGL 2 draws. */
  readonly otherEngine: string;
}

/**
 * Refuses a mesh that another engine than that of WebGL 2 draws, or with a material that takes no plugins.
 *
 * @throws DynaSkinError `argument`
 */
export function checkMesh(mesh: Mesh, refusal: Refusal): void {
  const { isWebGPU, version } = mesh.getEngine() as AbstractEngine & { version?: number };
  if (isWebGPU || version === WEBGL_1) throw new DynaSkinError("argument", refusal.otherEngine);
  for (const material of materialsOf(mesh)) takesPlugins(material, refusal);
}

/** Whether a material's shaders take code of plugins; throws where they do not and there is a refusal. */
function takesPlugins(material: Material, refusal: Refusal | null): boolean {
  if (STANDARD.has(material.getClassName())) return true;
  if (!refusal) return false;
  throw new DynaSkinError(
    "argument",
    `The material ${material.name || "without a name"} is a ${material.getClassName()}, to which ` +
      `${refusal.what}. ${refusal.otherwise}`,
  );
}

/** All materials that a mesh may be drawn with. */
function materialsOf(mesh: Mesh): Material[] {
  const material = mesh.material ?? mesh.getScene().defaultMaterial;
  const { subMaterials } = material as MultiMaterial;
  return subMaterials ? subMaterials.flatMap((one) => one ?? []) : [material];
}

/**
 * A plugin that acts on some of a material's meshes; others are drawn as without it. Babylon asks for code and class
 * name before the constructor of a subclass runs: they must not depend on fields.
 */
export abstract class SharedPlugin extends MaterialPluginBase {
  /** Babylon cannot take a plugin off, but put it out of use. */
  protected users = 0;

  /** @param defines - the names that {@link definesOf} gives */
  constructor(material: Material, name: string, defines: readonly string[]) {
    super(material, name, PRIORITY, Object.fromEntries(defines.map((define) => [define, false])));
    this.doNotSerialize = true;
  }

  /** What is defined in the shaders of a mesh. */
  protected abstract definesOf(mesh: AbstractMesh): Readonly<Record<string, boolean>>;

  claim(): void {
    this.users += 1;
    this._enable(true);
    this.markAllDefinesAsDirty();
  }

  release(): void {
    this.users -= 1;
    this.markAllDefinesAsDirty();
  }

  override prepareDefines(defines: MaterialDefines, _: Scene, mesh: AbstractMesh): void {
    const ours = this.definesOf(mesh);
    const present = defines as unknown as Record<string, boolean>;
    if (Object.keys(ours).every((name) => present[name] === ours[name])) return;
    Object.assign(defines, ours);
    defines.markAsUnprocessed();
  }
}

/** A plugin that moves vertices: where it is in use, shadows are cast as the material draws. */
export abstract class ShapingPlugin extends SharedPlugin {
  #releaseShadows: (() => void) | null = null;

  override claim(): void {
    this.#releaseShadows ??= castAsDrawn(this._material);
    super.claim();
  }

  override release(): void {
    if (this.users === 1) {
      this.#releaseShadows?.();
      this.#releaseShadows = null;
    }
    super.release();
  }
}

/** Gives plugins to the materials of meshes, also to those that they are given later. */
export class PluggedMeshes {
  readonly #kind: PluginKind;
  readonly #observers: Observer<AbstractMesh>[] = [];
  readonly #plugins = new Set<SharedPlugin>();

  constructor(kind: PluginKind) {
    this.#kind = kind;
  }

  /** @throws DynaSkinError `argument` for a material that is refused; no material has changed then */
  add(mesh: Mesh): void {
    this.#take(mesh);
    this.#observers.push(this.#follow(mesh));
  }

  dispose(): void {
    for (const observer of this.#observers) observer.remove();
    for (const plugin of this.#plugins) plugin.release();
  }

  /** A mesh keeps the material that it has where another cannot be taken. */
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
    const { name, make, refusal } = this.#kind;
    // Whatever is refused is refused before any material changes.
    const materials = materialsOf(mesh).filter((material) => takesPlugins(material, refusal));
    for (const material of materials) {
      const plugin = material.pluginManager?.getPlugin<SharedPlugin>(name) ?? make(material);
      if (this.#plugins.has(plugin)) continue;
      this.#plugins.add(plugin);
      plugin.claim();
    }
  }
}
