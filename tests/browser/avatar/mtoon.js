// An avatar whose materials are three-vrm's MToon, with the outlines that it makes beside each surface.
import { MToonMaterialLoaderPlugin } from "@pixiv/three-vrm-materials-mtoon";
import { load, Motion } from "dynaskin";
import { AvatarTissue, bindAvatar } from "dynaskin/three";
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { assembled } from "../../avatars/quantised.js";
import { differingShare, MODEL_URL, SIZE } from "./stage.js";

const EXTENSION = "VRMC_materials_mtoon";
const STRENGTH = 3;
/** The tick of the hop's landing. */
const LANDING = 60;

/** What is seen of the surface and its outline, with and without tissue, in each way of writing. */
export async function compareMToon(webgpu) {
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xffffff);
  const camera = new THREE.PerspectiveCamera(26, 1, 0.1, 20);
  camera.position.set(1.2, 1.2, 3.6);
  camera.lookAt(0, 0.95, 0);
  const sun = new THREE.DirectionalLight(0xffffff, 2.5);
  sun.position.set(2, 2, 2);
  const renderer = await createRenderer(webgpu);
  renderer.setSize(SIZE, SIZE);
  document.body.append(renderer.domElement);
  const root = await loadMToon(webgpu);
  scene.add(sun, new THREE.AmbientLight(0xffffff, 1), root);
  const meshes = [];
  root.traverse((object) => object.isSkinnedMesh && meshes.push(object));
  const draw = async () => {
    await new Promise(requestAnimationFrame);
    renderer.render(scene, camera);
    return renderer.domElement.toDataURL();
  };
  const model = await load({ model: MODEL_URL });
  const binding = await bindAvatar(model, root, { depicts: "adult", worker: false });
  const pictures = {};
  /** Draws all, and then the outlines alone. */
  const drawBoth = async (name) => {
    pictures[`surface-${name}`] = await draw();
    const surfaces = meshes.map(({ material }) => material[0]);
    for (const surface of surfaces) surface.visible = false;
    pictures[`outline-${name}`] = await draw();
    for (const surface of surfaces) surface.visible = true;
  };
  const play = async (write) => {
    const tissue = new AvatarTissue(model, root, binding, { write });
    const motion = Motion.procedural("hop", tissue.avatar);
    for (let tick = 0; tick <= LANDING; tick += 1) {
      tissue.writePose(motion.poseAt(tick / 60));
      tissue.update(1 / 60);
    }
    tissue.avatar.strength = STRENGTH;
    tissue.show();
    await drawBoth(write);
    tissue.avatar.strength = 0;
    tissue.show();
    await drawBoth(`${write}-plain`);
    tissue.dispose();
    await drawBoth(`${write}-after`);
  };
  const before = meshes.map(({ material }) => material.slice());
  await play("attributes");
  const refused = webgpu ? await refusal(() => play("texture")) : await play("texture");
  const isGivenBack = meshes.every(({ material }, idx) =>
    material.every((one, at) => one === before[idx][at]),
  );
  const looks = {};
  for (const look of ["surface", "outline"]) {
    const share = (a, b) => differingShare(pictures[`${look}-${a}`], pictures[`${look}-${b}`]);
    looks[look] = {
      moved: await share("attributes", "attributes-plain"),
      left: await share("attributes-plain", "attributes-after"),
    };
    if (webgpu) continue;
    looks[`${look}, texture`] = {
      moved: await share("texture", "texture-plain"),
      wrong: await share("attributes", "texture"),
      left: await share("texture-plain", "texture-after"),
    };
  }
  const [[first, outline]] = before;
  return {
    ...{ looks, pictures, refused, isGivenBack, meshes: meshes.length },
    kinds: [first, outline].map(({ type, name, isOutline }) => ({ type, name, isOutline })),
  };
}

async function refusal(work) {
  try {
    await work();
  } catch (error) {
    return `${error.code}: ${error.message}`;
  }
  return "nothing";
}

async function createRenderer(webgpu) {
  if (!webgpu) return new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  const { WebGPURenderer } = await import("three/webgpu");
  const renderer = new WebGPURenderer({ antialias: true });
  await renderer.init();
  return renderer;
}

/** The demo's runner, as if its author had given it toon materials with outlines. */
async function loadMToon(webgpu) {
  const response = await fetch("/web/demo/avatars/runner.vrm");
  const glb = withMToon(new Uint8Array(await response.arrayBuffer()));
  const loader = new GLTFLoader();
  const options = webgpu ? { materialType: await nodeMaterial() } : {};
  loader.register((parser) => new MToonMaterialLoaderPlugin(parser, options));
  const { scene } = await loader.parseAsync(glb, "");
  return scene;
}

async function nodeMaterial() {
  return (await import("@pixiv/three-vrm-materials-mtoon/nodes")).MToonNodeMaterial;
}

/** A file whose materials have the extension. */
function withMToon(glb) {
  const view = new DataView(glb.buffer);
  const length = view.getUint32(12, true);
  const file = JSON.parse(new TextDecoder().decode(glb.subarray(20, 20 + length)));
  file.extensionsUsed = [...new Set([...(file.extensionsUsed ?? []), EXTENSION])];
  for (const material of file.materials) {
    material.extensions = {
      ...material.extensions,
      [EXTENSION]: {
        specVersion: "1.0",
        shadeColorFactor: [0.6, 0.4, 0.4],
        outlineWidthMode: "worldCoordinates",
        outlineWidthFactor: 0.006,
        outlineColorFactor: [0, 0, 0],
        outlineLightingMixFactor: 0,
      },
    };
  }
  const json = new TextEncoder().encode(JSON.stringify(file));
  return assembled(json, glb.subarray(28 + length)).buffer;
}
