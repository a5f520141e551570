import {
  Box3,
  CircleGeometry,
  Color,
  DirectionalLight,
  HemisphereLight,
  type Material,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  PerspectiveCamera,
  Raycaster,
  Scene,
  type SkinnedMesh,
  type Texture,
  Vector2,
  Vector3,
  Vector4,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { skinned } from "./bound-avatar.js";

/** How the two are shown. */
export type OwnLayout = "side" | "wipe";

const FIELD_OF_VIEW = 26;

/** The picture: an avatar alone, or with its double of plain skinning to the left. */
export class Studio {
  readonly #canvas: HTMLCanvasElement;
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.1, 50);
  readonly #controls: OrbitControls;
  readonly #floor = new Mesh(
    new CircleGeometry(1.4, 64).rotateX(-Math.PI / 2),
    new MeshStandardMaterial({ roughness: 1 }),
  );
  readonly #sun = new DirectionalLight(0xffffff, 2.6);
  #root: Object3D | null = null;
  #plain: Object3D | null = null;
  #heightUnits = 1;
  #layout: OwnLayout = "side";
  #split = 0.5;
  /** Share of the screen's pixels in each direction that are drawn. */
  #sharpness = 1;
  #isStale = true;

  /** @throws Error where the browser has no WebGL 2 */
  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.#renderer.shadowMap.enabled = true;
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.enableDamping = false;
    this.#controls.listenToKeyEvents(canvas);
    this.#controls.addEventListener("change", () => this.invalidate());
    // What the page's style says of touch holds: on narrow screens it scrolls.
    canvas.style.touchAction = "";
    new ResizeObserver(() => this.invalidate()).observe(canvas);
    this.#renderer.shadowMap.autoUpdate = false;
    this.#sun.castShadow = true;
    this.#sun.shadow.mapSize.set(1024, 1024);
    this.#floor.receiveShadow = true;
    const sky = new HemisphereLight(0xffffff, 0xb0a595, 1.5);
    this.#scene.add(this.#sun, this.#sun.target, sky, this.#floor);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#paint());
    this.#paint();
  }

  /** How tall the avatar is where it stands, in units of the picture. */
  get heightUnits(): number {
    return this.#heightUnits;
  }

  get layout(): OwnLayout {
    return this.#layout;
  }

  set layout(layout: OwnLayout) {
    this.#layout = layout;
    this.invalidate();
  }

  /** Where the divider is, 0 to 1. */
  get split(): number {
    return this.#split;
  }

  set split(split: number) {
    this.#split = split;
    this.invalidate();
  }

  /** Something has changed that the next {@link refresh} is to draw. */
  invalidate(): void {
    this.#isStale = true;
  }

  /** Draws fewer pixels from now on, for machines that are too slow for all of them. */
  blur(): void {
    this.#sharpness = Math.max(0.4, 0.75 * this.#sharpness);
    this.invalidate();
  }

  /** Draws if anything has changed. */
  refresh(): void {
    if (this.#isStale) this.draw();
  }

  /** Shows an avatar alone, and forgets the last. */
  setAvatar(root: Object3D): void {
    this.clear();
    this.#root = root;
    this.#scene.add(root);
    prepare(root);
    root.updateWorldMatrix(true, true);
    const box = new Box3().setFromObject(root, true);
    const size = box.getSize(new Vector3());
    this.#heightUnits = size.y > 0 && Number.isFinite(size.y) ? size.y : 1;
    this.#frame(box.getCenter(new Vector3()), box.min.y);
  }

  /** Shows its double beside it, or none. */
  setPlain(plain: Object3D | null): void {
    if (this.#plain) this.#scene.remove(this.#plain);
    this.#plain = plain;
    if (plain) this.#scene.add(plain);
  }

  /** Takes everything away and frees it. */
  clear(): void {
    this.setPlain(null);
    if (!this.#root) return;
    this.#scene.remove(this.#root);
    free(this.#root);
    this.#root = null;
  }

  draw(): void {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    if (width === 0 || height === 0) return;
    this.#isStale = false;
    // Once for both: their shadows differ by millimetres.
    this.#renderer.shadowMap.needsUpdate = true;
    this.#resize(width, height);
    const [root, plain] = [this.#root, this.#plain];
    if (!plain || !root) {
      this.#view(0, width, new Vector4(0, 0, width, height), height);
      return;
    }
    const cut = this.layout === "side" ? width / 2 : width * this.split;
    const whole = this.layout === "wipe";
    plain.visible = true;
    root.visible = false;
    this.#view(0, whole ? width : cut, new Vector4(0, 0, cut, height), height);
    plain.visible = false;
    root.visible = true;
    const rest = new Vector4(cut, 0, width - cut, height);
    this.#view(whole ? 0 : cut, whole ? width : width - cut, rest, height);
  }

  /** The avatar's mesh under a point of the window, of either side. */
  pick(clientX: number, clientY: number): SkinnedMesh | null {
    const [root, plain] = [this.#root, this.#plain];
    if (!root) return null;
    const { left, top, width, height } = this.#canvas.getBoundingClientRect();
    const isHalf = plain !== null && this.layout === "side";
    const across = isHalf ? width / 2 : width;
    const x = (clientX - left) % across;
    const point = new Vector2((2 * x) / across - 1, 1 - (2 * (clientY - top)) / height);
    this.#aim(across / height);
    const ray = new Raycaster();
    ray.setFromCamera(point, this.#camera);
    const meshes = skinned(root);
    // Bounds of skinned meshes are those of the pose in which they were first asked for.
    for (const mesh of meshes) mesh.computeBoundingSphere();
    return (ray.intersectObjects(meshes, false)[0]?.object as SkinnedMesh | undefined) ?? null;
  }

  #view(x: number, width: number, scissor: Vector4, height: number): void {
    this.#renderer.setViewport(x, 0, width, height);
    this.#renderer.setScissor(scissor);
    this.#renderer.setScissorTest(true);
    this.#aim(width / height);
    this.#renderer.render(this.#scene, this.#camera);
  }

  /** A narrow picture needs more distance for arms: it gets a wider field. */
  #aim(aspect: number): void {
    this.#camera.aspect = aspect;
    const half = Math.tan((FIELD_OF_VIEW * Math.PI) / 360) * Math.max(1, 0.52 / aspect);
    this.#camera.fov = (Math.atan(half) * 360) / Math.PI;
    this.#camera.updateProjectionMatrix();
  }

  #resize(width: number, height: number): void {
    const ratio = this.#sharpness * Math.min(devicePixelRatio, 2);
    const size = this.#renderer.getSize(new Vector2());
    if (size.x === width && size.y === height && this.#renderer.getPixelRatio() === ratio) return;
    this.#renderer.setPixelRatio(ratio);
    this.#renderer.setSize(width, height, false);
  }

  #frame(centre: Vector3, ground: number): void {
    const height = this.#heightUnits;
    const target = new Vector3(centre.x, ground + 0.53 * height, centre.z);
    const distance = (0.66 * height) / Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
    const side = new Vector3(0.42, 0.1, 1).normalize().multiplyScalar(distance);
    this.#camera.near = height / 50;
    this.#camera.far = 40 * height;
    this.#camera.position.copy(target).add(side);
    this.#controls.target.copy(target);
    this.#controls.minDistance = 0.3 * height;
    this.#controls.maxDistance = 8 * height;
    this.#controls.update();
    this.#floor.position.set(centre.x, ground, centre.z);
    this.#floor.scale.setScalar(height);
    this.#sun.target.position.copy(target);
    this.#sun.position.set(-0.7, 1.5, 1.2).multiplyScalar(height).add(target);
    const { camera } = this.#sun.shadow;
    Object.assign(camera, { left: -height, right: height, top: height, bottom: -height });
    Object.assign(camera, { near: 0.1 * height, far: 5 * height });
    camera.updateProjectionMatrix();
    this.#sun.shadow.normalBias = 0.01 * height;
  }

  #paint(): void {
    const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.#scene.background = new Color(isDark ? 0x1b1d23 : 0xdfe2e8);
    this.#floor.material.color.set(isDark ? 0x30333c : 0xcdd1d9);
    this.invalidate();
  }
}

function prepare(root: Object3D): void {
  root.traverse((object) => {
    const mesh = object as Mesh;
    if (!mesh.isMesh) return;
    mesh.castShadow = true;
    // Bounds at rest do not hold for a jump.
    mesh.frustumCulled = false;
  });
}

/** Gives back what an avatar has on the graphics card. */
function free(root: Object3D): void {
  root.traverse((object) => {
    const { geometry, material } = object as Mesh;
    geometry?.dispose();
    const materials: Material[] = material ? [material].flat() : [];
    for (const each of materials) {
      for (const value of Object.values(each)) {
        if ((value as Texture | null)?.isTexture) (value as Texture).dispose();
      }
      each.dispose();
    }
    (object as SkinnedMesh).skeleton?.dispose();
  });
}
