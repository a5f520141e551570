// In the page of avatar-pictures.mjs: an avatar as it looks plain, with tissue, and how far each vertex moves.
import { load, Motion } from "dynaskin";
import { AvatarTissue, bindAvatar } from "dynaskin/three";
import * as THREE from "three";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const SIZE = [360, 480];
/** Ticks of a hop in which the landing is looked for. */
const TICKS = 120;
/** Ticks before and after the strongest moment that show a landing. */
const INSTANTS = [-14, -7, -3, 0, 4, 10];
/** A hop whose tissue moves plainly. */
const STRENGTH = 1;
const LEAST_SHARE = 0.01;

const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(...SIZE);
document.body.append(renderer.domElement);
const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
const models = new Map();

/** Binds the avatar of an address to a body and draws it; gives pictures as data URLs and what was found. */
export async function takePictures(address, body) {
  if (!models.has(body)) models.set(body, await load({ model: `/models/${body}/` }));
  const model = models.get(body);
  const { scene: root } = await loader.loadAsync(address);
  const meshes = [];
  root.traverse((object) => {
    if (object.isSkinnedMesh) meshes.push(object);
    object.frustumCulled = false;
  });
  const binding = await bindAvatar(model, root, { depicts: "adult" });
  const stage = createStage(root);
  const tissue = new AvatarTissue(model, root, binding);
  const motion = Motion.procedural("hop", tissue.avatar);
  const { moment, peaks } = strongest(tissue, motion, meshes);
  const drawAt = (tick, strength, draw = stage.draw) => {
    tissue.avatar.reset();
    for (let at = 0; at <= tick; at += 1) play(tissue, motion, at);
    tissue.avatar.strength = strength;
    tissue.show();
    return draw();
  };
  const pictures = {
    plain: drawAt(moment, 0),
    "plain, back": drawAt(moment, 0, stage.drawBack),
    "tissue, back": drawAt(moment, STRENGTH, stage.drawBack),
    tissue: drawAt(moment, STRENGTH),
  };
  pictures.coverage = withCoverage(meshes, peaks, stage.draw);
  const landing = INSTANTS.map((by) => Math.max(0, moment + by)).map((tick) => ({
    seconds: tick / 60,
    plain: drawAt(tick, 0),
    tissue: drawAt(tick, STRENGTH),
  }));
  const { shareClose, moving, vertices } = binding.report;
  tissue.dispose();
  motion.dispose();
  return { pictures, landing, shareClose, moving, vertices, largestM: peaks.largestM };
}

function play(tissue, motion, tick) {
  tissue.writePose(motion.poseAt(tick / 60));
  tissue.update(1 / 60);
}

const positionsOf = (mesh) => mesh.geometry.getAttribute("position").array;

/** The tick at which the body's tissue is farthest out, and how far each vertex gets, own units. */
function strongest(tissue, motion, meshes) {
  tissue.avatar.strength = 0;
  play(tissue, motion, 0);
  const still = meshes.map((mesh) => positionsOf(mesh).slice());
  tissue.avatar.strength = STRENGTH;
  const farthest = meshes.map((mesh) => new Float32Array(positionsOf(mesh).length / 3));
  let [moment, largestM] = [0, 0];
  for (let tick = 0; tick < TICKS; tick += 1) {
    play(tissue, motion, tick);
    const most = tissue.avatar.offsets.reduce((max, at) => Math.max(max, Math.abs(at)), 0);
    if (most > largestM) [moment, largestM] = [tick, most];
    for (const [idx, mesh] of meshes.entries()) {
      const shown = positionsOf(mesh);
      for (let vertex = 0; vertex < farthest[idx].length; vertex += 1) {
        const along = (axis) => shown[3 * vertex + axis] - still[idx][3 * vertex + axis];
        const apart = Math.hypot(along(0), along(1), along(2));
        farthest[idx][vertex] = Math.max(farthest[idx][vertex], apart);
      }
    }
  }
  return { moment, peaks: { farthest, largestM } };
}

/** Draws with a colour for each vertex in place of materials. */
function withCoverage(meshes, { farthest }, draw) {
  const materials = meshes.map(({ material }) => material);
  const paint = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide });
  for (const [idx, mesh] of meshes.entries()) {
    // Meshes may have units of their own.
    const most = farthest[idx].reduce((max, at) => Math.max(max, at), 1e-9);
    const colors = new Float32Array(3 * farthest[idx].length);
    const color = new THREE.Color();
    for (const [vertex, apart] of farthest[idx].entries()) {
      const share = apart / most;
      if (share < LEAST_SHARE) color.set(0xb4b4b4);
      else color.setHSL(0.62 * (1 - Math.min(1, share)), 0.75, 0.5);
      color.toArray(colors, 3 * vertex);
    }
    mesh.geometry.setAttribute("color", new THREE.BufferAttribute(colors, 3));
    mesh.material = paint;
  }
  const picture = draw();
  for (const [idx, mesh] of meshes.entries()) {
    mesh.material = materials[idx];
    mesh.geometry.deleteAttribute("color");
  }
  return picture;
}

function createStage(root) {
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xe9e6e1);
  const sun = new THREE.DirectionalLight(0xffffff, 2.2);
  sun.position.set(-1, 2, 2);
  scene.add(sun, new THREE.HemisphereLight(0xffffff, 0xb0a090, 1.8), root);
  root.updateMatrixWorld(true);
  const box = new THREE.Box3().setFromObject(root, true);
  const height = box.max.y - box.min.y;
  const middle = box.getCenter(new THREE.Vector3());
  const camera = new THREE.PerspectiveCamera(24, SIZE[0] / SIZE[1], 0.1, 20 * height);
  // Motions look along +Z, whichever way the file does.
  const aside = new THREE.Vector3(1.1, 0.15, 2.6).multiplyScalar(height);
  camera.position.copy(middle).add(aside);
  camera.lookAt(middle);
  const draw = () => {
    renderer.render(scene, camera);
    return renderer.domElement.toDataURL();
  };
  const behind = aside.clone().multiply(new THREE.Vector3(-1, 1, -1));
  const light = sun.position.clone();
  const drawBack = () => {
    camera.position.copy(middle).add(behind);
    camera.lookAt(middle);
    sun.position.copy(light).setZ(-light.z);
    const picture = draw();
    camera.position.copy(middle).add(aside);
    camera.lookAt(middle);
    sun.position.copy(light);
    return picture;
  };
  return { draw, drawBack };
}
