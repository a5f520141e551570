import { ArcRotateCamera } from "@babylonjs/core/Cameras/arcRotateCamera.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { DirectionalLight } from "@babylonjs/core/Lights/directionalLight.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { AvatarTissue, bindAvatar } from "dynaskin/babylon";
import { bindAndPlay, quantisedBody, SIZE } from "./stage.js";

/** Frames of a picture. */
const FRAMES = 3;

/** See `bindAndPlay`. */
export function playInBabylon() {
  return bindAndPlay(async (model, onProgress) => {
    const canvas = document.createElement("canvas");
    canvas.width = SIZE;
    canvas.height = SIZE;
    document.body.append(canvas);
    const scene = new Scene(new Engine(canvas, true, { preserveDrawingBuffer: true }));
    const camera = new ArcRotateCamera("camera", 1.3, 1.5, 3.2, new Vector3(0, 1, 0), scene);
    camera.minZ = 0.1;
    new HemisphericLight("sky", new Vector3(0, 1, 0), scene).intensity = 0.6;
    new DirectionalLight("sun", new Vector3(0.4, -0.6, -0.7), scene);
    // The body as if it were somebody else's: its file has bones and quantised vertices.
    const { meshes } = await ImportMeshAsync(await quantisedBody(), scene, {
      pluginExtension: ".glb",
    });
    const root = meshes[0];
    await scene.whenReadyAsync();
    const skinned = meshes.filter((mesh) => mesh.skeleton);
    const draw = async () => {
      // Effects for another geometry may be a frame late.
      for (let frame = 0; frame < FRAMES; frame += 1) {
        await new Promise(requestAnimationFrame);
        scene.getEngine().beginFrame();
        scene.render();
        scene.getEngine().endFrame();
      }
      return canvas.toDataURL();
    };
    // It has been drawn before: buffers are on the graphics card.
    await draw();
    const binding = await bindAvatar(model, root, { depicts: "adult", onProgress });
    const geometries = skinned.map(({ geometry }) => geometry);
    const tissue = new AvatarTissue(model, root, binding);
    const isGivenBack = () => skinned.every(({ geometry }, idx) => geometry === geometries[idx]);
    return { tissue, draw, isGivenBack };
  });
}
