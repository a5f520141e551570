// Meshes whose materials have something added to their vertex stage, for as long as it is wanted.
import {
  type Material,
  MeshDepthMaterial,
  MeshDistanceMaterial,
  type Object3D,
  type SkinnedMesh,
} from "three";
import { DynaSkinError } from "../error.js";
import {
  checkMaterial,
  mirrorMaterial,
  plainMaterial,
  type VertexEdit,
} from "./mirror-material.js";

/** Takes what a `StagedMesh` gave the mesh that it is a clone of from a mesh. */
export function makePlain(mesh: SkinnedMesh): void {
  const { material } = mesh;
  const isOurs = (one: Material) => plainMaterial(one) !== one;
  if (Array.isArray(material) ? material.some(isOurs) : isOurs(material)) {
    mesh.material = Array.isArray(material) ? material.map(plainMaterial) : plainMaterial(material);
  }
}

/** The mirrors of materials with one addition. */
export class Mirrors {
  readonly edit: VertexEdit;
  readonly #known = new Map<Material, Material>();

  constructor(edit: VertexEdit) {
    this.edit = edit;
  }

  of(material: Material): Material {
    const source = plainMaterial(material);
    const known = this.#known.get(source);
    if (known) return known;
    checkMaterial(source, this.edit);
    const mirror = mirrorMaterial(source, this.edit);
    this.#known.set(source, mirror);
    source.addEventListener("dispose", this.#free);
    return mirror;
  }

  dispose(): void {
    for (const material of this.#known.keys()) this.#free({ target: material });
  }

  readonly #free = ({ target }: { target: Material }): void => {
    target.removeEventListener("dispose", this.#free);
    this.#known.get(target)?.dispose();
    this.#known.delete(target);
  };
}

/** A mesh that shows mirrors of the materials that it is given. */
export class StagedMesh {
  readonly #mesh: SkinnedMesh;
  readonly #hooks: Restorable[] = [];
  readonly #unused: Material[] = [];

  constructor(mesh: SkinnedMesh, mirrors: Mirrors) {
    this.#mesh = mesh;
    // The renderer's own materials for shadows have nothing added.
    const depth = mirrors.of(mesh.customDepthMaterial ?? this.#own(new MeshDepthMaterial()));
    const distance = mirrors.of(
      mesh.customDistanceMaterial ?? this.#own(new MeshDistanceMaterial()),
    );
    const before = mesh.onBeforeRender;
    // Whatever is refused is refused before the mesh changes.
    this.#mirrorMaterial(mirrors);
    this.#hooks.push(
      hook(mesh, "customDepthMaterial", depth),
      hook(mesh, "customDistanceMaterial", distance),
      hook(mesh, "onBeforeRender", function (this: Object3D, ...args) {
        checkRenderer(args[0], mirrors.edit);
        before.apply(this, args);
      }),
    );
  }

  detach(): void {
    for (const { restore } of this.#hooks) restore();
    for (const material of this.#unused) material.dispose();
  }

  #own(material: Material): Material {
    this.#unused.push(material);
    return material;
  }

  /** Pages may exchange materials at any time, such as for a pass. */
  #mirrorMaterial(mirrors: Mirrors): void {
    let plain = this.#mesh.material;
    const mirrored = () =>
      Array.isArray(plain) ? plain.map((one) => mirrors.of(one)) : mirrors.of(plain);
    let shown = mirrored();
    Object.defineProperty(this.#mesh, "material", {
      get: () => shown,
      set: (material: SkinnedMesh["material"]) => {
        const before = plain;
        plain = material;
        try {
          shown = mirrored();
        } catch (error) {
          plain = before;
          throw error;
        }
      },
      configurable: true,
      enumerable: true,
    });
    this.#hooks.push({
      restore: () => {
        const value = Array.isArray(plain) ? plain : plainMaterial(plain);
        Object.defineProperty(this.#mesh, "material", {
          ...{ value, writable: true, configurable: true, enumerable: true },
        });
      },
    });
  }
}

interface Restorable {
  readonly restore: () => void;
}

/** Gives an object a property of its own. */
function hook<Kind extends object, Key extends keyof Kind>(
  object: Kind,
  key: Key,
  value: Kind[Key],
): Restorable {
  const had = Object.getOwnPropertyDescriptor(object, key);
  object[key] = value;
  return {
    restore: () => {
      // Whoever has set another meanwhile keeps that.
      if (object[key] !== value) return;
      if (had) Object.defineProperty(object, key, had);
      else delete object[key];
    },
  };
}

function checkRenderer(renderer: unknown, { otherRenderer }: VertexEdit): void {
  if ((renderer as { isWebGLRenderer?: boolean } | null)?.isWebGLRenderer) return;
  throw new DynaSkinError("argument", otherRenderer);
}
