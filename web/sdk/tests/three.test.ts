import { Avatar, JOINT_NAMES, type JointName, type Model, Motion, restPose } from "dynaskin";
import { DynaSkin } from "dynaskin/three";
import {
  Bone,
  Box3,
  BufferAttribute,
  Group,
  MathUtils,
  Matrix4,
  Mesh,
  type Object3D,
  Raycaster,
  type SkinnedMesh,
  Vector3,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { afterAll, beforeAll, describe, expect, it, vi } from "vitest";
import { quantised } from "../../../tests/avatars/quantised.js";
import { createThreadAvatar } from "./node-worker.js";
import {
  expectError,
  largestDifference,
  largestOffset,
  loadModel,
  readModelFile,
} from "./support.js";

// GLTFLoader asks the page for it, to make addresses of textures.
vi.stubGlobal("self", globalThis);

const SHAPE = [0.8, 1.5, -0.5, 0.4, 0, 0, 0, 0, 0, 0];

let model: Model;
beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => model.dispose());

/** The body as three.js loads it, in a group of its own. */
async function loadBody(change = (file: Uint8Array) => file) {
  const { buffer } = change(readModelFile("body.glb"));
  const { scene } = await new GLTFLoader().parseAsync(buffer as ArrayBuffer, "");
  const group = new Group().add(scene);
  return { group, mesh: scene.getObjectByProperty("isSkinnedMesh", true) as SkinnedMesh };
}

/** The body's mesh, with positions that are neither packed nor shared. */
async function loadLoose(): Promise<SkinnedMesh> {
  const { mesh } = await loadBody();
  const packed = mesh.geometry.getAttribute("position");
  const numbers = Float32Array.from({ length: 3 * packed.count }, (_, idx) =>
    packed.getComponent(Math.floor(idx / 3), idx % 3),
  );
  mesh.geometry.setAttribute("position", new BufferAttribute(numbers, 3));
  return mesh;
}

/** Writes the vertices in another order, which may name some twice and others never; triangles go. */
function reorder(mesh: SkinnedMesh, order: (vertices: number[]) => number[]): number[] {
  const { geometry } = mesh;
  const { count } = geometry.getAttribute("position");
  const vertices = order(Array.from({ length: count }, (_, vertex) => vertex));
  for (const [name, attribute] of Object.entries(geometry.attributes)) {
    const { itemSize, normalized } = attribute;
    const Numbers = attribute.array.constructor as Float32ArrayConstructor;
    const numbers = new Numbers(vertices.length * itemSize);
    for (const [idx, vertex] of vertices.entries()) {
      for (let slot = 0; slot < itemSize; slot += 1) {
        const number = attribute.getComponent(vertex, slot);
        numbers[idx * itemSize + slot] = normalized ? MathUtils.normalize(number, numbers) : number;
      }
    }
    geometry.setAttribute(name, new BufferAttribute(numbers, itemSize, normalized));
  }
  geometry.setIndex(null);
  geometry.morphAttributes = {};
  return vertices;
}

/** The mesh's vertices as three.js draws them, in the world. */
function drawnPositions(mesh: SkinnedMesh): Float32Array {
  let scene: Object3D = mesh;
  while (scene.parent) scene = scene.parent;
  scene.updateMatrixWorld();
  const { count } = mesh.geometry.getAttribute("position");
  const positions = new Float32Array(count * 3);
  const vertex = new Vector3();
  for (let idx = 0; idx < count; idx += 1) {
    mesh
      .getVertexPosition(idx, vertex)
      .applyMatrix4(mesh.matrixWorld)
      .toArray(positions, idx * 3);
  }
  return positions;
}

/** Plays a hop for a while and returns the largest offset that was seen, in metres. */
function hop(skin: DynaSkin, avatar: Avatar, seconds = 1.5): number {
  const motion = Motion.procedural("hop", avatar);
  let largest = 0;
  for (let tick = 0; tick < seconds * 60; tick += 1) {
    skin.writePose(motion.poseAt(tick / 60));
    skin.update(1 / 60);
    largest = Math.max(largest, largestOffset(avatar.offsets));
  }
  motion.dispose();
  return largest;
}

describe("DynaSkin in three.js", () => {
  it("finds the mesh in a group, and refuses a group with none or two", async () => {
    const { group, mesh } = await loadBody();
    const avatar = model.createAvatar();
    const skin = new DynaSkin(avatar, group);
    expect(skin.mesh).toBe(mesh);
    skin.dispose();
    const none = await expectError("argument", () => new DynaSkin(avatar, new Group()));
    expect(none.message).toContain("a group that holds one");
    group.add((await loadBody()).group);
    const two = await expectError("argument", () => new DynaSkin(avatar, group));
    expect(two.message).toContain("here are 2");
    avatar.dispose();
  });

  it("draws the surface that the avatar skins, for a body of another shape", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    expect(hop(skin, avatar)).toBeGreaterThan(0.002);
    expect(largestDifference(drawnPositions(mesh), avatar.skinned().positions)).toBeLessThan(2e-6);
    skin.dispose();
    avatar.dispose();
  });

  it("gives a giant and a dwarf the same tissue, wherever they stand", async () => {
    const offsets: Float32Array[] = [];
    for (const [scale, x, turn] of [
      [1, 0, 0],
      [10, 30, 1],
      [0.1, -2, -2],
    ] as const) {
      const { mesh, group } = await loadBody();
      group.scale.setScalar(scale);
      group.position.set(x, 0, x);
      group.rotation.y = turn;
      const avatar = model.createAvatar({ shape: SHAPE });
      const skin = new DynaSkin(avatar, mesh);
      hop(skin, avatar);
      offsets.push(avatar.offsets.slice());
      const height = new Box3().setFromArray(drawnPositions(mesh)).getSize(new Vector3()).y;
      expect(height / scale).toBeGreaterThan(1.5);
      expect(height / scale).toBeLessThan(2);
      skin.dispose();
      avatar.dispose();
    }
    const [usual = new Float32Array(), giant = [], dwarf = []] = offsets;
    expect(largestOffset(usual)).toBeGreaterThan(1e-3);
    expect(largestDifference(usual, giant)).toBeLessThan(1e-4);
    expect(largestDifference(usual, dwarf)).toBeLessThan(1e-4);
  });

  it("takes the size from the scene, whatever the avatar's own scale is", async () => {
    const offsets: Float32Array[] = [];
    for (const [avatarScale, groupScale] of [
      [1, 1],
      [2, 1],
      [0.5, 3],
    ] as const) {
      const { mesh, group } = await loadBody();
      group.scale.setScalar(groupScale);
      const avatar = model.createAvatar({ shape: SHAPE });
      const skin = new DynaSkin(avatar, mesh);
      hop(skin, avatar, 0.5);
      avatar.scale = avatarScale; // in mid-motion, as a slider would
      hop(skin, avatar);
      expect(avatar.timings.settled).toBe(false);
      offsets.push(avatar.offsets.slice());
      const drawn = drawnPositions(mesh).map((value) => value / groupScale);
      const skinned = avatar.skinned().positions.map((value) => value / avatarScale);
      expect(largestDifference(drawn, skinned)).toBeLessThan(4e-6);
      skin.dispose();
      avatar.dispose();
    }
    const [usual = new Float32Array(), scaled = [], both = []] = offsets;
    expect(largestOffset(usual)).toBeGreaterThan(1e-3);
    expect(largestDifference(usual, scaled)).toBeLessThan(1e-4);
    expect(largestDifference(usual, both)).toBeLessThan(1e-4);
  });

  it("finds the vertices of a mesh that was renumbered, split or cut", async () => {
    const orders: ((vertices: number[]) => number[])[] = [
      (vertices) => vertices.toReversed(),
      // Another at every third, as at seams.
      (vertices) => vertices.flatMap((vertex) => (vertex % 3 === 0 ? [vertex, vertex] : [vertex])),
      // Without its last third.
      (vertices) => vertices.slice(0, 4600),
    ];
    for (const order of orders) {
      const { mesh } = await loadBody();
      const vertices = reorder(mesh, order);
      const avatar = model.createAvatar({ shape: SHAPE });
      const skin = new DynaSkin(avatar, mesh);
      hop(skin, avatar);
      const { positions } = avatar.skinned();
      const expected = vertices.flatMap((vertex) => [
        ...positions.subarray(3 * vertex, 3 * vertex + 3),
      ]);
      expect(largestDifference(drawnPositions(mesh), expected)).toBeLessThan(4e-6);
      skin.dispose();
      avatar.dispose();
    }
  });

  it("finds them for an avatar in a worker", async () => {
    const { mesh } = await loadBody();
    const vertices = reorder(mesh, (all) => all.toReversed());
    const remote = await createThreadAvatar(SHAPE);
    const skin = new DynaSkin(remote, mesh);
    const expected = vertices.flatMap((vertex) => [
      ...remote.positions.subarray(3 * vertex, 3 * vertex + 3),
    ]);
    expect(largestDifference(drawnPositions(mesh), expected)).toBeLessThan(4e-6);
    skin.dispose();
    remote.dispose();
  });

  it("moves a body whose numbers the inverse bind matrices scale", async () => {
    const { mesh } = await loadBody(quantised);
    expect(mesh.geometry.getAttribute("position").array).toBeInstanceOf(Int16Array);
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    hop(skin, avatar);
    const { positions } = avatar.skinned();
    expect(largestDifference(drawnPositions(mesh), positions)).toBeLessThan(4e-6);
    skin.dispose();
    avatar.dispose();
  });

  it("finds the vertices of a mesh that lies where numbers are coarse", async () => {
    // Blender takes the units of a quantised file for metres, and moves each joint there by itself.
    const away = [0, 8619.249, 0];
    const { mesh } = await loadBody();
    const { skeleton } = mesh;
    const still = model.createAvatar();
    const { positions: restM } = still;
    const jointsM = still.restJointsM();
    const placed = Float32Array.from(jointsM, (metres, idx) => metres + (away[idx % 3] ?? 0));
    const vertices = reorder(mesh, (all) =>
      all.toReversed().flatMap((vertex) => (vertex % 3 === 0 ? [vertex, vertex] : [vertex])),
    );
    const { skinIndex, skinWeight } = mesh.geometry.attributes;
    const jointOf = skeleton.bones.map(({ name }) => JOINT_NAMES.indexOf(name as JointName));
    const numbers = Float32Array.from({ length: 3 * vertices.length }, (_, idx) => {
      const [at, axis] = [Math.floor(idx / 3), idx % 3];
      let sum = 0;
      for (let slot = 0; slot < 4; slot += 1) {
        const joint = 3 * (jointOf[skinIndex?.getComponent(at, slot) ?? 0] ?? 0) + axis;
        const own = (restM[3 * (vertices[at] ?? 0) + axis] ?? 0) - (jointsM[joint] ?? 0);
        sum += (skinWeight?.getComponent(at, slot) ?? 0) * ((placed[joint] ?? 0) + own);
      }
      return sum;
    });
    mesh.geometry.setAttribute("position", new BufferAttribute(numbers, 3));
    for (const [idx, bone] of skeleton.bones.entries()) {
      const [x = 0, y = 0, z = 0] = placed.subarray(3 * (jointOf[idx] ?? 0));
      skeleton.boneInverses[idx]?.makeTranslation(-x, -y, -z);
      if (bone.name === "pelvis") bone.position.set(x, y, z);
    }
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    hop(skin, avatar);
    const { positions } = avatar.skinned();
    const expected = vertices.flatMap((vertex) => [
      ...positions.subarray(3 * vertex, 3 * vertex + 3),
    ]);
    expect(largestDifference(drawnPositions(mesh), expected)).toBeLessThan(4e-6);
    for (const each of [skin, avatar, still]) each.dispose();
  });

  it("hands over the normals of the moved surface", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    const normal = mesh.geometry.getAttribute("normal") as BufferAttribute;
    const before = normal.array.slice();
    const { version } = normal;
    hop(skin, avatar);
    expect(normal.version).toBeGreaterThan(version);
    expect(largestDifference(normal.array, avatar.normals)).toBe(0);
    expect(largestDifference(normal.array, before)).toBeGreaterThan(0.005);
    skin.dispose();
    avatar.dispose();
  });

  it("reads the pose and shows the surface apart, for avatars that the page steps", async () => {
    const [alone, apart] = [await loadBody(), await loadBody()];
    const [one, other] = [model.createAvatar({ shape: SHAPE }), model.createAvatar()];
    const [updated, split] = [new DynaSkin(one, alone.mesh), new DynaSkin(other, apart.mesh)];
    other.setShape(SHAPE);
    const motion = Motion.procedural("hop", one);
    for (let tick = 0; tick < 90; tick += 1) {
      for (const skin of [updated, split]) skin.writePose(motion.poseAt(tick / 60));
      updated.update(1 / 60);
      other.step(split.readPose(), 1 / 60);
      split.show();
    }
    expect(largestOffset(other.offsets)).toBeGreaterThan(1e-3);
    expect(largestDifference(drawnPositions(apart.mesh), drawnPositions(alone.mesh))).toBe(0);
    for (const skin of [updated, split]) skin.dispose();
    await expectError("disposed", () => split.readPose());
    await expectError("disposed", () => split.show());
    for (const part of [one, other, motion]) part.dispose();
  });

  it("draws an avatar in a worker as one in the page, with its changes", async () => {
    const { mesh } = await loadBody();
    const here = model.createAvatar();
    const there = await createThreadAvatar();
    const skin = new DynaSkin(there, mesh);
    const motion = Motion.procedural("hop", here);
    let largest = 0;
    for (let tick = 0; tick < 90; tick += 1) {
      if (tick === 30) for (const avatar of [here, there]) avatar.setShape(SHAPE);
      if (tick === 50) for (const avatar of [here, there]) avatar.scale = 2;
      await there.whenAnswered();
      skin.writePose(motion.poseAt(tick / 60));
      skin.update(1 / 60);
      here.step(skin.pose, 1 / 60);
      await there.whenAnswered();
      largest = Math.max(largest, largestOffset(there.offsets));
    }
    skin.update(0);
    await there.whenAnswered();
    skin.update(0);
    expect(largest).toBeGreaterThan(2e-3);
    expect(largestDifference(there.offsets, here.offsets)).toBe(0);
    const skinned = here.skinned().positions.map((value) => value / 2);
    expect(largestDifference(drawnPositions(mesh), skinned)).toBeLessThan(4e-6);
    skin.dispose();
    there.dispose();
    here.dispose();
    motion.dispose();
  });

  it("reads no shape in a frame, which would allocate, and misses no small change", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    const skin = new DynaSkin(avatar, mesh);
    const read = vi.spyOn(Avatar.prototype, "shape", "get");
    const shape = new Float32Array(10);
    for (let frame = 1; frame <= 200; frame += 1) {
      shape.fill(frame / 5000);
      avatar.setShape(shape);
      skin.update(1 / 60);
    }
    expect(read).not.toHaveBeenCalled();
    read.mockRestore();
    expect(largestDifference(drawnPositions(mesh), avatar.skinned().positions)).toBeLessThan(2e-6);
    skin.dispose();
    avatar.dispose();
  });

  it("follows a change of shape with joints, skin and feet", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    const skin = new DynaSkin(avatar, mesh);
    skin.update(1 / 60);
    avatar.setShape(SHAPE);
    skin.update(1 / 60);
    const drawn = drawnPositions(mesh);
    expect(largestDifference(drawn, avatar.skinned().positions)).toBeLessThan(2e-6);
    expect(new Box3().setFromArray(drawn).min.y).toBeCloseTo(0, 3);
    skin.dispose();
    avatar.dispose();
  });

  it("follows a shape that comes with a saved state", async () => {
    const { mesh } = await loadBody();
    const [avatar, other] = [model.createAvatar(), model.createAvatar({ shape: SHAPE })];
    const skin = new DynaSkin(avatar, mesh);
    const { revision } = avatar;
    skin.update(1 / 60);
    expect(avatar.revision).toBe(revision);
    avatar.restore(other.save());
    expect(avatar.revision).not.toBe(revision);
    skin.update(1 / 60);
    expect(largestDifference(avatar.restJointsM(), other.restJointsM())).toBe(0);
    expect(largestDifference(drawnPositions(mesh), avatar.skinned().positions)).toBeLessThan(2e-6);
    skin.dispose();
    for (const made of [avatar, other]) made.dispose();
  });

  it("holds the body within its bounds, so that culling and raycasting see it", async () => {
    const { mesh, group } = await loadBody();
    group.position.set(5, 0, -3);
    group.scale.setScalar(2);
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    hop(skin, avatar);
    const bounds = mesh.boundingSphere.clone().applyMatrix4(mesh.matrixWorld);
    const drawn = drawnPositions(mesh);
    const points = Array.from({ length: drawn.length / 3 }, (_, idx) =>
      new Vector3().fromArray(drawn, idx * 3),
    );
    expect(points.every((point) => bounds.containsPoint(point))).toBe(true);
    expect(bounds.radius).toBeLessThan(2 * 2.5);
    const ray = new Raycaster(new Vector3(5, 2, 10), new Vector3(0, 0, -1));
    const [hit] = ray.intersectObject(mesh);
    expect(hit?.point.z).toBeGreaterThan(-3.1);
    expect(hit?.point.z).toBeLessThan(-2);
    skin.dispose();
    avatar.dispose();
  });

  it("counts the negative first frame of three's Timer as no time", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    const skin = new DynaSkin(avatar, mesh);
    skin.update(-0.02);
    await expectError("argument", () => skin.update(Number.NaN));
    skin.update(1 / 60);
    skin.dispose();
    avatar.dispose();
  });

  it("restores the mesh on dispose, which may be repeated", async () => {
    const { mesh } = await loadBody();
    const before = drawnPositions(mesh);
    const { geometry, skeleton, boundingSphere, boundingBox } = mesh;
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    expect(largestDifference(drawnPositions(mesh), before)).toBeGreaterThan(0.01);
    skin.dispose();
    skin.dispose();
    expect(mesh.geometry).toBe(geometry);
    expect(mesh.skeleton).toBe(skeleton);
    expect(mesh.boundingSphere).toBe(boundingSphere);
    expect(mesh.boundingBox).toBe(boundingBox);
    expect(largestDifference(drawnPositions(mesh), before)).toBe(0);
    await expectError("disposed", () => skin.update(1 / 60));
    await expectError("disposed", () => skin.writePose(restPose()));
    // As React's strict mode does: again, on the same mesh.
    new DynaSkin(avatar, mesh).dispose();
    avatar.dispose();
  });

  it("leaves the mesh's surface alone when the avatar was disposed of", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    const skin = new DynaSkin(avatar, mesh);
    const before = drawnPositions(mesh);
    avatar.dispose();
    await expectError("disposed", () => skin.update(1 / 60));
    expect(largestDifference(drawnPositions(mesh), before)).toBe(0);
    skin.dispose();
  });
});

describe("meshes that do not fit", () => {
  it.each([
    ["a mesh without skin", () => new Mesh() as unknown as SkinnedMesh],
    ["nothing", () => undefined as unknown as SkinnedMesh],
  ])("%s", async (_what, mesh) => {
    const avatar = model.createAvatar();
    await expectError("argument", () => new DynaSkin(avatar, mesh()));
    avatar.dispose();
  });

  it("a mesh that another moves already, nothing for an avatar, odd options", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    const { geometry } = mesh;
    const first = new DynaSkin(avatar, mesh);
    await expectError("argument", () => new DynaSkin(avatar, mesh));
    first.dispose();
    expect(mesh.geometry).toBe(geometry);
    for (const [nothing, options] of [[undefined], [null], [{}], [mesh], [avatar, null]]) {
      await expectError("argument", () => new DynaSkin(nothing as Avatar, mesh, options as object));
    }
    expect(mesh.geometry).toBe(geometry);
    new DynaSkin(avatar, mesh).dispose();
    avatar.dispose();
    await expectError("disposed", () => new DynaSkin(avatar, mesh));
    expect(mesh.geometry).toBe(geometry);
  });

  it("bones with other names, unless they are named", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    const neck = mesh.skeleton.getBoneByName("neck") ?? new Bone();
    neck.name = "Neck_01";
    const error = await expectError("argument", () => new DynaSkin(avatar, mesh));
    expect(error.message).toContain("neck");
    new DynaSkin(avatar, mesh, { boneNames: { neck: "Neck_01" } }).dispose();
    avatar.dispose();
  });

  it("bones whose rest frames are turned", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    const [inverse] = mesh.skeleton.boneInverses;
    inverse?.premultiply(inverse.clone().makeRotationX(1));
    await expectError("argument", () => new DynaSkin(avatar, mesh));
    avatar.dispose();
  });

  it("a vertex map of the wrong length, or beyond the body", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    const identity = Array.from({ length: 6890 }, (_, idx) => idx);
    await expectError("argument", () => new DynaSkin(avatar, mesh, { vertexMap: [0, 1] }));
    await expectError(
      "argument",
      () => new DynaSkin(avatar, mesh, { vertexMap: identity.with(7, 6890) }),
    );
    const skin = new DynaSkin(avatar, mesh, { vertexMap: identity });
    skin.update(1 / 60);
    expect(largestDifference(drawnPositions(mesh), avatar.skinned().positions)).toBeLessThan(2e-6);
    skin.dispose();
    avatar.dispose();
  });

  it("a mesh with other vertices, of which one is none of the body's", async () => {
    const avatar = model.createAvatar({ shape: SHAPE });
    const mesh = await loadLoose();
    reorder(mesh, (vertices) => vertices.slice(10));
    const { array } = mesh.geometry.getAttribute("position");
    array[7] = (array[7] ?? 0) + 200;
    const { message } = await expectError("argument", () => new DynaSkin(avatar, mesh));
    expect(message).toContain("Not all of them lie where vertices of the body do");
    avatar.dispose();
  });

  it("vertices that are not where the body's are", async () => {
    const avatar = model.createAvatar({ shape: SHAPE });
    const count = 6890;
    const { mesh: whole } = await loadBody();
    const backwards = Array.from({ length: count }, (_, idx) => count - 1 - idx);
    await expectError("argument", () => new DynaSkin(avatar, whole, { vertexMap: backwards }));

    // A packer that writes vertices in another order.
    const renumbered = await loadLoose();
    const { array } = renumbered.geometry.getAttribute("position");
    const order = Array.from({ length: count }, (_, idx) => (idx * 7) % count);
    const before = array.slice();
    for (const [idx, from] of order.entries()) {
      array.set(before.subarray(3 * from, 3 * from + 3), 3 * idx);
    }
    new DynaSkin(avatar, renumbered).dispose();
    new DynaSkin(avatar, renumbered, { vertexMap: order }).dispose();
    // From elsewhere, nobody knows the body.
    const { positions, normals, shape, revision, scale } = avatar;
    const remote = { positions, normals, shape, revision, scale, step() {} };
    const restJointsM = () => avatar.restJointsM();
    const refusal = await expectError(
      "argument",
      () => new DynaSkin({ ...remote, restJointsM }, renumbered),
    );
    expect(refusal.message).toContain("renumbered");

    // Units that lie beside each other: rest at kilometres, as Blender writes quantised files.
    const large = await loadLoose();
    large.geometry.getAttribute("position").array.forEach((number, idx, all) => {
      all[idx] = 10_000 * number;
    });
    await expectError("argument", () => new DynaSkin(avatar, large));

    // VRM 0.x faces -Z: bones without rotations do not say so.
    const turned = await loadLoose();
    const half = new Matrix4().makeRotationY(Math.PI);
    for (const inverse of turned.skeleton.boneInverses) {
      const place = new Vector3().setFromMatrixPosition(inverse.clone().invert());
      const scale = new Vector3().setFromMatrixScale(inverse);
      const size = new Matrix4().makeScale(1 / scale.x, 1 / scale.y, 1 / scale.z);
      inverse.copy(new Matrix4().setPosition(place.applyMatrix4(half)).multiply(size)).invert();
    }
    turned.geometry.applyMatrix4(half);
    await expectError("argument", () => new DynaSkin(avatar, turned));

    // Whatever its shape, the body's own mesh is taken.
    const extreme = model.createAvatar({ shape: [5, -4, 3, -3, 2, 2, -2, 2, -2, 2] });
    const { mesh } = await loadBody();
    new DynaSkin(extreme, mesh).dispose();
    extreme.dispose();
    avatar.dispose();
  });
});
