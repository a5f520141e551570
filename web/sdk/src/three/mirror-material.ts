// A material that is drawn as another one is, with something added to its vertex stage.
import {
  type IUniform,
  Material,
  type ShaderMaterial,
  type WebGLProgramParametersWithUniforms,
} from "three";
import { DynaSkinError } from "../error.js";

/** Uniforms by name. */
export type Uniforms = Readonly<Record<string, IUniform>>;

/** Of a material of ours: the one that it stands for, also on clones. */
const sources = new WeakMap<Material, Material>();

/** The material that one of ours stands for; else the material itself. */
export function plainMaterial(material: Material): Material {
  return sources.get(material) ?? material;
}

/** What is added to the vertex stage of materials. */
export interface VertexEdit {
  /** Names it among compiled programs. */
  readonly key: string;
  /** The part of three's shaders without which nothing can be added. */
  readonly needs: string;
  /** What cannot be done to an unfit material, as a part of a message: "write: ... cannot add tissue". */
  readonly refusal: string;
  /** The sentence behind it: what to do instead. */
  readonly otherwise: string;
  /** What is said where another renderer than `WebGLRenderer` draws the mesh. */
  readonly otherRenderer: string;
  /** Beside the material's own. */
  readonly uniforms: Uniforms;
  /** Adds it to a shader that has {@link needs} and a `main`. */
  apply(shader: string): string;
}

/** Where a vertex shader begins to run. */
export const MAIN = /void\s+main\s*\(\s*(?:void)?\s*\)\s*\{/;

/**
 * Refuses a material to whose vertex stage nothing can be added.
 *
 * @throws DynaSkinError `argument`
 */
export function checkMaterial(material: Material, edit: VertexEdit): void {
  const { vertexShader, isShaderMaterial } = material as ShaderMaterial;
  if ("isNodeMaterial" in material) {
    throw unfit(material, edit, "is a node material");
  }
  if (isShaderMaterial && !fits(vertexShader, edit)) {
    throw unfit(material, edit, `has a vertex shader without "${edit.needs}"`);
  }
}

function fits(shader: string, { needs }: VertexEdit): boolean {
  return shader.includes(needs) && MAIN.test(shader);
}

function unfit({ name, type }: Material, edit: VertexEdit, why: string): DynaSkinError {
  return new DynaSkinError(
    "argument",
    `The material ${name || "without a name"} (${type}) ${why}, to which ${edit.refusal}. ` +
      edit.otherwise,
  );
}

/** What a mirror has of its own, of all that materials have. */
const OWN = new Set(["uniforms", "onBeforeCompile", "customProgramCacheKey", "_listeners"]);

/**
 * A material that reads and writes everything in `source`, so that whoever changes either changes both, but is
 * compiled with `edit` and has uniforms beside those of `source`, which stays as it is. `dispose()` frees what was
 * compiled for it and leaves `source`.
 */
export function mirrorMaterial<Kind extends Material>(source: Kind, edit: VertexEdit): Kind {
  const { uniforms } = edit;
  const mirror = Object.create(source) as Kind;
  for (const key of Object.keys(source)) {
    if (OWN.has(key)) continue;
    Object.defineProperty(mirror, key, {
      get: () => source[key as keyof Kind],
      set: (value) => {
        source[key as keyof Kind] = value;
      },
      enumerable: true,
    });
  }
  // Everything of the renderer's is kept by number, and freed where the material's listeners are told.
  const own = {
    ...{ id: new Material().id, _listeners: undefined },
    onBeforeCompile(shader: WebGLProgramParametersWithUniforms, renderer: never) {
      source.onBeforeCompile(shader, renderer);
      Object.assign(shader.uniforms, uniforms);
      if (!fits(shader.vertexShader, edit)) {
        throw unfit(source, edit, `has an onBeforeCompile that takes "${edit.needs}" away`);
      }
      shader.vertexShader = edit.apply(shader.vertexShader);
    },
    customProgramCacheKey: () => `${source.customProgramCacheKey()} ${edit.key}`,
  };
  for (const [key, value] of Object.entries(own)) {
    Object.defineProperty(mirror, key, { value, writable: true, configurable: true });
  }
  const ofShader = (source as unknown as ShaderMaterial).uniforms;
  if (ofShader) {
    // Names are looked up in it, those of the source too.
    Object.defineProperty(mirror, "uniforms", {
      value: Object.assign(Object.create(ofShader), uniforms),
      writable: true,
    });
  }
  sources.set(mirror, source);
  return mirror;
}
