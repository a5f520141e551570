// Tissue that the vertex stage of WebGLRenderer's materials adds.
import {
  DataTexture,
  FloatType,
  type Material,
  MeshDepthMaterial,
  MeshDistanceMaterial,
  type Object3D,
  type SkinnedMesh,
} from "three";
import type { BodyChanges, FloatTexels } from "../bind/vertex-stage.js";
import { DynaSkinError } from "../error.js";
import { checkMaterial, mirrorMaterial, plainMaterial, type Uniforms } from "./mirror-material.js";
import { materialsOf } from "./read-avatar.js";

/** What the tissue of a vertex stage does not reach. */
const NOTES = [
  "Rays meet the skin without tissue: Raycaster reads attributes, which stay as they are.",
  "Scene.overrideMaterial, and passes with materials of their own, draw the skin without tissue.",
];

/** Meshes that show one surface, and what its vertices take. */
export interface StagedSurface {
  readonly meshes: readonly SkinnedMesh[];
  readonly rows: FloatTexels;
}

/** Refuses materials to which nothing can be added; gives what is left out. */
export function checkMeshes(meshes: readonly SkinnedMesh[]): string[] {
  for (const mesh of meshes) materialsOf(mesh).forEach(checkMaterial);
  return [...NOTES];
}

/** Takes what `VertexStage` gave the mesh that it is a clone of from a mesh. */
export function makePlain(mesh: SkinnedMesh): void {
  const { material } = mesh;
  const isOurs = (one: Material) => plainMaterial(one) !== one;
  if (Array.isArray(material) ? material.some(isOurs) : isOurs(material)) {
    mesh.material = Array.isArray(material) ? material.map(plainMaterial) : plainMaterial(material);
  }
}

/** The textures of an avatar's tissue, and the materials of its meshes that read them. */
export class VertexStage {
  readonly #changes: BodyChanges;
  readonly #texture: DataTexture;
  readonly #meshes: StagedMesh[];
  readonly #rows: DataTexture[] = [];

  constructor(changes: BodyChanges, surfaces: readonly StagedSurface[]) {
    this.#changes = changes;
    this.#texture = textureOf(changes);
    this.#meshes = surfaces.flatMap(({ meshes, rows }) => {
      const texture = textureOf(rows);
      this.#rows.push(texture);
      const uniforms = {
        dynaskinChanges: { value: this.#texture },
        dynaskinRows: { value: texture },
      };
      const mirrors = new Mirrors(uniforms);
      return meshes.map((mesh) => new StagedMesh(mesh, mirrors));
    });
  }

  /** Hands over the changes. */
  upload(): void {
    // Their place in memory changes as it grows.
    this.#texture.image.data = this.#changes.data;
    this.#texture.needsUpdate = true;
  }

  detach(): void {
    for (const mesh of this.#meshes) mesh.detach();
    for (const texture of [this.#texture, ...this.#rows]) texture.dispose();
  }
}

function textureOf({ data, width, height }: FloatTexels): DataTexture {
  const texture = new DataTexture(data, width, height, undefined, FloatType);
  texture.needsUpdate = true;
  return texture;
}

/** The mirrors of materials with the textures of one surface. */
class Mirrors {
  readonly #uniforms: Uniforms;
  readonly #known = new Map<Material, Material>();

  constructor(uniforms: Uniforms) {
    this.#uniforms = uniforms;
  }

  of(material: Material): Material {
    const source = plainMaterial(material);
    const known = this.#known.get(source);
    if (known) return known;
    checkMaterial(source);
    const mirror = mirrorMaterial(source, this.#uniforms);
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
class StagedMesh {
  readonly #mesh: SkinnedMesh;
  readonly #hooks: Restorable[] = [];
  readonly #unused: Material[] = [];

  constructor(mesh: SkinnedMesh, mirrors: Mirrors) {
    this.#mesh = mesh;
    this.#mirrorMaterial(mirrors);
    // The renderer's own materials for shadows know nothing of tissue.
    const depth = mesh.customDepthMaterial ?? this.#own(new MeshDepthMaterial());
    const distance = mesh.customDistanceMaterial ?? this.#own(new MeshDistanceMaterial());
    const before = mesh.onBeforeRender;
    this.#hooks.push(
      hook(mesh, "customDepthMaterial", mirrors.of(depth)),
      hook(mesh, "customDistanceMaterial", mirrors.of(distance)),
      hook(mesh, "onBeforeRender", function (this: Object3D, ...args) {
        checkRenderer(args[0]);
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

function checkRenderer(renderer: unknown): void {
  if ((renderer as { isWebGLRenderer?: boolean } | null)?.isWebGLRenderer) return;
  throw new DynaSkinError(
    "argument",
    'write: "texture" is for WebGLRenderer: other renderers compile materials by themselves. Leave write out.',
  );
}
