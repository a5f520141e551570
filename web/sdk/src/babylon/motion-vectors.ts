// Where vertices were in the frame before, for the motion vectors of Babylon's pre-pass.

import type { Material } from "@babylonjs/core/Materials/material.js";
import type { AbstractMesh } from "@babylonjs/core/Meshes/abstractMesh.js";
import type { Geometry } from "@babylonjs/core/Meshes/geometry.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { Scene } from "@babylonjs/core/scene.js";
import { PluggedMeshes, type PluginKind, SharedPlugin } from "./shared-plugin.js";

/** Name of the attribute in geometries of ours. */
export const PREVIOUS = "dynaskinPrevious";
const PLUGIN = "dynaskin motion";
/** Babylon's number for the language of WebGPU. */
const WGSL = 1;

/** Numbers of a surface as the last picture has them. */
export class LastPicture {
  readonly #present: Float32Array;
  readonly #hand: (numbers: Float32Array) => void;
  readonly #observers: { remove(): void }[];
  #isFirst = true;
  #isMoved = false;
  /** Whether a picture has what is present. */
  #isDrawn = false;
  #isShown = false;

  /**
   * @param numbers - as they are where nothing has moved yet
   * @param hand - hands numbers over to the graphics card
   */
  constructor(numbers: Float32Array, scene: Scene, hand: (numbers: Float32Array) => void) {
    this.#present = numbers.slice();
    this.#hand = hand;
    this.#observers = [
      scene.onBeforeRenderObservable.add(() => this.#begin()),
      scene.onAfterRenderObservable.add(() => {
        this.#isDrawn = true;
        this.#isShown = true;
      }),
    ];
  }

  /** Whether there was a picture since. */
  get isShown(): boolean {
    return this.#isShown;
  }

  /** Is told of the numbers that are shown from now on. */
  follow(numbers: Float32Array): void {
    this.#begin();
    this.#present.set(numbers);
    this.#isMoved = true;
    if (!this.#isFirst) return;
    // Before the first picture nothing was anywhere else.
    this.#isFirst = false;
    this.#hand(numbers);
  }

  dispose(): void {
    for (const observer of this.#observers) observer.remove();
  }

  /** What was drawn moves on. Not earlier: WebGPU draws after everything that is handed over in a frame. */
  #begin(): void {
    if (!this.#isDrawn) return;
    this.#isDrawn = false;
    if (!this.#isMoved) return;
    this.#isMoved = false;
    this.#hand(this.#present);
  }
}

/**
 * Gives a geometry its positions before skinning as the last picture has them.
 *
 * @param positions - those of the geometry, `[vertex][3]`
 */
export function keepPositions(
  geometry: Geometry,
  positions: Float32Array,
  scene: Scene,
): LastPicture {
  geometry.setVerticesData(PREVIOUS, positions.slice(), true, 3);
  return new LastPicture(positions, scene, (numbers) => {
    geometry.updateVerticesData(PREVIOUS, numbers, false);
  });
}

/** Lets the materials of meshes read what {@link keepPositions} keeps; those that take no plugins stay as they are. */
export function plugMotionVectors(meshes: readonly Mesh[]): PluggedMeshes {
  const plugged = new PluggedMeshes(KIND);
  for (const mesh of meshes) plugged.add(mesh);
  return plugged;
}

const KIND: PluginKind = {
  name: PLUGIN,
  make: (material) => new MotionPlugin(material),
  refusal: null,
};

/** Moves what a material takes for the previous positions of meshes with tissue. */
class MotionPlugin extends SharedPlugin {
  constructor(material: Material) {
    super(material, PLUGIN, ["DYNASKIN_PREVIOUS"]);
  }

  override getClassName(): string {
    return "DynaSkinMotionPlugin";
  }

  override isCompatible(): boolean {
    return true;
  }

  protected override definesOf(mesh: AbstractMesh): Record<string, boolean> {
    return { DYNASKIN_PREVIOUS: this.users > 0 && mesh.isVerticesDataPresent(PREVIOUS) };
  }

  override getAttributes(attributes: string[], _: Scene, mesh: AbstractMesh): void {
    if (mesh.isVerticesDataPresent(PREVIOUS)) attributes.push(PREVIOUS);
  }

  override getCustomCode(shaderType: string, language?: number): Record<string, string> | null {
    if (shaderType !== "vertex") return null;
    return language === WGSL ? WGSL_CODE : GLSL_CODE;
  }
}

/** Code that is compiled where a material writes motion vectors of a mesh that `condition` holds for. */
function whereAsked(condition: string, code: string): string {
  return `
#ifdef ${condition}
#ifdef PREPASS
#if defined(PREPASS_VELOCITY) || defined(PREPASS_VELOCITY_LINEAR)
${code}
#endif
#endif
#endif
`;
}

/**
 * GLSL at the end of `main`, where `before` is the previous position before skinning. Babylon knows the previous bones
 * of skeletons whose matrices are uniforms; others count as if they had not moved.
 */
export function previousInGlsl(condition: string, before: string): string {
  const view = "previousViewProjection * finalPreviousWorld";
  return whereAsked(
    condition,
    `
  vCurrentPosition = viewProjection * worldPos;
#if NUM_BONE_INFLUENCERS > 0
#ifdef BONES_VELOCITY_ENABLED
  vPreviousPosition = ${view} * previousInfluence * vec4(${before}, 1.0);
#else
  vPreviousPosition = ${view} * influence * vec4(${before}, 1.0);
#endif
#else
  vPreviousPosition = ${view} * vec4(${before}, 1.0);
#endif`,
  );
}

const GLSL_CODE = {
  CUSTOM_VERTEX_DEFINITIONS: `#ifdef DYNASKIN_PREVIOUS\nattribute vec3 ${PREVIOUS};\n#endif`,
  CUSTOM_VERTEX_MAIN_END: previousInGlsl(
    "DYNASKIN_PREVIOUS",
    `positionUpdated + ${PREVIOUS} - position`,
  ),
};

const WGSL_BEFORE = `vec4f(positionUpdated + vertexInputs.${PREVIOUS} - vertexInputs.position, 1.0)`;
const WGSL_VIEW = "uniforms.previousViewProjection * finalPreviousWorld";
const WGSL_CODE = {
  CUSTOM_VERTEX_DEFINITIONS: `#ifdef DYNASKIN_PREVIOUS\nattribute ${PREVIOUS}: vec3f;\n#endif`,
  CUSTOM_VERTEX_MAIN_END: whereAsked(
    "DYNASKIN_PREVIOUS",
    `
  vertexOutputs.vCurrentPosition = scene.viewProjection * worldPos;
#if NUM_BONE_INFLUENCERS > 0
#ifdef BONES_VELOCITY_ENABLED
  vertexOutputs.vPreviousPosition = ${WGSL_VIEW} * previousInfluence * ${WGSL_BEFORE};
#else
  vertexOutputs.vPreviousPosition = ${WGSL_VIEW} * influence * ${WGSL_BEFORE};
#endif
#else
  vertexOutputs.vPreviousPosition = ${WGSL_VIEW} * ${WGSL_BEFORE};
#endif`,
  ),
};
