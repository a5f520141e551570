import { DynaSkin } from "dynaskin/three";
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { compareSkinnings, EYE_M, FOV_Y_RADIANS, MODEL_URL, SIZE, TARGET_M } from "./stage.js";

/** Metres of the world in a metre of the body. */
const SCALE = 1.6;

/** See `compareSkinnings`; the body is larger than its own size and its shadow falls on itself and a wall. */
export function compareInThree() {
  return compareSkinnings(async (avatar) => {
    const renderer = new THREE.WebGLRenderer({ antialias: true });
    renderer.setSize(SIZE, SIZE);
    renderer.shadowMap.enabled = true;
    document.body.append(renderer.domElement);
    const scene = new THREE.Scene();
    const camera = new THREE.PerspectiveCamera((FOV_Y_RADIANS * 180) / Math.PI, 1, 0.1, 20);
    camera.position.set(...EYE_M).multiplyScalar(SCALE);
    camera.lookAt(...TARGET_M.map((at) => at * SCALE));
    const sun = new THREE.DirectionalLight(0xffffff, 3);
    sun.position.set(2, 5, 5);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    sun.shadow.normalBias = 0.02;
    const wall = new THREE.Mesh(
      new THREE.PlaneGeometry(8, 8),
      new THREE.MeshLambertMaterial({ color: 0xd8d4cc }),
    );
    wall.position.z = -0.6;
    wall.receiveShadow = true;
    const { scene: body } = await new GLTFLoader().loadAsync(`${MODEL_URL}body.glb`);
    const mesh = body.getObjectByProperty("isSkinnedMesh", true);
    const { material } = mesh;
    const group = new THREE.Group().add(body);
    group.scale.setScalar(SCALE);
    const geometry = mesh.geometry.clone();
    for (const name of ["skinIndex", "skinWeight"]) geometry.deleteAttribute(name);
    geometry.morphAttributes = {};
    const plain = new THREE.Mesh(geometry, material);
    plain.scale.setScalar(SCALE);
    plain.frustumCulled = false;
    for (const each of [mesh, plain])
      Object.assign(each, { castShadow: true, receiveShadow: true });
    scene.add(sun, new THREE.HemisphereLight(0xffffff, 0x907060, 1.5), wall, group, plain);
    const adapter = new DynaSkin(avatar, body);
    const picture = async (shown) => {
      group.visible = shown === mesh;
      plain.visible = shown === plain;
      await new Promise(requestAnimationFrame);
      renderer.render(scene, camera);
      return renderer.domElement.toDataURL();
    };
    return {
      skin: (pose) => {
        adapter.writePose(pose);
        adapter.update(1 / 60);
      },
      draw: () => picture(mesh),
      drawPlain: (positions, normals) => {
        geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
        geometry.setAttribute("normal", new THREE.BufferAttribute(normals, 3));
        return picture(plain);
      },
    };
  });
}

/** What is said where three's WebGPURenderer draws. */
export async function refuseInThree() {
  const { load } = await import("dynaskin");
  const { WebGPURenderer } = await import("three/webgpu");
  const renderer = new WebGPURenderer();
  await renderer.init();
  const model = await load({ model: MODEL_URL });
  const avatar = model.createAvatar({ skinning: "dual-quaternion" });
  const { scene: body } = await new GLTFLoader().loadAsync(`${MODEL_URL}body.glb`);
  const skin = new DynaSkin(avatar, body);
  const scene = new THREE.Scene().add(body);
  const camera = new THREE.PerspectiveCamera(40, 1, 0.1, 20);
  camera.position.z = 4;
  const said = [];
  for (const skinning of ["dual-quaternion", "linear"]) {
    avatar.skinning = skinning;
    skin.update(1 / 60);
    try {
      renderer.render(scene, camera);
      said.push("nothing");
    } catch (error) {
      said.push(`${error.code}: ${error.message}`);
    }
  }
  return said;
}
