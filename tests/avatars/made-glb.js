// The avatar of made.js as a binary glTF file, for engines that want one.
import { Document, NodeIO } from "@gltf-transform/core";
import { BONES, BUST_BONES, bustOf, madeArrays, PARENTS } from "./made.js";

const SPINE3 = 9;

/**
 * An avatar whose breasts have bones.
 *
 * @param {import("dynaskin").Model} model
 * @returns {Promise<{ bytes: Uint8Array, tips: number[] }>}
 */
export async function madeGlb(model) {
  const { positions, normals, places, faces } = madeArrays(model);
  const bust = bustOf(model, positions);
  const document = new Document();
  const buffer = document.createBuffer();
  /** @type {(type: any, array: any) => import("@gltf-transform/core").Accessor} */
  const accessor = (type, array) =>
    document.createAccessor().setType(type).setArray(array).setBuffer(buffer);
  const names = [...BONES.map((name) => `mixamorig:${name}`), ...BUST_BONES];
  const bones = names.map((name) => document.createNode(name));
  /** @type {number[][]} */
  const world = [];
  const at = (/** @type {number[]} */ place) => /** @type {[number, number, number]} */ (place);
  for (const [idx, bone] of bones.entries()) {
    const isBust = idx >= BONES.length;
    const parent = isBust ? SPINE3 : (PARENTS[idx] ?? -1);
    const above = world[parent] ?? [0, 0, 0];
    const own = isBust ? bust.places[idx - BONES.length] : null;
    const local = own ? own.map((metres, axis) => metres - (above[axis] ?? 0)) : places[idx];
    world.push((local ?? []).map((metres, axis) => metres + (above[axis] ?? 0)));
    bone.setTranslation(at(local ?? []));
    bones[parent]?.addChild(bone);
  }
  const inverses = world.flatMap(([x = 0, y = 0, z = 0]) =>
    [
      [1, 0, 0, 0],
      [0, 1, 0, 0],
      [0, 0, 1, 0],
      [-x, -y, -z, 1],
    ].flat(),
  );
  const skin = document
    .createSkin()
    .setInverseBindMatrices(accessor("MAT4", Float32Array.from(inverses)));
  for (const bone of bones) skin.addJoint(bone);
  const primitive = document
    .createPrimitive()
    .setAttribute("POSITION", accessor("VEC3", positions))
    .setAttribute("NORMAL", accessor("VEC3", normals))
    .setAttribute("JOINTS_0", accessor("VEC4", bust.joints))
    .setAttribute("WEIGHTS_0", accessor("VEC4", bust.weights))
    .setIndices(accessor("SCALAR", faces[0] ?? new Uint32Array(0)));
  const mesh = document.createMesh("body").addPrimitive(primitive);
  const node = document.createNode("body").setMesh(mesh).setSkin(skin);
  const scene = document.createScene().addChild(node);
  if (bones[0]) scene.addChild(bones[0]);
  return { bytes: await new NodeIO().writeBinary(document), tips: bust.tips };
}
