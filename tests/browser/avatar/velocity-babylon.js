import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { LoadAssetContainerAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { PassPostProcess } from "@babylonjs/core/PostProcesses/passPostProcess.js";
import "@babylonjs/core/Rendering/prePassRendererSceneComponent.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/core/Engines/Extensions/engine.multiRender.js";
import "@babylonjs/core/Engines/WebGPU/Extensions/engine.multiRender.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { AvatarTissue, bindAvatar, DynaSkin } from "dynaskin/babylon";
import { MODEL_URL } from "./stage.js";
import { compareVelocity, PIXELS } from "./velocity.js";

/** Babylon's number for the texture of motion vectors as half floats; those that motion blur reads are bytes. */
const VELOCITY_LINEAR = 11;

/** See `compareVelocity`. */
export async function compare(way, webgpu) {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width: PIXELS, height: PIXELS });
  document.body.append(canvas);
  const engine = await createEngine(canvas, webgpu);
  const scene = new Scene(engine);
  scene.useRightHandedSystem = true;
  scene.clearColor = new Color4(0, 0, 0, 1);
  const camera = new FreeCamera("camera", new Vector3(0.6, 1.1, 3.8), scene);
  Object.assign(camera, { minZ: 1, maxZ: 8, fov: (24 * Math.PI) / 180 });
  camera.setTarget(new Vector3(0, 0.95, 0));
  new HemisphericLight("sky", new Vector3(0, 1, 0), scene);
  const container = await LoadAssetContainerAsync(`${MODEL_URL}body.glb`, scene);
  container.addAllToScene();
  const root = container.meshes[0];
  const mesh = container.meshes.find(({ skeleton }) => skeleton);
  // Babylon knows previous bones of uniforms only.
  mesh.skeleton.useTextureToStoreBoneMatrices = false;
  // What asks for the vectors; its picture is the scene's.
  const pass = new PassPostProcess("velocity", 1, camera);
  pass.setPrePassRenderer = (prePass) => {
    prePass.addEffectConfiguration({
      name: "velocity",
      enabled: true,
      texturesRequired: [VELOCITY_LINEAR],
    });
    return true;
  };
  scene.enablePrePassRenderer();
  const frame = async () => {
    await new Promise(requestAnimationFrame);
    engine.beginFrame();
    scene.render();
    engine.endFrame();
  };
  let binding;
  let skin = null;
  return compareVelocity(
    {
      async play(model, how, motionVectors) {
        if (how === "DynaSkin") {
          skin = new DynaSkin(model.createAvatar(), mesh, { motionVectors });
          return skin;
        }
        // As it was loaded, before it is posed.
        binding ??= await bindAvatar(model, root, { depicts: "adult", worker: false });
        return new AvatarTissue(model, root, binding, { write: how, motionVectors });
      },
      async draw() {
        await scene.whenReadyAsync();
        await frame();
      },
      async read() {
        const { prePassRenderer } = scene;
        const texture =
          prePassRenderer.getRenderTarget().textures[prePassRenderer.getIndex(VELOCITY_LINEAR)];
        const numbers = await texture.readPixels();
        return (x, y) => {
          const at = 4 * (y * PIXELS + x);
          // Half the way back.
          return [0, 1].map((axis) => -2 * numbers[at + axis]);
        };
      },
      places() {
        const view = scene.getTransformMatrix();
        const world = mesh.getWorldMatrix();
        const all = world.multiply(view);
        // What a card has decoded, Babylon's own functions do not know.
        if (skin?.isDecodedOnCard) {
          mesh.geometry.getVerticesData("position", false, false).set(skin.avatar.positions);
        }
        const positions = mesh.getPositionData(true, true);
        const place = new Vector3();
        return Float32Array.from(
          Array.from({ length: positions.length / 3 }, (_, vertex) => {
            Vector3.TransformCoordinatesFromFloatsToRef(
              ...positions.slice(3 * vertex, 3 * vertex + 3),
              all,
              place,
            );
            return place.asArray();
          }).flat(),
        );
      },
      morph(influence) {
        const target = mesh.morphTargetManager?.getTarget(0);
        if (target) target.influence = influence;
      },
    },
    way,
  );
}

async function createEngine(canvas, webgpu) {
  if (!webgpu) return new Engine(canvas, false);
  const { WebGPUEngine } = await import("@babylonjs/core/Engines/webgpuEngine.js");
  const engine = new WebGPUEngine(canvas);
  await engine.initAsync();
  return engine;
}
