// Tissue that the vertex stage of Babylon's standard materials adds.

import type { AbstractEngine } from "@babylonjs/core/Engines/abstractEngine.js";
import type { Material } from "@babylonjs/core/Materials/material.js";
import { RawTexture } from "@babylonjs/core/Materials/Textures/rawTexture.js";
import { Texture } from "@babylonjs/core/Materials/Textures/texture.js";
import type { UniformBuffer } from "@babylonjs/core/Materials/uniformBuffer.js";
import type { AbstractMesh } from "@babylonjs/core/Meshes/abstractMesh.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { SubMesh } from "@babylonjs/core/Meshes/subMesh.js";
import type { Scene } from "@babylonjs/core/scene.js";
import { type BodyChanges, type FloatTexels, VERTEX_STAGE } from "../bind/vertex-stage.js";
import { LastPicture, previousInGlsl } from "./motion-vectors.js";
import {
  checkMesh,
  PluggedMeshes,
  type PluginKind,
  type Refusal,
  ShapingPlugin,
} from "./shared-plugin.js";

/** What the tissue of a vertex stage does not reach. */
const NOTES = [
  "Picking and getPositionData meet the skin without tissue: they read vertices, which stay as they are.",
  "Outlines, highlights and passes with shaders of their own, such as depth and geometry buffers, draw the skin without tissue.",
  "Clones and instances without an AvatarTissue of their own show the skin without tissue.",
];

/** Babylon's number for textures of floats. */
const FLOATS = 1;
const PLUGIN = "dynaskin";

const REFUSAL: Refusal = {
  what: 'write: "texture" cannot add tissue',
  otherwise: "Leave write out, give the mesh a StandardMaterial or a PBRMaterial, or exclude it.",
  otherEngine:
    'write: "texture" is for Babylon\'s engine with WebGL 2, and this is another one. Leave write out.',
};

const KIND: PluginKind = {
  name: PLUGIN,
  make: (material) => new TissuePlugin(material),
  refusal: REFUSAL,
};

/** What a mesh's vertices read. */
interface Textures {
  readonly changes: RawTexture;
  readonly rows: RawTexture;
  /** The changes of the last picture. */
  readonly before: RawTexture | null;
}

/** Of meshes with tissue. */
const staged = new WeakMap<AbstractMesh, Textures>();

/** Meshes that show one surface, and what its vertices take. */
export interface StagedSurface {
  readonly meshes: readonly Mesh[];
  readonly rows: FloatTexels;
}

/**
 * Refuses what has no vertex stage that takes tissue; gives what is left out.
 *
 * @throws DynaSkinError `argument`
 */
export function checkMeshes(meshes: readonly Mesh[]): string[] {
  for (const mesh of meshes) checkMesh(mesh, REFUSAL);
  return [...NOTES];
}

/** The textures of an avatar's tissue, and the materials of its meshes that read them. */
export class VertexStage {
  readonly #changes: BodyChanges;
  readonly #texture: RawTexture | null = null;
  /** The changes of the last picture, for motion vectors. */
  readonly #before: RawTexture | null = null;
  readonly #lastPicture: LastPicture | null = null;
  readonly #rows: RawTexture[] = [];
  readonly #meshes: Mesh[] = [];
  readonly #plugged = new PluggedMeshes(KIND);

  constructor(
    changes: BodyChanges,
    surfaces: readonly StagedSurface[],
    { motionVectors }: { motionVectors: boolean },
  ) {
    this.#changes = changes;
    const scene = surfaces[0]?.meshes[0]?.getScene();
    if (!scene) return;
    this.#texture = textureOf(changes, scene);
    if (motionVectors) {
      const before = textureOf(changes, scene);
      this.#before = before;
      this.#lastPicture = new LastPicture(changes.data, scene, (data) => before.update(data));
    }
    for (const { meshes, rows } of surfaces) {
      const texture = textureOf(rows, scene);
      this.#rows.push(texture);
      for (const mesh of meshes) {
        staged.set(mesh, { changes: this.#texture, rows: texture, before: this.#before });
        this.#meshes.push(mesh);
        this.#plugged.add(mesh);
      }
    }
  }

  /** Hands over the changes. */
  upload(): void {
    const { data } = this.#changes;
    this.#texture?.update(data);
    this.#lastPicture?.follow(data);
  }

  detach(): void {
    for (const mesh of this.#meshes) staged.delete(mesh);
    this.#plugged.dispose();
    for (const texture of this.#rows) texture.dispose();
    this.#texture?.dispose();
    this.#lastPicture?.dispose();
    this.#before?.dispose();
  }
}

function textureOf({ data, width, height }: FloatTexels, scene: Scene): RawTexture {
  const sampling = Texture.NEAREST_SAMPLINGMODE;
  const texture = RawTexture.CreateRGBATexture(
    ...([data, width, height, scene, false, false, sampling, FLOATS] as const),
  );
  texture.name = PLUGIN;
  return texture;
}

/** Adds tissue to a material, on meshes that have any; other meshes are drawn as without it. */
class TissuePlugin extends ShapingPlugin {
  constructor(material: Material) {
    super(material, PLUGIN, ["DYNASKIN", "DYNASKIN_BEFORE"]);
    // Of meshes that share a material, each has textures of its own.
    this.registerForExtraEvents = true;
  }

  override getClassName(): string {
    return "DynaSkinTissuePlugin";
  }

  protected override definesOf(mesh: AbstractMesh): Record<string, boolean> {
    const textures = staged.get(mesh);
    return { DYNASKIN: textures !== undefined, DYNASKIN_BEFORE: textures?.before != null };
  }

  override getSamplers(samplers: string[]): void {
    samplers.push("dynaskinChanges", "dynaskinRows", "dynaskinBefore");
  }

  override hardBindForSubMesh(
    _buffer: UniformBuffer,
    _scene: Scene,
    _engine: AbstractEngine,
    subMesh: SubMesh,
  ): void {
    const textures = staged.get(subMesh.getMesh());
    if (!textures) return;
    subMesh.effect?.setTexture("dynaskinChanges", textures.changes);
    subMesh.effect?.setTexture("dynaskinRows", textures.rows);
    if (textures.before) subMesh.effect?.setTexture("dynaskinBefore", textures.before);
  }

  override getCustomCode(shaderType: string): Record<string, string> | null {
    return shaderType === "vertex" ? VERTEX_CODE : null;
  }
}

const VERTEX_CODE = {
  CUSTOM_VERTEX_DEFINITIONS: `
#ifdef DYNASKIN
${VERTEX_STAGE}
#ifdef DYNASKIN_BEFORE
uniform highp sampler2D dynaskinBefore;
vec3 dynaskinOffsetBefore() {
  vec3 offset = vec3(0.0);
  vec3 normal = vec3(0.0);
  dynaskinReadFrom(dynaskinBefore, offset, normal);
  return offset;
}
#endif
#endif
`,
  CUSTOM_VERTEX_MAIN_END: previousInGlsl(
    "DYNASKIN_BEFORE",
    "positionUpdated - dynaskinOffset + dynaskinOffsetBefore()",
  ),
  CUSTOM_VERTEX_UPDATE_POSITION: `
#ifdef DYNASKIN
  dynaskinRead();
  positionUpdated += dynaskinOffset;
#endif
`,
  CUSTOM_VERTEX_UPDATE_NORMAL: `
#ifdef DYNASKIN
#ifdef NORMAL
  vec3 dynaskinOwn = dynaskinUnit(normal + dynaskinNormal, normal);
  normalUpdated += dynaskinOwn - normal;
#ifdef TANGENT
  vec3 dynaskinWithin = tangent.xyz - dynaskinOwn * dot(tangent.xyz, dynaskinOwn);
  tangentUpdated.xyz += dynaskinUnit(dynaskinWithin, tangent.xyz) - tangent.xyz;
#endif
#endif
#endif
`,
};
