import type { HumanoidSource } from "dynaskin/three";
import { LoadingManager, type Object3D } from "three";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { type GLTF, GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { readGlbHeader } from "./glb.js";

/** An avatar as three.js has it. */
export interface ReadAvatar {
  root: Object3D;
  /** Which bones the file says are a person's. */
  vrm?: HumanoidSource;
}

/** Larger files are refused before they fill the memory. */
const MAX_BYTES = 256e6;

/** Packings that need decoders which the page does not have. */
const UNREADABLE: Record<string, string> = {
  KHR_draco_mesh_compression: "packed by Draco; pack it by meshoptimizer, or not at all",
  KHR_texture_basisu: "textured with KTX2; use WebP, PNG or JPEG",
};

/**
 * Reads a GLB or VRM. What it names outside of itself is not fetched: nothing of it, not even an address,
 * leaves the machine.
 *
 * @throws Error with a sentence that says what is wrong
 */
export async function readAvatarFile(file: File): Promise<ReadAvatar> {
  if (file.size > MAX_BYTES) {
    throw new Error(`It has ${(file.size / 1e6).toFixed(0)} MB; the page reads up to 256 MB.`);
  }
  const header = await readGlbHeader(file);
  if (!header) throw new Error("It is no GLB or VRM file. Export the avatar as one of these.");
  for (const name of header.extensionsRequired ?? []) {
    const reason = typeof name === "string" ? UNREADABLE[name] : undefined;
    if (reason) throw new Error(`It is ${reason}.`);
  }
  const manager = new LoadingManager();
  manager.setURLModifier((url) => (/^(blob|data):/.test(url) ? url : "data:,"));
  const loader = new GLTFLoader(manager).setMeshoptDecoder(MeshoptDecoder);
  let gltf: GLTF;
  try {
    gltf = await loader.parseAsync(await file.arrayBuffer(), "");
  } catch (cause) {
    const reason = cause instanceof Error ? cause.message : String(cause);
    throw new Error(`It cannot be read: ${reason}`, { cause });
  }
  const vrm = await humanoidOf(gltf);
  if (facesAway(gltf)) gltf.scene.rotation.y = Math.PI;
  return { root: gltf.scene, ...(vrm && { vrm }) };
}

/** A VRM before 1.0 faces -Z. */
const facesAway = ({ parser }: GLTF) => extension(parser.json, "VRM") !== undefined;

function extension(json: { extensions?: Record<string, unknown> }, name: string): unknown {
  return json.extensions?.[name];
}

/** A bone of VRM's humanoid: a list of them in VRM 0.x, a record by name in 1.0. */
interface HumanBone {
  bone?: string;
  node?: number;
}

async function humanoidOf({ parser }: GLTF): Promise<HumanoidSource | null> {
  const found = (extension(parser.json, "VRMC_vrm") ?? extension(parser.json, "VRM")) as
    | { humanoid?: { humanBones?: HumanBone[] | Record<string, HumanBone> } }
    | undefined;
  const bones = Object.entries(found?.humanoid?.humanBones ?? {});
  const humanBones: Record<string, { node: Object3D }> = {};
  for (const [key, { bone, node }] of bones) {
    if (typeof node !== "number" || !parser.json.nodes?.[node]) continue;
    humanBones[bone ?? key] = { node: (await parser.getDependency("node", node)) as Object3D };
  }
  return Object.keys(humanBones).length > 0 ? { humanoid: { humanBones } } : null;
}
