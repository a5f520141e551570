import { AvatarTissue, bindAvatar, DynaSkin, previousPositions } from "dynaskin/three";
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import * as TSL from "three/tsl";
import { WebGPURenderer } from "three/webgpu";
import { MODEL_URL } from "./stage.js";
import { compareVelocity, PIXELS } from "./velocity.js";

/** See `compareVelocity`. */
export async function compare(way) {
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(24, 1, 1, 8);
  camera.position.set(0.6, 1.1, 3.8);
  camera.lookAt(0, 0.95, 0);
  scene.add(new THREE.HemisphereLight());
  const renderer = new WebGPURenderer();
  await renderer.init();
  renderer.setSize(PIXELS, PIXELS);
  renderer.contextNode = previousPositions(TSL);
  renderer.setMRT(TSL.mrt({ output: TSL.output, velocity: TSL.velocity }));
  const target = new THREE.RenderTarget(PIXELS, PIXELS, { count: 2, type: THREE.FloatType });
  target.textures[0].name = "output";
  target.textures[1].name = "velocity";
  renderer.setRenderTarget(target);
  const { scene: root } = await new GLTFLoader().loadAsync(`${MODEL_URL}body.glb`);
  scene.add(root);
  const mesh = root.getObjectByProperty("isSkinnedMesh", true);
  const point = new THREE.Vector3();
  let binding;
  return compareVelocity(
    {
      async play(model, how, motionVectors) {
        if (how === "DynaSkin") {
          return new DynaSkin(model.createAvatar(), root, { motionVectors });
        }
        // As it was loaded, before it is posed.
        binding ??= await bindAvatar(model, root, { depicts: "adult", worker: false });
        return new AvatarTissue(model, root, binding, { motionVectors });
      },
      async draw() {
        await new Promise(requestAnimationFrame);
        renderer.render(scene, camera);
      },
      async read() {
        const all = [0, 0, PIXELS, PIXELS];
        const numbers = await renderer.readRenderTargetPixelsAsync(target, ...all, 1);
        return (x, y) => {
          const at = 4 * ((PIXELS - 1 - y) * PIXELS + x);
          return [numbers[at], numbers[at + 1]];
        };
      },
      places() {
        const count = mesh.geometry.getAttribute("position").count;
        const places = new Float32Array(3 * count);
        for (let vertex = 0; vertex < count; vertex += 1) {
          mesh.getVertexPosition(vertex, point).applyMatrix4(mesh.matrixWorld).project(camera);
          point.toArray(places, 3 * vertex);
        }
        return places;
      },
      morph(influence) {
        if (mesh.morphTargetInfluences) mesh.morphTargetInfluences[0] = influence;
      },
    },
    way,
  );
}
