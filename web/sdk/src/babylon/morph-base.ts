// Morph targets of meshes whose positions have tissue.

import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import type { Geometry } from "@babylonjs/core/Meshes/geometry.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { MorphTarget } from "@babylonjs/core/Morph/morphTarget.js";
import type { MorphTargetManager } from "@babylonjs/core/Morph/morphTargetManager.js";

/** What is left where the other targets cancel out: a target of none is skipped, and its return compiles shaders. */
const LEAST = 1e-20;

/**
 * Babylon takes as much of a mesh's own positions away as its targets bring in, and tissue goes with them. This
 * target is the mesh without tissue, taken away as often: what remains are the others' differences from it.
 */
class BaseTarget extends MorphTarget {
  /** The targets that it stands against; clones of it have none and do nothing. */
  manager: MorphTargetManager | undefined;
  users = 0;

  override get influence(): number {
    let sum = 0;
    let isNeeded = false;
    for (let idx = 0; idx < (this.manager?.numTargets ?? 0); idx += 1) {
      const target = this.manager?.getTarget(idx);
      if (!target || target instanceof BaseTarget) continue;
      sum += target.influence;
      isNeeded ||= target.influence !== 0;
    }
    return isNeeded ? -sum || LEAST : 0;
  }

  /** It follows from the others. */
  override set influence(_: number) {}

  override clone(): MorphTarget {
    const twin = new BaseTarget(this.name);
    twin.setPositions(this.getPositions());
    twin.setNormals(this.getNormals());
    twin.setTangents(this.getTangents());
    twin.setUVs(this.getUVs());
    twin.setUV2s(this.getUV2s());
    twin.setColors(this.getColors());
    return twin;
  }
}

/** Keeps the tissue of meshes that show one geometry whole, whatever their morph targets. */
export class MorphBases {
  readonly #source: Geometry;
  readonly #meshes: readonly Mesh[];
  readonly #taken = new Map<Mesh, MorphTargetManager | null>();

  /** @param source - their geometry without tissue */
  constructor(source: Geometry, meshes: readonly Mesh[]) {
    this.#source = source;
    this.#meshes = meshes;
    this.follow();
  }

  /** Takes up other targets that a mesh was given. */
  follow(): void {
    for (const mesh of this.#meshes) {
      const { morphTargetManager: present } = mesh;
      const before = this.#taken.get(mesh) ?? null;
      if (present === before) continue;
      if (before) release(before);
      if (present) claim(present, this.#source);
      this.#taken.set(mesh, present);
    }
  }

  /** Gives the meshes the targets that they had. */
  dispose(): void {
    for (const manager of this.#taken.values()) {
      if (manager) release(manager);
    }
    this.#taken.clear();
  }
}

function baseOf(manager: MorphTargetManager): BaseTarget | undefined {
  for (let idx = 0; idx < manager.numTargets; idx += 1) {
    const target = manager.getTarget(idx);
    if (target instanceof BaseTarget) return target;
  }
  return undefined;
}

function claim(manager: MorphTargetManager, source: Geometry): void {
  if (manager.numTargets === 0) return;
  const known = baseOf(manager);
  const base = known ?? createBase(source);
  base.manager = manager;
  base.users += 1;
  if (known) return;
  // Pages set it to how many of their own act at once.
  if (manager.numMaxInfluencers > 0) manager.numMaxInfluencers += 1;
  manager.addTarget(base);
}

function release(manager: MorphTargetManager): void {
  const base = baseOf(manager);
  if (!base) return;
  base.users -= 1;
  if (base.users > 0) return;
  manager.removeTarget(base);
  if (manager.numMaxInfluencers > 0) manager.numMaxInfluencers -= 1;
}

function createBase(source: Geometry): BaseTarget {
  const of = (kind: string) => source.getVerticesData(kind, true);
  const base = new BaseTarget("dynaskin");
  base.setPositions(of(VertexBuffer.PositionKind));
  base.setNormals(of(VertexBuffer.NormalKind));
  base.setUVs(of(VertexBuffer.UVKind));
  base.setUV2s(of(VertexBuffer.UV2Kind));
  // Targets have neither a tangent's handedness nor colours without opacity.
  base.setTangents(resized(of(VertexBuffer.TangentKind), 4, 3));
  const colours = source.getVertexBuffer(VertexBuffer.ColorKind);
  base.setColors(resized(of(VertexBuffer.ColorKind), colours?.getSize() ?? 4, 4));
  return base;
}

/** Rows of another length, filled up with ones. */
function resized(rows: ArrayLike<number> | null, from: number, to: number): Float32Array | null {
  if (!rows) return null;
  return Float32Array.from({ length: (rows.length / from) * to }, (_, at) => {
    const column = at % to;
    return column < from ? (rows[Math.floor(at / to) * from + column] ?? 0) : 1;
  });
}
