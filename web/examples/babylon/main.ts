// dynaskin in Babylon.js: the glTF loader brings the body, DynaSkin moves its soft tissue.
// ?engine=webgpu takes WebGPUEngine.
import { ArcRotateCamera } from "@babylonjs/core/Cameras/arcRotateCamera.js";
import type { AbstractEngine } from "@babylonjs/core/Engines/abstractEngine.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { DirectionalLight } from "@babylonjs/core/Lights/directionalLight.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { ShadowGenerator } from "@babylonjs/core/Lights/Shadows/shadowGenerator.js";
import "@babylonjs/core/Lights/Shadows/shadowGeneratorSceneComponent.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { PBRMaterial } from "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial.js";
import { Color3, Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreateGround } from "@babylonjs/core/Meshes/Builders/groundBuilder.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { load, Motion } from "dynaskin";
import { DynaSkin } from "dynaskin/babylon";
import { showError, showNote } from "../src/shared/note.js";
import "../src/shared/hook.js";

const MODEL = new URL("../female/", location.href);
const SHAPE = [0, 1.5, 0, 0, 0, 0, 0, 0, 0, 0];

const WEBGPU = new URLSearchParams(location.search).get("engine") === "webgpu";

async function createEngine(canvas: HTMLCanvasElement): Promise<AbstractEngine> {
  if (!WEBGPU) return new Engine(canvas, true);
  const { WebGPUEngine } = await import("@babylonjs/core/Engines/webgpuEngine.js");
  if (!(await WebGPUEngine.IsSupportedAsync)) {
    throw new Error("This browser has no WebGPU; leave ?engine=webgpu out.");
  }
  const engine = new WebGPUEngine(canvas, { antialias: true });
  await engine.initAsync();
  return engine;
}

function createScene(engine: AbstractEngine): { scene: Scene; shadows: ShadowGenerator } {
  const scene = new Scene(engine);
  scene.clearColor = new Color4(0.914, 0.902, 0.882, 1);
  const camera = new ArcRotateCamera("camera", 1.25, 1.45, 5, new Vector3(0, 1, 0), scene);
  camera.fov = 0.42;
  camera.minZ = 0.1;
  new HemisphericLight("sky", Vector3.Up(), scene).intensity = 0.7;
  const sun = new DirectionalLight("sun", new Vector3(0.5, -1, -0.8), scene);
  sun.position.set(-2, 4, 3);
  sun.intensity = 2;
  const ground = CreateGround("ground", { width: 5, height: 5 }, scene);
  const grey = new StandardMaterial("grey", scene);
  grey.diffuseColor = new Color3(0.3, 0.29, 0.27);
  grey.specularColor = Color3.Black();
  ground.material = grey;
  ground.receiveShadows = true;
  return { scene, shadows: new ShadowGenerator(2048, sun) };
}

async function main() {
  const canvas = document.querySelector("canvas") as HTMLCanvasElement;
  const engine = await createEngine(canvas);
  const { scene, shadows } = createScene(engine);
  const [model, { meshes }] = await Promise.all([
    load({ model: MODEL }),
    ImportMeshAsync(new URL("body.glb", MODEL).href, scene),
  ]);
  const mesh = meshes.find((candidate) => candidate.skeleton) as Mesh;
  if (mesh.material instanceof PBRMaterial) mesh.material.environmentIntensity = 0;
  shadows.addShadowCaster(mesh);

  const avatar = model.createAvatar({ shape: SHAPE });
  const skin = new DynaSkin(avatar, mesh);
  const motion = Motion.procedural("hop", avatar);
  let timeSeconds = 0;

  function animate(deltaSeconds: number) {
    timeSeconds = (timeSeconds + deltaSeconds) % motion.durationSeconds;
    skin.writePose(motion.poseAt(timeSeconds)); // an AnimationGroup would do as well
    skin.update(deltaSeconds); // after everything that moves bones
  }

  let playing = true;
  scene.onBeforeRenderObservable.add(() => {
    if (playing) animate(engine.getDeltaTime() / 1000);
  });
  engine.runRenderLoop(() => scene.render());
  addEventListener("resize", () => engine.resize());
  showNote(`Babylon.js, ${WEBGPU ? "WebGPU" : "WebGL2"}`, avatar);

  window.dynaskinExample = {
    avatar,
    showMoment(seconds) {
      playing = false;
      timeSeconds = 0;
      avatar.reset();
      for (let tick = 0; tick < seconds * 60; tick += 1) animate(1 / 60);
    },
  };
}

main().catch(showError);
