// Runs in a page: crowds in an engine, for `measureDecoding`. Bodies stand in rows before the camera: an engine
// draws only what it sees.

const APART_M = 1.2;
const ROW = 10;

/** Pixels, so few that a graphics card in software does not take the processor from the page. */
const SIZE_PX = 32;

const place = (idx) => [
  ((idx % ROW) - ROW / 2) * APART_M,
  Math.floor(idx / ROW) * APART_M - ROW * APART_M,
];

const EYE_M = [0, 6, 22];

/** `avatars` in three.js, drawn by WebGLRenderer or WebGPURenderer with the materials of the file. */
export async function crowdInThree(avatars, model, canvas, backend) {
  const THREE = await import("three");
  const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
  const { DynaSkin } = await import("dynaskin/three");
  const renderer =
    backend === "webgpu"
      ? new (await import("three/webgpu")).WebGPURenderer({ canvas })
      : new THREE.WebGLRenderer({ canvas });
  await renderer.init?.();
  renderer.setSize(SIZE_PX, SIZE_PX);
  const scene = new THREE.Scene().add(new THREE.HemisphereLight(0xffffff, 0x806040, 4));
  const camera = new THREE.PerspectiveCamera(40, 1, 0.1, 60);
  camera.position.set(...EYE_M);
  camera.lookAt(0, 1, 0);
  const skins = [];
  for (const [idx, avatar] of avatars.entries()) {
    const { scene: body } = await new GLTFLoader().loadAsync(`${model}body.glb`);
    const [x, z] = place(idx);
    const group = new THREE.Group().add(body);
    group.position.set(x, 0, z);
    scene.add(group);
    skins.push(new DynaSkin(avatar, body));
  }
  return {
    skins,
    render: () => renderer.render(scene, camera),
    dispose: () => renderer.dispose(),
  };
}

/** The same in Babylon.js, with the engine of WebGL 2 or of WebGPU. */
export async function crowdInBabylon(avatars, model, canvas, backend) {
  const [
    { FreeCamera },
    { Engine },
    { HemisphericLight },
    { ImportMeshAsync },
    { Vector3 },
    { Scene },
  ] = await Promise.all(
    [
      "Cameras/freeCamera",
      "Engines/engine",
      "Lights/hemisphericLight",
      "Loading/sceneLoader",
      "Maths/math.vector",
      "scene",
    ].map((name) => import(`@babylonjs/core/${name}.js`)),
  );
  await import("@babylonjs/loaders/glTF/2.0/index.js");
  const { DynaSkin } = await import("dynaskin/babylon");
  [canvas.width, canvas.height] = [SIZE_PX, SIZE_PX];
  const engine =
    backend === "webgpu"
      ? new (await import("@babylonjs/core/Engines/webgpuEngine.js")).WebGPUEngine(canvas)
      : new Engine(canvas, false);
  await engine.initAsync?.();
  const scene = new Scene(engine);
  const camera = new FreeCamera("camera", new Vector3(...EYE_M), scene);
  camera.setTarget(new Vector3(0, 1, 0));
  new HemisphericLight("sky", new Vector3(0, 1, 0), scene);
  const skins = [];
  for (const [idx, avatar] of avatars.entries()) {
    const { meshes } = await ImportMeshAsync(`${model}body.glb`, scene);
    const [x, z] = place(idx);
    meshes[0].position.set(x, 0, z);
    skins.push(
      new DynaSkin(
        avatar,
        meshes.find(({ skeleton }) => skeleton),
      ),
    );
  }
  await scene.whenReadyAsync();
  const render = () => {
    engine.beginFrame();
    scene.render();
    engine.endFrame();
  };
  return { skins, render, dispose: () => engine.dispose() };
}
