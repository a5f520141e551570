import { Camera } from "@babylonjs/core/Cameras/camera.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { DirectionalLight } from "@babylonjs/core/Lights/directionalLight.js";
import { ShadowGenerator } from "@babylonjs/core/Lights/Shadows/shadowGenerator.js";
import "@babylonjs/core/Lights/Shadows/shadowGeneratorSceneComponent.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial.js";
import { Color3 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreateGround } from "@babylonjs/core/Meshes/Builders/groundBuilder.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { DynaSkin } from "dynaskin/babylon";
import {
  CAMERA_M,
  compareShadows,
  HALF_M,
  LIGHT,
  MIDDLE_M,
  MODEL_URL,
  NEAR_M,
  SIZE,
} from "./stage.js";

async function createEngine(canvas, webgpu) {
  if (!webgpu) return new Engine(canvas, true, { preserveDrawingBuffer: true });
  const { WebGPUEngine } = await import("@babylonjs/core/Engines/webgpuEngine.js");
  const engine = new WebGPUEngine(canvas, { antialias: true });
  await engine.initAsync();
  return engine;
}

/** The shadow that Babylon.js throws; see `compareShadows`. */
export function compareInBabylon(webgpu) {
  return compareShadows(async (avatar) => {
    const canvas = document.createElement("canvas");
    canvas.width = SIZE;
    canvas.height = SIZE;
    document.body.append(canvas);
    const scene = new Scene(await createEngine(canvas, webgpu));
    // As glTF and dynaskin have it, so that the picture needs no mirroring.
    scene.useRightHandedSystem = true;
    const [x, z] = MIDDLE_M;
    const camera = new FreeCamera("camera", new Vector3(x, CAMERA_M, z), scene);
    camera.minZ = NEAR_M;
    camera.mode = Camera.ORTHOGRAPHIC_CAMERA;
    Object.assign(camera, { orthoLeft: -HALF_M, orthoRight: HALF_M });
    Object.assign(camera, { orthoBottom: -HALF_M, orthoTop: HALF_M });
    camera.upVector = new Vector3(0, 0, -1);
    camera.setTarget(new Vector3(x, 0, z));
    const sun = new DirectionalLight("sun", new Vector3(...LIGHT), scene);
    sun.position = new Vector3(...LIGHT).scale(-4);
    sun.intensity = 2;
    sun.autoCalcShadowZBounds = true;
    const shadows = new ShadowGenerator(2048, sun);
    shadows.usePercentageCloserFiltering = true;
    const floor = CreateGround("floor", { width: 6, height: 6 }, scene);
    const white = new StandardMaterial("white", scene);
    white.specularColor = Color3.Black();
    floor.material = white;
    floor.receiveShadows = true;
    const { meshes } = await ImportMeshAsync(`${MODEL_URL}body.glb`, scene);
    const mesh = meshes.find((candidate) => candidate.skeleton);
    shadows.addShadowCaster(mesh);
    await scene.whenReadyAsync();
    const draw = async () => {
      await new Promise(requestAnimationFrame);
      scene.getEngine().beginFrame();
      scene.render();
      scene.getEngine().endFrame();
      return canvas;
    };
    return { skin: new DynaSkin(avatar, mesh), draw };
  });
}
