// The surfaces of a binding that move, and where the core has their arrays.
import { type Core, CoreArray } from "../core.js";
import { DynaSkinError } from "../error.js";
import type { CoreBinding, CoreTissue } from "../wasm/core.js";
import type { AvatarSurface } from "./tissue.js";
import type { TissueWrite } from "./vertex-stage.js";

/** A surface that moves: its number, and its arrays in the core. */
export interface Moving {
  surface: AvatarSurface;
  idx: number;
  /** None where a vertex stage moves it. */
  positions: CoreArray | null;
  normals: CoreArray | null;
  tangents: CoreArray | null;
  first: number;
  end: number;
  isShown: boolean;
}

/** The number of a surface's mesh in the binding. */
export function meshOf(core: Core, raw: CoreBinding, { name, positions }: AvatarSurface): number {
  const mesh = core.guard(() => raw.meshOf(positions));
  if (mesh >= 0) return mesh;
  throw new DynaSkinError(
    "binding",
    `The binding has no mesh like ${name} (${positions.length / 3} vertices): it was made for another ` +
      "avatar, or the mesh was changed or added since. Bind this avatar again, or exclude the mesh.",
  );
}

/** Those on which nothing moves are left out. */
export function addSurfaces(
  core: Core,
  raw: CoreTissue,
  given: { surfaces: readonly AvatarSurface[]; bound: readonly number[]; write: TissueWrite },
): Moving[] {
  const added = given.surfaces.map((surface, idx): Moving => {
    const { positions, normals, tangents, shares } = surface;
    // Tangents keep to the plane of normals.
    const hasTangents = normals.length > 0 && tangents.length > 0;
    return core.guard(() => {
      raw.addSurface(given.bound[idx] ?? 0, positions, normals, shares);
      const [first = 0, end = 0] = raw.moving(idx);
      const still = { surface, idx, first, end, isShown: true };
      if (given.write === "texture") {
        return { ...still, positions: null, normals: null, tangents: null };
      }
      if (hasTangents) raw.setTangents(idx, tangents);
      const array = (locate: () => number, length = positions.length) =>
        new CoreArray(core, locate, length);
      return {
        ...still,
        positions: array(() => raw.positionsPtr(idx)),
        normals: normals.length > 0 ? array(() => raw.normalsPtr(idx)) : null,
        tangents: hasTangents ? array(() => raw.tangentsPtr(idx), tangents.length) : null,
      };
    });
  });
  return added.filter(({ first, end }) => end > first);
}
