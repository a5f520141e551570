import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { DirectionalLight } from "@babylonjs/core/Lights/directionalLight.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { ShadowGenerator } from "@babylonjs/core/Lights/Shadows/shadowGenerator.js";
import "@babylonjs/core/Lights/Shadows/shadowGeneratorSceneComponent.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
// The wall's material.
import "@babylonjs/core/Materials/standardMaterial.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreatePlane } from "@babylonjs/core/Meshes/Builders/planeBuilder.js";
import { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { VertexData } from "@babylonjs/core/Meshes/mesh.vertexData.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { DynaSkin } from "dynaskin/babylon";
import { compareSkinnings, EYE_M, FOV_Y_RADIANS, MODEL_URL, SIZE, TARGET_M } from "./stage.js";

/** Metres of the world in a metre of the body. */
const SCALE = 1.6;

/** See `compareSkinnings`; the body has the PBRMaterial that it comes with. */
export function compareInBabylon() {
  return compareSkinnings(async (avatar) => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [SIZE, SIZE];
    document.body.append(canvas);
    const engine = new Engine(canvas, true, { preserveDrawingBuffer: true });
    const scene = new Scene(engine);
    // As glTF and dynaskin have it, so that the plain surface needs no mirroring.
    scene.useRightHandedSystem = true;
    const camera = new FreeCamera("camera", new Vector3(...EYE_M).scale(SCALE), scene);
    camera.setTarget(new Vector3(...TARGET_M).scale(SCALE));
    camera.fov = FOV_Y_RADIANS;
    const sun = new DirectionalLight("sun", new Vector3(-2, -5, -5), scene);
    sun.position = new Vector3(2, 5, 5);
    new HemisphericLight("sky", new Vector3(0, 1, 0), scene).intensity = 0.6;
    const shadows = new ShadowGenerator(2048, sun);
    shadows.usePercentageCloserFiltering = true;
    shadows.bias = 0.01;
    const wall = CreatePlane("wall", { size: 8, sideOrientation: Mesh.DOUBLESIDE }, scene);
    wall.position.z = -0.6;
    wall.receiveShadows = true;
    const { meshes } = await ImportMeshAsync(`${MODEL_URL}body.glb`, scene);
    const mesh = meshes.find((candidate) => candidate.skeleton);
    meshes[0].scaling.scaleInPlace(SCALE);
    mesh.material.backFaceCulling = false;
    const plain = new Mesh("plain", scene);
    const data = new VertexData();
    data.positions = mesh.getVerticesData(VertexBuffer.PositionKind);
    data.normals = mesh.getVerticesData(VertexBuffer.NormalKind);
    data.uvs = mesh.getVerticesData(VertexBuffer.UVKind);
    data.indices = mesh.getIndices();
    data.applyToMesh(plain, true);
    plain.material = mesh.material;
    plain.scaling.setAll(SCALE);
    plain.alwaysSelectAsActiveMesh = true;
    plain.sideOrientation = mesh.sideOrientation;
    for (const each of [mesh, plain]) shadows.addShadowCaster(each);
    const adapter = new DynaSkin(avatar, mesh);
    await scene.whenReadyAsync();
    const picture = async (shown) => {
      mesh.isVisible = shown === mesh;
      plain.isVisible = shown === plain;
      // Shaders are compiled beside the page.
      await scene.whenReadyAsync();
      await new Promise(requestAnimationFrame);
      engine.beginFrame();
      scene.render();
      engine.endFrame();
      return canvas.toDataURL();
    };
    return {
      skin: (pose) => {
        adapter.writePose(pose);
        adapter.update(1 / 60);
      },
      draw: () => picture(mesh),
      drawPlain: (positions, normals) => {
        plain.updateVerticesData(VertexBuffer.PositionKind, positions);
        plain.updateVerticesData(VertexBuffer.NormalKind, normals);
        return picture(plain);
      },
    };
  });
}
