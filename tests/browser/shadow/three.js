import { DynaSkin } from "dynaskin/three";
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
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

async function createRenderer(webgpu) {
  if (!webgpu) return new THREE.WebGLRenderer({ antialias: true });
  const { WebGPURenderer } = await import("three/webgpu");
  const renderer = new WebGPURenderer({ antialias: true });
  await renderer.init();
  return renderer;
}

/** The shadow that three.js throws; see `compareShadows`. */
export function compareInThree(webgpu) {
  return compareShadows(async (avatar) => {
    const renderer = await createRenderer(webgpu);
    renderer.setSize(SIZE, SIZE);
    renderer.shadowMap.enabled = true;
    document.body.append(renderer.domElement);
    const scene = new THREE.Scene();
    const camera = new THREE.OrthographicCamera(-HALF_M, HALF_M, HALF_M, -HALF_M, NEAR_M, 10);
    const [x, z] = MIDDLE_M;
    camera.up.set(0, 0, -1);
    camera.position.set(x, CAMERA_M, z);
    camera.lookAt(x, 0, z);
    const sun = new THREE.DirectionalLight(0xffffff, 4);
    sun.position.set(...LIGHT).multiplyScalar(-4);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, { left: -1.5, right: 1.5, top: 1.5, bottom: -1.5 });
    const floor = new THREE.Mesh(
      new THREE.PlaneGeometry(6, 6).rotateX(-Math.PI / 2),
      new THREE.MeshLambertMaterial({ color: 0xffffff }),
    );
    floor.receiveShadow = true;
    const gltf = await new GLTFLoader().loadAsync(`${MODEL_URL}body.glb`);
    const mesh = gltf.scene.getObjectByProperty("isSkinnedMesh", true);
    mesh.castShadow = true;
    scene.add(sun, floor, gltf.scene);
    const draw = async () => {
      await new Promise(requestAnimationFrame);
      renderer.render(scene, camera);
      return renderer.domElement;
    };
    return { skin: new DynaSkin(avatar, mesh), draw };
  });
}
