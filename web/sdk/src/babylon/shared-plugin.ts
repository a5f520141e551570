// Plugins of Babylon's materials, which several of our objects use at once.

import type { Material } from "@babylonjs/core/Materials/material.js";
import { MaterialPluginBase } from "@babylonjs/core/Materials/materialPluginBase.js";
import type { MultiMaterial } from "@babylonjs/core/Materials/multiMaterial.js";
import type { AbstractMesh } from "@babylonjs/core/Meshes/abstractMesh.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { Observer } from "@babylonjs/core/Misc/observable.js";

/** Materials whose shaders take code of plugins before they skin. */
const STANDARD = new Set([
  "StandardMaterial",
  "PBRMaterial",
  "PBRMetallicRoughnessMaterial",
  "PBRSpecularGlossinessMaterial",
]);

/** Whether a material's shaders take code of plugins. */
export function takesPlugins(material: Material): boolean {
  return STANDARD.has(material.getClassName());
}

/** All materials that a mesh may be drawn with. */
export function materialsOf(mesh: Mesh): Material[] {
  const material = mesh.material ?? mesh.getScene().defaultMaterial;
  const { subMaterials } = material as MultiMaterial;
  return subMaterials ? subMaterials.flatMap((one) => one ?? []) : [material];
}

/** A plugin that acts on some of a material's meshes; Babylon cannot take it off, but put it out of use. */
export abstract class SharedPlugin extends MaterialPluginBase {
  protected users = 0;

  claim(): void {
    this.users += 1;
    this._enable(true);
    this.markAllDefinesAsDirty();
  }

  release(): void {
    this.users -= 1;
    this.markAllDefinesAsDirty();
  }
}

/** Gives plugins to the materials of meshes, also to those that they are given later. */
export class PluggedMeshes {
  readonly #pluginOf: (material: Material) => SharedPlugin | null;
  readonly #observers: Observer<AbstractMesh>[] = [];
  readonly #plugins = new Set<SharedPlugin>();

  /** @param pluginOf - the plugin of a material, null for none; throws for a material that a mesh may not have */
  constructor(pluginOf: (material: Material) => SharedPlugin | null) {
    this.#pluginOf = pluginOf;
  }

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
    for (const material of materialsOf(mesh)) {
      const plugin = this.#pluginOf(material);
      if (!plugin || this.#plugins.has(plugin)) continue;
      this.#plugins.add(plugin);
      plugin.claim();
    }
  }
}
