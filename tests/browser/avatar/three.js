import { AvatarTissue, bindAvatar } from "dynaskin/three";
import * as THREE from "three";
import { makeInThree } from "../../avatars/made.js";
import { bindAndPlay, SIZE } from "./stage.js";

async function createRenderer(webgpu) {
  if (!webgpu) return new THREE.WebGLRenderer({ antialias: true });
  const { WebGPURenderer } = await import("three/webgpu");
  const renderer = new WebGPURenderer({ antialias: true });
  await renderer.init();
  return renderer;
}

/** See `bindAndPlay`. */
export function playInThree(webgpu) {
  return bindAndPlay(async (model, onProgress) => {
    const renderer = await createRenderer(webgpu);
    renderer.setSize(SIZE, SIZE);
    document.body.append(renderer.domElement);
    const scene = new THREE.Scene();
    scene.background = new THREE.Color(0xe9e6e1);
    const sun = new THREE.DirectionalLight(0xffffff, 2.5);
    sun.position.set(-1, 2, 2);
    const camera = new THREE.PerspectiveCamera(30, 1, 0.1, 20);
    camera.position.set(0.8, 1.2, 3.6);
    camera.lookAt(0, 1, 0);
    const { root, meshes } = makeInThree(THREE, model, { split: true, quantised: true });
    scene.add(sun, new THREE.HemisphereLight(0xffffff, 0xb0a090, 1.5), root);
    const draw = async () => {
      await new Promise(requestAnimationFrame);
      renderer.render(scene, camera);
      return renderer.domElement.toDataURL();
    };
    // It has been drawn before: buffers are on the graphics card.
    await draw();
    const binding = await bindAvatar(model, root, { depicts: "adult", onProgress });
    const geometries = meshes.map(({ geometry }) => geometry);
    const tissue = new AvatarTissue(model, root, binding);
    const isGivenBack = () => meshes.every(({ geometry }, idx) => geometry === geometries[idx]);
    return { tissue, draw, isGivenBack };
  });
}
