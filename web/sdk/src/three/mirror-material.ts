// A material that is drawn as another one is, whose vertex stage adds tissue.
import {
  type IUniform,
  Material,
  type ShaderMaterial,
  type WebGLProgramParametersWithUniforms,
} from "three";
import { VERTEX_STAGE } from "../bind/vertex-stage.js";
import { DynaSkinError } from "../error.js";

/** Uniforms by name. */
export type Uniforms = Readonly<Record<string, IUniform>>;

/** Of a material of ours: the one that it stands for, also on clones. */
const sources = new WeakMap<Material, Material>();

/** The material that one of ours stands for; else the material itself. */
export function plainMaterial(material: Material): Material {
  return sources.get(material) ?? material;
}

const POSITION = "#include <skinning_vertex>";
const NORMAL = "#include <skinnormal_vertex>";
const MAIN = /void\s+main\s*\(\s*(?:void)?\s*\)\s*\{/;

/** After morph targets and before skinning, as attributes with tissue would be. */
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

/**
 * Refuses a material whose vertex stage cannot add tissue.
 *
 * @throws DynaSkinError `argument`
 */
export function checkMaterial(material: Material): void {
  const { vertexShader, isShaderMaterial } = material as ShaderMaterial;
  if ("isNodeMaterial" in material) {
    throw unfit(material, "is a node material");
  }
  if (isShaderMaterial && !(vertexShader.includes(POSITION) && MAIN.test(vertexShader))) {
    throw unfit(material, `has a vertex shader without "${POSITION}"`);
  }
}

function unfit({ name, type }: Material, why: string): DynaSkinError {
  return new DynaSkinError(
    "argument",
    `The material ${name || "without a name"} (${type}) ${why}, to which write: "texture" cannot add tissue. ` +
      "Leave write out, give the mesh a standard material of three.js, or exclude it.",
  );
}

/** Adds the tissue to a vertex shader of three.js. */
function withTissue(material: Material, shader: string): string {
  if (!shader.includes(POSITION) || !MAIN.test(shader)) {
    throw unfit(material, `has an onBeforeCompile that takes "${POSITION}" away`);
  }
  const read = shader.replace(MAIN, (main) => `${VERTEX_STAGE}\n${main}\ndynaskinRead();\n`);
  return read.replace(POSITION, ADD_POSITION).replace(NORMAL, ADD_NORMAL);
}

/** What a mirror has of its own, of all that materials have. */
const OWN = new Set(["uniforms", "onBeforeCompile", "customProgramCacheKey", "_listeners"]);

/**
 * A material that reads and writes everything in `source`, so that whoever changes either changes both, but is
 * compiled with tissue and has uniforms beside those of `source`, which stays as it is. `dispose()` frees what was
 * compiled for it and leaves `source`.
 */
export function mirrorMaterial<Kind extends Material>(source: Kind, uniforms: Uniforms): Kind {
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
      shader.vertexShader = withTissue(source, shader.vertexShader);
    },
    customProgramCacheKey: () => `${source.customProgramCacheKey()} dynaskin`,
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
