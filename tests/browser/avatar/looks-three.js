import { AvatarTissue, bindAvatar } from "dynaskin/three";
import * as THREE from "three";
import { OutlineEffect } from "three/addons/effects/OutlineEffect.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { clone } from "three/addons/utils/SkeletonUtils.js";
import * as looks from "./looks.js";
import { quantisedBody, SIZE } from "./stage.js";

export * from "./looks.js";

/** See `Stand`. */
export function startThree(webgpu) {
  return looks.start(async () => {
    const scene = new THREE.Scene();
    scene.background = new THREE.Color(0xffffff);
    const camera = new THREE.PerspectiveCamera(30, 1, 0.1, 20);
    camera.position.set(0.8, 1.2, 3.8);
    camera.lookAt(0, 1, 0);
    const { renderer, drawOutline } = await createRenderer(webgpu, scene, camera);
    renderer.setSize(SIZE, SIZE);
    renderer.shadowMap.enabled = true;
    document.body.append(renderer.domElement);
    const { buffer } = await quantisedBody();
    const { scene: root } = await new GLTFLoader().parseAsync(buffer, "");
    const mesh = root.getObjectByProperty("isSkinnedMesh", true);
    mesh.castShadow = true;
    // White; the outlines of WebGPURenderer are of toon materials alone.
    const paper = new THREE.MeshToonMaterial({ color: 0, emissive: 0xffffff });
    const skin = mesh.material;
    const kinds = createMaterials(skin);
    // Its shadows are drawn by distance.
    const lamp = new THREE.PointLight(0xffffff, 60);
    lamp.position.set(3, 2, 2);
    lamp.castShadow = true;
    lamp.visible = false;
    const sun = createSun();
    scene.add(lamp, sun, createWall(), new THREE.HemisphereLight(0xffffff, 0xb0a090, 1.2), root);
    const aside = createCameraAside();

    const draw = async (look) => {
      await new Promise(requestAnimationFrame);
      mesh.material = look === "outline" ? paper : (kinds[look] ?? skin);
      lamp.visible = look === "shadow-distance";
      sun.visible = !lamp.visible;
      if (look === "outline") drawOutline();
      else renderer.render(scene, look.startsWith("shadow") ? aside : camera);
      return renderer.domElement.toDataURL();
    };
    return {
      ...{ AvatarTissue, bindAvatar, root, draw },
      shown: () => arraysOf(mesh.geometry),
      freeze: (arrays) => freeze(mesh, arrays),
      morph(influence) {
        mesh.morphTargetInfluences[0] = influence;
      },
      pick: () => pick(mesh),
      clone() {
        const twin = clone(root);
        scene.add(twin);
        return {
          root: twin,
          show: (isShown) => Object.assign(twin, { visible: isShown }),
          remove: () => twin.removeFromParent(),
        };
      },
      wrap: (object) => new THREE.Group().add(object),
      show: (isShown) => Object.assign(root, { visible: isShown }),
      counts: () => ({
        ...countsOf(renderer.info.memory),
        programs: renderer.info.programs?.length,
      }),
      geometry: () => mesh.geometry,
      materials: () => [
        ...[mesh.material, mesh.customDepthMaterial, mesh.customDistanceMaterial],
        ...[mesh.onBeforeRender, Object.hasOwn(mesh, "onBeforeRender"), mesh.geometry],
      ],
      kinds: ["surface", "shadow", "shadow-distance", "outline", ...Object.keys(kinds)],
      unfit: (open) => unfit(open, mesh, webgpu && (() => renderer.render(scene, camera))),
    };
  });
}

const countsOf = ({ geometries, textures }) => ({ geometries, textures });

async function createRenderer(webgpu, scene, camera) {
  if (!webgpu) {
    const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    const effect = new OutlineEffect(renderer, { defaultThickness: 0.006 });
    return { renderer, drawOutline: () => effect.render(scene, camera) };
  }
  const { RenderPipeline, WebGPURenderer } = await import("three/webgpu");
  const { toonOutlinePass } = await import("three/tsl");
  const renderer = new WebGPURenderer({ antialias: true });
  await renderer.init();
  const black = new THREE.Color(0);
  const pipeline = new RenderPipeline(renderer, toonOutlinePass(scene, camera, black, 0.006, 1));
  return { renderer, drawOutline: () => pipeline.render() };
}

/** Throws the body's shadow on the wall, three metres to its left. */
function createSun() {
  const sun = new THREE.DirectionalLight(0xffffff, 2.5);
  sun.position.set(3, 2, 2);
  sun.target.position.set(0, 1, 0);
  sun.target.updateMatrixWorld();
  sun.castShadow = true;
  sun.shadow.mapSize.set(1024, 1024);
  Object.assign(sun.shadow.camera, { left: -1.5, right: 1.5, top: 1.5, bottom: -1.5, far: 12 });
  return sun;
}

function createWall() {
  const material = new THREE.MeshLambertMaterial({ color: 0xffffff });
  const wall = new THREE.Mesh(new THREE.PlaneGeometry(12, 12), material);
  wall.position.z = -2;
  wall.receiveShadow = true;
  return wall;
}

/** Sees the shadow on the wall and not the body. */
function createCameraAside() {
  const aside = new THREE.OrthographicCamera(-1.3, 1.3, 1.3, -1.3, 0.01, 5);
  aside.position.set(-3, 0.2, -1);
  return aside;
}

/** Materials whose vertex stage takes tissue, beside the standard one. */
function createMaterials({ map }) {
  const { MeshPhysicalMaterial: Physical } = THREE;
  const glass = { transparent: true, opacity: 0.6, side: THREE.DoubleSide, forceSinglePass: false };
  return {
    physical: new Physical({ map, clearcoat: 1, sheen: 1 }),
    toon: new THREE.MeshToonMaterial({ color: 0xc09080 }),
    lambert: new THREE.MeshLambertMaterial({ color: 0xc09080 }),
    phong: new THREE.MeshPhongMaterial({ color: 0xc09080 }),
    basic: new THREE.MeshBasicMaterial({ color: 0xc09080 }),
    matcap: new THREE.MeshMatcapMaterial({ color: 0xc09080 }),
    normal: new THREE.MeshNormalMaterial(),
    glass: new THREE.MeshStandardMaterial({ color: 0xc09080, ...glass }),
  };
}

/** Attempts that `write: "texture"` refuses. */
function unfit(open, mesh, drawWithAnother) {
  const skin = mesh.material;
  const give = (material, work) => {
    mesh.material = material;
    try {
      work();
    } finally {
      mesh.material = skin;
    }
  };
  const own = new THREE.ShaderMaterial({ name: "own" });
  const attempts = {
    way: () => open("pixels"),
    shader: () => give(own, () => open("texture")),
    later() {
      const tissue = open("texture");
      try {
        give(own, () => {});
      } finally {
        tissue.dispose();
      }
    },
  };
  if (!drawWithAnother) return attempts;
  return {
    ...attempts,
    renderer() {
      const tissue = open("texture");
      try {
        drawWithAnother();
      } finally {
        tissue.dispose();
      }
    },
  };
}

const copy = ({ array }) => Float32Array.from(array);

/** Of a geometry with tissue, whose arrays are plain. */
function arraysOf({ attributes: { position, normal } }) {
  const of = (attribute) => {
    if (!attribute.isInterleavedBufferAttribute && !attribute.normalized) return copy(attribute);
    const { count } = attribute;
    const numbers = Array.from({ length: count }, (_, idx) =>
      ["getX", "getY", "getZ"].map((get) => attribute[get](idx)),
    );
    return Float32Array.from(numbers.flat());
  };
  return { positions: of(position), normals: of(normal) };
}

function freeze(mesh, { positions, normals }) {
  const { geometry } = mesh;
  const frozen = geometry.clone();
  frozen.setAttribute("position", new THREE.BufferAttribute(positions.slice(), 3));
  frozen.setAttribute("normal", new THREE.BufferAttribute(normals.slice(), 3));
  // The renderer would take the shader of the file's whole numbers.
  frozen.setAttribute("frozen", frozen.getAttribute("position"));
  mesh.geometry = frozen;
  return () => {
    mesh.geometry = geometry;
    frozen.dispose();
  };
}

function pick(mesh) {
  mesh.updateWorldMatrix(true, true);
  const caster = new THREE.Raycaster();
  const distances = [];
  for (let row = 0; row < 20; row += 1) {
    for (let column = 0; column < 9; column += 1) {
      const origin = new THREE.Vector3((column - 4) * 0.04, 0.7 + row * 0.04, -3);
      caster.set(origin, new THREE.Vector3(0, 0, 1));
      distances.push(caster.intersectObject(mesh)[0]?.distance ?? -1);
    }
  }
  return distances;
}
