// dynaskin in three.js: GLTFLoader loads the body, an AnimationMixer plays a clip on its bones, and
// DynaSkin moves the soft tissue. ?renderer=webgpu takes WebGPURenderer.
import { load } from "dynaskin";
import { DynaSkin } from "dynaskin/three";
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { showError, showNote } from "../src/shared/note.js";
import { jumpingJacks } from "./clip.js";
import "../src/shared/hook.js";

const MODEL = new URL("../female/", location.href);
const SHAPE = [0, 1.5, 0, 0, 0, 0, 0, 0, 0, 0];

const WEBGPU = new URLSearchParams(location.search).get("renderer") === "webgpu";

const canvas = document.querySelector("canvas") as HTMLCanvasElement;

async function createRenderer() {
  const options = { canvas, antialias: true };
  if (WEBGPU) {
    const { WebGPURenderer } = await import("three/webgpu");
    const renderer = new WebGPURenderer(options);
    await renderer.init();
    return renderer;
  }
  return new THREE.WebGLRenderer(options);
}

function createScene(): THREE.Scene {
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xe9e6e1);
  const sun = new THREE.DirectionalLight(0xffffff, 2.5);
  sun.position.set(-1.5, 3, 2.5);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.camera.top = 2;
  sun.shadow.camera.bottom = -2;
  sun.shadow.normalBias = 0.02;
  const floor = new THREE.Mesh(
    new THREE.CircleGeometry(3, 64).rotateX(-Math.PI / 2),
    new THREE.MeshStandardMaterial({ color: 0xcfcac2 }),
  );
  floor.receiveShadow = true;
  scene.add(sun, new THREE.HemisphereLight(0xffffff, 0xb0a090, 1.5), floor);
  return scene;
}

async function main() {
  const [renderer, model, gltf] = await Promise.all([
    createRenderer(),
    load({ model: MODEL }),
    new GLTFLoader().loadAsync(new URL("body.glb", MODEL).href),
  ]);
  renderer.shadowMap.enabled = true;
  const scene = createScene();
  const camera = new THREE.PerspectiveCamera(24, 1, 0.1, 50);
  camera.position.set(1.6, 1.5, 4.6);
  camera.lookAt(0, 1, 0);

  const mesh = gltf.scene.getObjectByProperty("isSkinnedMesh", true) as THREE.SkinnedMesh;
  mesh.castShadow = true;
  scene.add(gltf.scene);
  const avatar = model.createAvatar({ shape: SHAPE });
  const skin = new DynaSkin(avatar, mesh);

  const mixer = new THREE.AnimationMixer(gltf.scene);
  const action = mixer.clipAction(jumpingJacks(avatar, skin)).play();

  function animate(deltaSeconds: number) {
    mixer.update(deltaSeconds);
    skin.update(deltaSeconds); // after everything that moves bones
  }

  function onResize() {
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(innerWidth, innerHeight, false);
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
  }
  addEventListener("resize", onResize);
  onResize();

  const timer = new THREE.Timer();
  let playing = true;
  renderer.setAnimationLoop((timeMs: number) => {
    timer.update(timeMs);
    if (playing) animate(timer.getDelta());
    renderer.render(scene, camera);
  });
  showNote(`three.js, ${WEBGPU ? "WebGPURenderer" : "WebGLRenderer"}`, avatar);

  window.dynaskinExample = {
    avatar,
    showMoment(seconds) {
      playing = false;
      action.reset();
      avatar.reset();
      for (let tick = 0; tick < seconds * 60; tick += 1) animate(1 / 60);
    },
  };
}

main().catch(showError);
