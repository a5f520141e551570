import { DynaSkin } from "dynaskin/three";
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { WebGPURenderer } from "three/webgpu";
import { APART_M, MODEL_URL, playOnCard, SIZE, webGl, webGpu } from "./stage.js";

/**
 * See `playOnCard`; the last body's vertices are in another order, and shadows fall on a wall.
 *
 * @param onWebGpu - with `WebGPURenderer`
 */
export function playInThree(onWebGpu) {
  return playOnCard(async (avatars) => {
    const renderer = onWebGpu
      ? new WebGPURenderer()
      : new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
    await renderer.init?.();
    renderer.setSize(...SIZE);
    renderer.shadowMap.enabled = true;
    document.body.append(renderer.domElement);
    const scene = new THREE.Scene();
    const camera = new THREE.PerspectiveCamera(38, SIZE[0] / SIZE[1], 0.1, 20);
    camera.position.set(1, 1.1, 3.4);
    camera.lookAt(0, 0.95, 0);
    const sun = new THREE.DirectionalLight(0xffffff, 3);
    sun.position.set(2, 3, 5);
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    sun.shadow.normalBias = 0.02;
    const wall = new THREE.Mesh(
      new THREE.PlaneGeometry(8, 8),
      new THREE.MeshLambertMaterial({ color: 0xd8d4cc }),
    );
    wall.position.z = -0.5;
    wall.receiveShadow = true;
    scene.add(sun, wall, new THREE.HemisphereLight(0xffffff, 0x907060, 1.5));
    const meshes = [];
    for (const idx of avatars.keys()) {
      const { scene: body } = await new GLTFLoader().loadAsync(`${MODEL_URL}body.glb`);
      const mesh = body.getObjectByProperty("isSkinnedMesh", true);
      Object.assign(mesh, { castShadow: true, receiveShadow: true });
      if (idx === avatars.length - 1) turnRound(mesh.geometry);
      scene.add(new THREE.Group().add(body));
      body.parent.position.x = (idx - 1) * APART_M;
      meshes.push(mesh);
    }
    const own = meshes.map(({ geometry }) => geometry);
    const skins = avatars.map((avatar, idx) => new DynaSkin(avatar, meshes[idx]));
    const gl = onWebGpu ? null : renderer.getContext();
    const gpu = gl ? webGl(gl) : webGpu(renderer.backend.device, renderer.domElement);
    const attribute = (idx, name) => meshes[idx].geometry.getAttribute(name);
    const buffer = (idx, name) =>
      gl ? attribute(idx, name).buffer : renderer.backend.get(attribute(idx, name)).buffer;
    return {
      skins,
      gpu,
      async draw() {
        // What three works out once a frame is worked out anew.
        if (onWebGpu) await new Promise(requestAnimationFrame);
        renderer.render(scene, camera);
        return gl ? pixelsOf(gl) : gpu.pixels();
      },
      buffers: (idx) => ({ positions: buffer(idx, "position"), normals: buffer(idx, "normal") }),
      order: (idx) => {
        const { count } = attribute(idx, "position");
        return idx === avatars.length - 1
          ? Uint32Array.from({ length: count }, (_, at) => count - 1 - at)
          : null;
      },
      numbers: (idx) => {
        const position = attribute(idx, "position");
        const { count } = position;
        return Float32Array.from({ length: 3 * count }, (_, at) =>
          position.getComponent(Math.floor(at / 3), at % 3),
        );
      },
      plain: (idx) =>
        meshes[idx].geometry === own[idx] && !Object.hasOwn(meshes[idx], "onBeforeRender"),
    };
  });
}

/** Puts the last vertex of a geometry first, and so on. */
function turnRound(geometry) {
  const all = [
    ...Object.entries(geometry.attributes),
    ...Object.values(geometry.morphAttributes)
      .flat()
      .map((one) => [null, one]),
  ];
  let last = 0;
  for (const [name, attribute] of all) {
    const { count, itemSize, normalized } = attribute;
    last = count - 1;
    const turned = new THREE.BufferAttribute(
      new attribute.array.constructor(count * itemSize),
      itemSize,
      normalized,
    );
    for (let idx = 0; idx < count; idx += 1) {
      for (let at = 0; at < itemSize; at += 1)
        turned.setComponent(last - idx, at, attribute.getComponent(idx, at));
    }
    if (name) geometry.setAttribute(name, turned);
  }
  geometry.morphAttributes = {};
  const index = geometry.index.array.map((vertex) => last - vertex);
  geometry.setIndex(new THREE.BufferAttribute(index, 1));
}

function pixelsOf(gl) {
  const pixels = new Uint8Array(4 * SIZE[0] * SIZE[1]);
  gl.readPixels(0, 0, ...SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return pixels;
}
