// An avatar made of the package's own body, in Node and in browsers alike: other names of bones, another
// unit, other arrays. What its vertices should do is known: as those of the body.

/**
 * @typedef {object} Options How the avatar is made.
 * @property {number} [unitsPerM] units of the file in a metre
 * @property {boolean} [quantised] whether positions are 16-bit integers among other numbers
 * @property {boolean} [bust] whether breasts have bones, as VRoid calls them
 * @property {boolean} [split] whether the mesh is two, above and below its middle, that share vertices
 */

/** Mixamo's names of the body's joints, in the body's order. */
export const BONES = [
  ...["Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine1", "LeftFoot"],
  ...["RightFoot", "Spine2", "LeftToeBase", "RightToeBase", "Neck", "LeftShoulder"],
  ...["RightShoulder", "Head", "LeftArm", "RightArm", "LeftForeArm", "RightForeArm", "LeftHand"],
  ...["RightHand", "LeftHandMiddle1", "RightHandMiddle1"],
];

/** The joint above each, in the body's order. */
export const PARENTS = [
  ...[-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21],
];

/** Bones of the breasts, left and right. */
export const BUST_BONES = ["J_Sec_L_Bust1", "J_Sec_R_Bust1"];
/** How far from its most forward vertex a breast follows its bone, metres. */
const BUST_M = 0.1;
/** How far behind that vertex the bone is, metres. */
const BUST_BONE_M = 0.08;
const SPINE3 = 9;

/** Materials of the parts. */
export const MATERIALS = ["Suit", "Armor"];

/**
 * The arrays of an avatar that is made of a model's body.
 *
 * @param {import("dynaskin").Model} model
 * @param {Options} options
 */
export function madeArrays(model, { unitsPerM = 1, split = false } = {}) {
  const avatar = model.body.createAvatar();
  const jointsM = avatar.restJointsM();
  const positions = avatar.positions.map((metres) => metres * unitsPerM);
  const normals = avatar.normals.slice();
  avatar.dispose();
  /** @type {(joint: number, axis: number) => number} */
  const at = (joint, axis) => (joint < 0 ? 0 : (jointsM[3 * joint + axis] ?? 0) * unitsPerM);
  const places = PARENTS.map((parent, joint) =>
    [0, 1, 2].map((axis) => at(joint, axis) - at(parent, axis)),
  );
  return { positions, normals, places, faces: parts(model.body.faces, positions, split) };
}

/**
 * Triangles above the middle and below it, or all of them.
 *
 * @param {Uint32Array} faces
 * @param {Float32Array} positions
 * @param {boolean} split
 */
function parts(faces, positions, split) {
  if (!split) return [faces];
  const middle = 0.5 * positions.reduce((most, number) => Math.max(most, number), 0);
  /** @type {[number[], number[]]} */
  const halves = [[], []];
  for (let at = 0; at < faces.length; at += 3) {
    const corners = [...faces.subarray(at, at + 3)];
    const height = positions[3 * (corners[0] ?? 0) + 1] ?? 0;
    halves[height > middle - 0.5 * middle ? 0 : 1].push(...corners);
  }
  return halves.map((corners) => Uint32Array.from(corners));
}

/**
 * Gives breasts to bones of their own: where the bones are, and skin that follows them. All in metres.
 *
 * @param {import("dynaskin").Model} model
 * @param {Float32Array} positions
 */
export function bustOf(model, positions) {
  const joints = Uint16Array.from(model.body.skinJoints);
  const weights = model.body.skinWeights.slice();
  const vertices = Array.from({ length: positions.length / 3 }, (_, vertex) => vertex);
  /** @type {(vertex: number, axis: number) => number} */
  const at = (vertex, axis) => positions[3 * vertex + axis] ?? 0;
  // Between navel and collar.
  const chest = vertices.filter((vertex) => at(vertex, 1) > 1.1 && at(vertex, 1) < 1.35);
  const tips = [1, -1].map((side) =>
    chest
      .filter((vertex) => side * at(vertex, 0) > 0.03 && side * at(vertex, 0) < 0.15)
      .reduce((best, vertex) => (at(vertex, 2) > at(best, 2) ? vertex : best)),
  );
  for (const [bone, tip] of tips.entries()) {
    for (const vertex of vertices) {
      const apartM = Math.hypot(...[0, 1, 2].map((axis) => at(vertex, axis) - at(tip, axis)));
      const own = Math.max(0, 1 - apartM / BUST_M);
      if (own === 0 || weights[4 * vertex + 3] !== 0) continue;
      for (let slot = 0; slot < 3; slot += 1) weights[4 * vertex + slot] *= 1 - own;
      joints[4 * vertex + 3] = BONES.length + bone;
      weights[4 * vertex + 3] = own;
    }
  }
  const places = tips.map((tip) => [at(tip, 0), at(tip, 1), at(tip, 2) - BUST_BONE_M]);
  return { tips, places, joints, weights };
}

/**
 * The avatar in three.js.
 *
 * @param {typeof import("three")} THREE
 * @param {import("dynaskin").Model} model
 * @param {Options} options
 * @returns {{ root: import("three").Group, meshes: import("three").SkinnedMesh[], tips: number[] }}
 */
export function makeInThree(THREE, model, options = {}) {
  const { positions, normals, places, faces } = madeArrays(model, options);
  const bones = BONES.map((name, joint) => {
    const bone = new THREE.Bone();
    // As GLTFLoader does, which takes colons out.
    bone.name = `mixamorig${name}`;
    bone.userData.name = `mixamorig:${name}`;
    bone.position.fromArray(places[joint] ?? []);
    return bone;
  });
  for (const [joint, bone] of bones.entries()) bones[PARENTS[joint] ?? -1]?.add(bone);
  const bust = options.bust ? bustOf(model, positions) : null;
  for (const [idx, place] of (bust?.places ?? []).entries()) {
    const bone = new THREE.Bone();
    bone.name = BUST_BONES[idx] ?? "";
    bones[0]?.updateWorldMatrix(true, true);
    bones[SPINE3]?.add(bone);
    bone.position.copy(bones[SPINE3]?.worldToLocal(new THREE.Vector3(...place)) ?? bone.position);
    bones.push(bone);
  }
  const armature = new THREE.Group();
  armature.name = "Armature";
  if (bones[0]) armature.add(bones[0]);
  const root = new THREE.Group().add(armature);
  root.updateMatrixWorld(true);

  const skeleton = new THREE.Skeleton(bones);
  const bindMatrix = new THREE.Matrix4();
  /** @type {Record<string, import("three").BufferAttribute | import("three").InterleavedBufferAttribute>} */
  const attributes = {
    position: new THREE.BufferAttribute(positions, 3),
    normal: new THREE.BufferAttribute(normals, 3),
    color: new THREE.BufferAttribute(model.body.colors, 4, true),
    skinIndex: new THREE.BufferAttribute(bust?.joints ?? model.body.skinJoints, 4),
    skinWeight: new THREE.BufferAttribute(bust?.weights ?? model.body.skinWeights, 4),
  };
  if (options.quantised) {
    const extent = positions.reduce((most, number) => Math.max(most, Math.abs(number)), 0);
    const words = new Int16Array((positions.length / 3) * 4);
    for (const [idx, number] of positions.entries()) {
      words[4 * Math.floor(idx / 3) + (idx % 3)] = Math.round((32_767 * number) / extent);
    }
    const buffer = new THREE.InterleavedBuffer(words, 4);
    attributes.position = new THREE.InterleavedBufferAttribute(buffer, 3, 0, true);
    bindMatrix.makeScale(extent, extent, extent);
  }
  const meshes = faces.map((corners, part) => {
    const geometry = new THREE.BufferGeometry();
    for (const [name, attribute] of Object.entries(attributes)) {
      geometry.setAttribute(name, attribute);
    }
    geometry.setIndex(new THREE.BufferAttribute(corners, 1));
    const material = new THREE.MeshStandardMaterial({ vertexColors: true });
    material.name = MATERIALS[part] ?? "";
    const mesh = new THREE.SkinnedMesh(geometry, material);
    mesh.name = `part ${part}`;
    root.add(mesh);
    mesh.bind(skeleton, bindMatrix);
    return mesh;
  });
  return { root, meshes, tips: bust?.tips ?? [] };
}
