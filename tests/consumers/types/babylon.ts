// A strict TypeScript application with Babylon.js.
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { Avatar } from "dynaskin";
import { DynaSkin } from "dynaskin/babylon";

export function start(avatar: Avatar, mesh: Mesh): DynaSkin {
  const skin = new DynaSkin(avatar, mesh, { vertexMap: [0, 1, 2] });
  skin.update(1 / 60);
  return skin;
}
