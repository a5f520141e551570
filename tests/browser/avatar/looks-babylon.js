import { Camera } from "@babylonjs/core/Cameras/camera.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Ray } from "@babylonjs/core/Culling/ray.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { DirectionalLight } from "@babylonjs/core/Lights/directionalLight.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { ShadowGenerator } from "@babylonjs/core/Lights/Shadows/shadowGenerator.js";
import "@babylonjs/core/Lights/Shadows/shadowGeneratorSceneComponent.js";
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { LoadAssetContainerAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { ShaderMaterial } from "@babylonjs/core/Materials/shaderMaterial.js";
import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial.js";
import { Color3, Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreatePlane } from "@babylonjs/core/Meshes/Builders/planeBuilder.js";
import { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import "@babylonjs/core/Rendering/outlineRenderer.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { AvatarTissue, bindAvatar } from "dynaskin/babylon";
import * as looks from "./looks.js";
import { quantisedBody, SIZE } from "./stage.js";

export * from "./looks.js";

/** Frames of a picture: effects for another geometry may be late. */
const FRAMES = 3;
/** Width of the outline in the unit of the body's vertices, which are quantised: a centimetre. */
const OUTLINE = 100;

/** See `Stand`. */
export function startBabylon(webgpu) {
  return looks.start(async () => {
    const canvas = document.createElement("canvas");
    Object.assign(canvas, { width: SIZE, height: SIZE });
    document.body.append(canvas);
    const engine = await createEngine(canvas, webgpu);
    const scene = new Scene(engine);
    scene.useRightHandedSystem = true;
    scene.clearColor = new Color4(1, 1, 1, 1);
    const camera = createCamera(scene, new Vector3(0.8, 1.2, 3.8), new Vector3(0, 1, 0));
    camera.fov = Math.PI / 6;
    const aside = createCameraAside(scene);
    const shadows = createLights(scene);
    const wall = createWall(scene);
    const container = await LoadAssetContainerAsync(await quantisedBody(), scene, {
      pluginExtension: ".glb",
    });
    container.addAllToScene();
    const root = container.meshes[0];
    const mesh = container.meshes.find(({ skeleton }) => skeleton);
    mesh.outlineColor = Color3.Black();
    mesh.outlineWidth = OUTLINE;
    shadows.addShadowCaster(mesh);
    const paper = new StandardMaterial("paper", scene);
    paper.disableLighting = true;
    paper.emissiveColor = Color3.White();
    const standard = new StandardMaterial("standard", scene);
    standard.diffuseColor = new Color3(0.7, 0.5, 0.4);
    const skin = mesh.material;
    await scene.whenReadyAsync();

    const draw = async (look) => {
      mesh.material = look === "outline" ? paper : look === "standard" ? standard : skin;
      mesh.useVertexColors = look !== "outline";
      mesh.renderOutline = look === "outline";
      wall.setEnabled(look === "shadow");
      scene.activeCamera = look === "shadow" ? aside : camera;
      await scene.whenReadyAsync();
      for (let frame = 0; frame < FRAMES; frame += 1) {
        await new Promise(requestAnimationFrame);
        engine.beginFrame();
        scene.render();
        engine.endFrame();
      }
      return canvas.toDataURL();
    };
    return {
      ...{ AvatarTissue, bindAvatar, root, draw },
      shown: () => arraysOf(mesh),
      freeze: (arrays) => freeze(mesh, arrays),
      morph(influence) {
        mesh.morphTargetManager.getTarget(0).influence = influence;
      },
      // Babylon takes as much of the mesh away as a target brings in.
      whole: (shown, still, influence) =>
        Object.fromEntries(
          Object.entries(shown).map(([kind, numbers]) => [
            kind,
            numbers.map((at, idx) => still[kind][idx] + (at - still[kind][idx]) / (1 - influence)),
          ]),
        ),
      pick: () => pick(scene, mesh),
      clone: () => clone(container),
      wrap(node) {
        const above = new TransformNode("above", scene);
        node.parent = above;
        return above;
      },
      show: (isShown) => root.setEnabled(isShown),
      counts: () => ({
        geometries: scene.geometries.length,
        meshes: scene.meshes.length,
        textures: engine.getLoadedTexturesCache().length,
      }),
      geometry: () => mesh.geometry,
      materials: () => [mesh.material, mesh.material.shadowDepthWrapper, mesh.geometry],
      kinds: ["surface", "shadow", "standard"],
      unfit: (open) => unfit(open, mesh, webgpu),
    };
  });
}

/** Attempts that `write: "texture"` refuses. */
function unfit(open, mesh, webgpu) {
  if (webgpu) return { renderer: () => open("texture") };
  const skin = mesh.material;
  const give = (work) => {
    mesh.material = new ShaderMaterial("own", mesh.getScene(), {
      vertexSource: "",
      fragmentSource: "",
    });
    try {
      work();
    } finally {
      mesh.material.dispose();
      mesh.material = skin;
    }
  };
  return {
    way: () => open("pixels"),
    shader: () => give(() => open("texture")),
    later() {
      const tissue = open("texture");
      try {
        give(() => {});
      } finally {
        tissue.dispose();
      }
    },
  };
}

async function createEngine(canvas, webgpu) {
  if (!webgpu) return new Engine(canvas, true, { preserveDrawingBuffer: true });
  const { WebGPUEngine } = await import("@babylonjs/core/Engines/webgpuEngine.js");
  const engine = new WebGPUEngine(canvas, { antialias: true });
  await engine.initAsync();
  return engine;
}

function createCamera(scene, position, target) {
  const camera = new FreeCamera("camera", position, scene);
  camera.minZ = 0.05;
  camera.setTarget(target);
  return camera;
}

/** Sees the shadow on the wall and not the body. */
function createCameraAside(scene) {
  const aside = createCamera(scene, new Vector3(-3, 0.2, -1), new Vector3(-3, 0.2, -2));
  aside.mode = Camera.ORTHOGRAPHIC_CAMERA;
  const half = 1.3;
  Object.assign(aside, { orthoLeft: -half, orthoRight: half, orthoBottom: -half, orthoTop: half });
  return aside;
}

/** The sun throws the body's shadow on the wall, three metres to its left. */
function createLights(scene) {
  new HemisphericLight("sky", new Vector3(0, 1, 0), scene).intensity = 0.5;
  const sun = new DirectionalLight("sun", new Vector3(-3, -1, -2), scene);
  sun.position = new Vector3(3, 2, 2);
  // Without a fixed frustum the shadow map follows the bounds of meshes, which geometries set.
  Object.assign(sun, { shadowMinZ: 0, shadowMaxZ: 12, shadowFrustumSize: 4 });
  const shadows = new ShadowGenerator(1024, sun);
  shadows.usePercentageCloserFiltering = true;
  return shadows;
}

function createWall(scene) {
  const wall = CreatePlane("wall", { size: 12, sideOrientation: 2 }, scene);
  wall.position.z = -2;
  wall.receiveShadows = true;
  const white = new StandardMaterial("white", scene);
  white.specularColor = Color3.Black();
  wall.material = white;
  return wall;
}

function arraysOf(mesh) {
  const of = (kind) => Float32Array.from(mesh.getVerticesData(kind, true));
  return { positions: of(VertexBuffer.PositionKind), normals: of(VertexBuffer.NormalKind) };
}

function freeze(mesh, { positions, normals }) {
  const { geometry } = mesh;
  const frozen = geometry.copy("frozen");
  frozen.setVerticesData(VertexBuffer.PositionKind, positions.slice(), false, 3);
  frozen.setVerticesData(VertexBuffer.NormalKind, normals.slice(), false, 3);
  // Floats, as those of dynaskin are: see web/sdk/src/babylon/own-geometry.ts.
  const joints = mesh.getVerticesData(VertexBuffer.MatricesIndicesKind, true);
  frozen.setVerticesData(VertexBuffer.MatricesIndicesKind, joints, false, 4);
  const bounds = mesh.getBoundingInfo();
  frozen.applyToMesh(mesh);
  mesh.setBoundingInfo(bounds);
  return () => {
    geometry.applyToMesh(mesh);
    mesh.setBoundingInfo(bounds);
    frozen.dispose();
  };
}

function clone(container) {
  const twin = container.instantiateModelsToScene();
  const [root] = twin.rootNodes;
  return {
    root,
    show: (isShown) => root.setEnabled(isShown),
    remove: () => twin.dispose(),
  };
}

function pick(scene, mesh) {
  // Babylon picks skinned meshes where they rest, unless it is told to look.
  mesh.refreshBoundingInfo({ applySkeleton: true, applyMorph: true });
  const distances = [];
  for (let row = 0; row < 20; row += 1) {
    for (let column = 0; column < 9; column += 1) {
      const origin = new Vector3((column - 4) * 0.04, 0.7 + row * 0.04, -3);
      const ray = new Ray(origin, new Vector3(0, 0, 1), 10);
      const hit = scene.pickWithRay(ray, (candidate) => candidate === mesh);
      distances.push(hit?.hit ? hit.distance : -1);
    }
  }
  return distances;
}
