// Tissue that the vertex stage of WebGLRenderer's materials adds.
import { DataTexture, FloatType, type SkinnedMesh } from "three";
import { type BodyChanges, type FloatTexels, VERTEX_STAGE } from "../bind/vertex-stage.js";
import { checkMaterial, MAIN, type Uniforms, type VertexEdit } from "./mirror-material.js";
import { materialsOf } from "./read-avatar.js";
import { Mirrors, StagedMesh } from "./staged-mesh.js";

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
  const edit = tissueEdit({});
  for (const mesh of meshes) {
    for (const material of materialsOf(mesh)) checkMaterial(material, edit);
  }
  return [...NOTES];
}

/** The textures of an avatar's tissue, and the materials of its meshes that read them. */
export class VertexStage {
  readonly #changes: BodyChanges;
  readonly #texture: DataTexture;
  readonly #meshes: StagedMesh[];
  readonly #rows: DataTexture[] = [];
  readonly #mirrors: Mirrors[] = [];

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
      const mirrors = new Mirrors(tissueEdit(uniforms));
      this.#mirrors.push(mirrors);
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
    for (const mirrors of this.#mirrors) mirrors.dispose();
    for (const texture of [this.#texture, ...this.#rows]) texture.dispose();
  }
}

function textureOf({ data, width, height }: FloatTexels): DataTexture {
  const texture = new DataTexture(data, width, height, undefined, FloatType);
  texture.needsUpdate = true;
  return texture;
}

/** After morph targets and before skinning, as attributes with tissue would be. */
const POSITION = "#include <skinning_vertex>";
const NORMAL = "#include <skinnormal_vertex>";
const ADD_POSITION = `transformed += dynaskinOffset;\n${POSITION}`;
const ADD_NORMAL = `
{
  vec3 dynaskinOwn = dynaskinUnit(normal + dynaskinNormal, normal);
  objectNormal += dynaskinOwn - normal;
  #ifdef USE_TANGENT
  vec3 dynaskinWithin = tangent.xyz - dynaskinOwn * dot(tangent.xyz, dynaskinOwn);
  objectTangent += dynaskinUnit(dynaskinWithin, tangent.xyz) - tangent.xyz;
  #endif
}
${NORMAL}`;

/** Adds the tissue to a vertex shader of three.js. */
function tissueEdit(uniforms: Uniforms): VertexEdit {
  return {
    key: "dynaskin",
    needs: POSITION,
    refusal: 'write: "texture" cannot add tissue',
    otherwise: "Leave write out, give the mesh a standard material of three.js, or exclude it.",
    otherRenderer:
      'write: "texture" is for WebGLRenderer: other renderers compile materials by themselves. Leave write out.',
    uniforms,
    apply(shader) {
      const read = shader.replace(MAIN, (main) => `${VERTEX_STAGE}\n${main}\ndynaskinRead();\n`);
      return read.replace(POSITION, ADD_POSITION).replace(NORMAL, ADD_NORMAL);
    },
  };
}
