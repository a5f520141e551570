import { type Model, Motion } from "dynaskin";
import { AvatarTissue, type Binding } from "dynaskin/three";
import { type BufferGeometry, Matrix4, type Object3D, type SkinnedMesh } from "three";
import { clone } from "three/addons/utils/SkeletonUtils.js";
import { findMotion, type MotionName, motionOptions } from "../motions.js";
import { CoverageMap } from "./coverage.js";

const TICK_SECONDS = 1 / 60;

/** In which every motion of the page has landed, stepped or turned at least once. */
const REHEARSED_SECONDS = 3;

export type Clothes = "sportswear" | "unsupported";

/** What the beginning of a motion shows. */
interface Rehearsal {
  /** Largest offset of each vertex, metres, by mesh that moves. */
  peaksM: Map<SkinnedMesh, Float32Array>;
  mostM: number;
  /** When most of the body is farthest from plain skinning. */
  momentSeconds: number;
}

/** An avatar with tissue and its double without, in the same motion. */
export class BoundAvatar {
  readonly root: Object3D;
  /** The same avatar with plain skinning. */
  readonly plain: Object3D;
  readonly binding: Binding;
  readonly meshes: readonly SkinnedMesh[];
  readonly #model: Model;
  /** Node by node, the avatar's and its double's. */
  readonly #pairs: [Object3D, Object3D][];
  readonly #geometries: ReadonlyMap<SkinnedMesh, BufferGeometry>;
  readonly #coverage = new CoverageMap();
  /** Metres per unit of the picture. */
  readonly #metresPerUnit: number;
  readonly #excluded = new Set<SkinnedMesh>();
  #tissue: AvatarTissue;
  #motion: Motion;
  #motionName: MotionName = "jump";
  #timeSeconds = 0;
  #strength = 1;
  #clothes: Clothes = "sportswear";
  #rehearsal: Rehearsal | null = null;

  /** `heightUnits`: how tall the avatar is in the picture. */
  constructor(model: Model, root: Object3D, binding: Binding, heightUnits: number) {
    this.#model = model;
    this.root = root;
    this.binding = binding;
    this.plain = clone(root);
    this.#pairs = pairs(root, this.plain);
    this.meshes = skinned(root);
    this.#geometries = new Map(this.meshes.map((mesh) => [mesh, mesh.geometry]));
    this.#tissue = this.#makeTissue();
    this.#dress();
    this.#motion = this.#makeMotion();
    const body = this.#tissue.avatar.positions;
    const bodyM = body.reduce((most, number) => Math.max(most, number), 0);
    this.#metresPerUnit = (binding.report.proportions.statureM ?? bodyM) / heightUnits;
    this.#pose();
  }

  get tissue(): AvatarTissue {
    return this.#tissue;
  }

  get timeSeconds(): number {
    return this.#timeSeconds;
  }

  get motionName(): MotionName {
    return this.#motionName;
  }

  /** Plays a motion from its beginning. */
  setMotion(name: MotionName): void {
    this.#motionName = name;
    this.#motion = this.#makeMotion();
    this.#rehearsal = null;
    this.restart();
  }

  /** How many times as far as in nature the tissue moves. */
  setStrength(strength: number): void {
    this.#strength = strength;
    this.#tissue.avatar.strength = strength;
    this.#tissue.show();
    this.#rehearsal = null;
  }

  /** What holds the tissue: sportswear, or nothing. */
  setClothes(clothes: Clothes): void {
    this.#clothes = clothes;
    this.#dress();
    this.#rehearsal = null;
    this.seek(this.#timeSeconds);
  }

  get clothes(): Clothes {
    return this.#clothes;
  }

  isExcluded(mesh: SkinnedMesh): boolean {
    return this.#excluded.has(mesh);
  }

  get excluded(): readonly SkinnedMesh[] {
    return this.meshes.filter((mesh) => this.#excluded.has(mesh));
  }

  /** Leaves a mesh as plain skinning has it, or lets it move again. The coverage map goes off. */
  setExcluded(mesh: SkinnedMesh, isExcluded: boolean): void {
    const was = this.#excluded.has(mesh);
    this.#mark(mesh, isExcluded);
    this.#coverage.hide();
    this.#tissue.dispose();
    try {
      this.#tissue = this.#makeTissue();
    } catch (error) {
      this.#mark(mesh, was);
      this.#tissue = this.#makeTissue();
      throw error;
    } finally {
      this.#dress();
      this.#motion = this.#makeMotion();
      this.#rehearsal = null;
      this.seek(this.#timeSeconds);
    }
  }

  /** Goes on by so many seconds. */
  play(seconds: number): void {
    // After a pause of the page, a long step would be a blow.
    const step = Math.min(seconds, 2 * TICK_SECONDS);
    this.#timeSeconds = (this.#timeSeconds + step) % this.#motion.durationSeconds;
    this.#pose(step);
  }

  restart(): void {
    this.#timeSeconds = 0;
    this.#tissue.avatar.reset();
    this.#pose();
  }

  /** Shows a moment, with the tissue stepped from the beginning. */
  seek(timeSeconds: number): void {
    this.restart();
    const ticks = Math.round(timeSeconds / TICK_SECONDS);
    for (let tick = 0; tick < ticks; tick += 1) this.play(TICK_SECONDS);
  }

  /** The moment in which most of the body is farthest from plain skinning. */
  seekMoment(): void {
    this.seek(this.#rehearse().momentSeconds);
  }

  /**
   * Shows which vertices move with the present settings, or the avatar's own materials.
   *
   * @returns the largest offset in metres
   */
  showCoverage(isShown: boolean): number {
    this.#coverage.hide();
    if (!isShown) return 0;
    const at = this.#timeSeconds;
    const isNew = this.#rehearsal === null;
    const { peaksM, mostM } = this.#rehearse();
    if (isNew) this.seek(at);
    this.#coverage.show(this.meshes, peaksM, mostM);
    return mostM;
  }

  /** Largest distance between the avatar with tissue and its double now, metres. */
  get apartM(): number {
    let most = 0;
    for (const mesh of this.meshes) {
      for (const offset of this.#offsetsM(mesh)) most = Math.max(most, offset);
    }
    return most;
  }

  dispose(): void {
    this.#coverage.dispose();
    this.#tissue.dispose();
  }

  #mark(mesh: SkinnedMesh, isExcluded: boolean): void {
    if (isExcluded) this.#excluded.add(mesh);
    else this.#excluded.delete(mesh);
  }

  #makeTissue(): AvatarTissue {
    const exclude = (mesh: SkinnedMesh) => this.#excluded.has(mesh);
    return new AvatarTissue(this.#model, this.root, this.binding, { exclude });
  }

  /** Gives the tissue the settings, which a new one is without. */
  #dress(): void {
    const { avatar } = this.#tissue;
    avatar.setControls(this.#clothes === "sportswear" ? "sportswear" : "as-predicted");
    avatar.strength = this.#strength;
  }

  #makeMotion(): Motion {
    const choice = findMotion(this.#motionName);
    if (!choice) throw new Error(`There is no motion ${this.#motionName}.`);
    return Motion.procedural(choice.name, this.#tissue.avatar, motionOptions(choice, null, null));
  }

  #pose(seconds = 0): void {
    this.#tissue.writePose(this.#motion.poseAt(this.#timeSeconds));
    this.#tissue.update(seconds);
    for (const [from, to] of this.#pairs) {
      to.position.copy(from.position);
      to.quaternion.copy(from.quaternion);
      to.scale.copy(from.scale);
    }
  }

  /** Plays the motion's beginning and looks how far each vertex goes. */
  #rehearse(): Rehearsal {
    if (this.#rehearsal) return this.#rehearsal;
    const moving = this.meshes.filter((mesh) => mesh.geometry !== this.#geometries.get(mesh));
    const peaksM = new Map(
      moving.map((mesh) => [mesh, new Float32Array(mesh.geometry.attributes.position?.count ?? 0)]),
    );
    let [mostM, momentSeconds, mostSum] = [0, 0, 0];
    this.restart();
    const ticks = Math.floor(
      Math.min(REHEARSED_SECONDS, this.#motion.durationSeconds) / TICK_SECONDS,
    );
    for (let tick = 1; tick < ticks; tick += 1) {
      this.play(TICK_SECONDS);
      let sum = 0;
      for (const [mesh, peaks] of peaksM) {
        for (const [vertex, offset] of this.#offsetsM(mesh).entries()) {
          peaks[vertex] = Math.max(peaks[vertex] ?? 0, offset);
          mostM = Math.max(mostM, offset);
          sum += offset;
        }
      }
      if (sum > mostSum) [mostSum, momentSeconds] = [sum, this.#timeSeconds];
    }
    this.#rehearsal = { peaksM, mostM, momentSeconds };
    return this.#rehearsal;
  }

  /** How far each vertex of a mesh is from where plain skinning has it, metres. */
  #offsetsM(mesh: SkinnedMesh): Float32Array {
    const now = mesh.geometry.attributes.position;
    const still = this.#geometries.get(mesh)?.attributes.position;
    if (!now || !still || now === still) return new Float32Array(0);
    const scale = this.#metresPerUnit * unitsOf(mesh);
    const offsets = new Float32Array(now.count);
    for (let vertex = 0; vertex < now.count; vertex += 1) {
      const [x, y, z] = [now.getX(vertex), now.getY(vertex), now.getZ(vertex)];
      const [a, b, c] = [still.getX(vertex), still.getY(vertex), still.getZ(vertex)];
      offsets[vertex] = scale * Math.hypot(x - a, y - b, z - c);
    }
    return offsets;
  }
}

const matrix = new Matrix4();

/** Units of the picture per unit of a mesh's own space, as its skeleton has it. */
function unitsOf({ skeleton, bindMatrix }: SkinnedMesh): number {
  const [bone] = skeleton.bones;
  const [inverse] = skeleton.boneInverses;
  if (!bone || !inverse) return 1;
  matrix.multiplyMatrices(bone.matrixWorld, inverse).multiply(bindMatrix);
  return matrix.getMaxScaleOnAxis();
}

/** The skinned meshes under an object. */
export function skinned(root: Object3D): SkinnedMesh[] {
  const meshes: SkinnedMesh[] = [];
  root.traverse((object) => {
    if ((object as SkinnedMesh).isSkinnedMesh) meshes.push(object as SkinnedMesh);
  });
  return meshes;
}

function pairs(root: Object3D, double: Object3D): [Object3D, Object3D][] {
  const [ours, theirs]: [Object3D[], Object3D[]] = [[], []];
  root.traverse((object) => ours.push(object));
  double.traverse((object) => theirs.push(object));
  return ours.map((object, idx) => [object, theirs[idx] ?? object]);
}
