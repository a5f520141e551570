import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { WebGPUEngine } from "@babylonjs/core/Engines/webgpuEngine.js";
import { DirectionalLight } from "@babylonjs/core/Lights/directionalLight.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { ShadowGenerator } from "@babylonjs/core/Lights/Shadows/shadowGenerator.js";
import "@babylonjs/core/Lights/Shadows/shadowGeneratorSceneComponent.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
// The wall's material.
import "@babylonjs/core/Materials/standardMaterial.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreatePlane } from "@babylonjs/core/Meshes/Builders/planeBuilder.js";
import { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { DynaSkin } from "dynaskin/babylon";
import { APART_M, MODEL_URL, playOnCard, SIZE, webGl, webGpu } from "./stage.js";

/**
 * See `playOnCard`; a shadow generator draws the meshes too.
 *
 * @param onWebGpu - with `WebGPUEngine`
 */
export function playInBabylon(onWebGpu) {
  return playOnCard(async (avatars) => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = SIZE;
    document.body.append(canvas);
    const engine = onWebGpu
      ? new WebGPUEngine(canvas)
      : new Engine(canvas, false, { preserveDrawingBuffer: true });
    await engine.initAsync?.();
    const scene = new Scene(engine);
    const camera = new FreeCamera("camera", new Vector3(-1, 1.1, 3.4), scene);
    camera.setTarget(new Vector3(0, 0.95, 0));
    camera.fov = 0.66;
    const sun = new DirectionalLight("sun", new Vector3(2, -3, -5), scene);
    sun.position = new Vector3(-2, 3, 5);
    sun.intensity = 0.6;
    new HemisphericLight("sky", new Vector3(0, 1, 0), scene).intensity = 0.3;
    const shadows = new ShadowGenerator(1024, sun);
    shadows.usePercentageCloserFiltering = true;
    shadows.bias = 0.01;
    const wall = CreatePlane("wall", { size: 8, sideOrientation: Mesh.DOUBLESIDE }, scene);
    wall.position.z = -0.5;
    wall.receiveShadows = true;
    const meshes = [];
    for (const idx of avatars.keys()) {
      const { meshes: loaded } = await ImportMeshAsync(`${MODEL_URL}body.glb`, scene);
      loaded[0].position.x = (idx - 1) * APART_M;
      const mesh = loaded.find(({ skeleton }) => skeleton);
      mesh.receiveShadows = true;
      shadows.addShadowCaster(mesh);
      meshes.push(mesh);
    }
    const own = meshes.map(({ geometry }) => geometry);
    const skins = avatars.map((avatar, idx) => new DynaSkin(avatar, meshes[idx]));
    await scene.whenReadyAsync();
    const gl = onWebGpu ? null : engine._gl;
    const gpu = gl ? webGl(gl) : webGpu(engine._device, canvas);
    const buffer = (idx, kind) =>
      meshes[idx].geometry.getVertexBuffer(kind).getBuffer().underlyingResource;
    const draw = () => {
      engine.beginFrame();
      scene.render();
      engine.endFrame();
      if (!gl) return gpu.pixels();
      const pixels = new Uint8Array(4 * SIZE[0] * SIZE[1]);
      gl.readPixels(0, 0, ...SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      return pixels;
    };
    return {
      skins,
      gpu,
      draw,
      buffers: (idx) => ({ positions: buffer(idx, "position"), normals: buffer(idx, "normal") }),
      order: () => null,
      numbers: () => null,
      plain: (idx) => meshes[idx].geometry === own[idx],
    };
  });
}
