import { type Model, Motion } from "dynaskin";
import { AvatarTissue, Binding, type BindOptions, bindAvatar } from "dynaskin/three";
import * as THREE from "three";
import { clone } from "three/addons/utils/SkeletonUtils.js";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { makeInThree, type Options } from "../../../tests/avatars/made.js";
import { nodeWorker } from "./node-worker.js";
import { coreMemory, expectError, largestDifference, largestOffset, loadModel } from "./support.js";

const ADULT: BindOptions = { depicts: "adult", worker: false };

let model: Model;
let binding: Binding;
beforeAll(async () => {
  model = await loadModel();
  binding = await bindAvatar(model, makeInThree(THREE, model).root, ADULT);
});
afterAll(() => model.dispose());

/** Positions that a mesh shows, before skinning. */
function shown(mesh: THREE.SkinnedMesh | undefined): Float32Array {
  return mesh?.geometry.getAttribute("position").array as Float32Array;
}

/** Tangents that lie across the normals, left-handed. */
function tangentsOf(normals: Float32Array): Float32Array {
  const tangents = new Float32Array((4 * normals.length) / 3);
  const normal = new THREE.Vector3();
  const [up, ahead] = [new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1)];
  for (let vertex = 0; 3 * vertex < normals.length; vertex += 1) {
    normal.fromArray(normals, 3 * vertex);
    const across = Math.abs(normal.y) < 0.9 ? up : ahead;
    const tangent = new THREE.Vector3().crossVectors(across, normal).normalize();
    tangents.set([...tangent.toArray(), -1], 4 * vertex);
  }
  return tangents;
}

/** Plays a hop; `each` sees every frame. */
function hop(tissue: AvatarTissue, each: () => void = () => {}, ticks = 60): void {
  const motion = Motion.procedural("hop", tissue.avatar);
  for (let tick = 0; tick < ticks; tick += 1) {
    tissue.writePose(motion.poseAt(tick / 60));
    tissue.update(1 / 60);
    each();
  }
  motion.dispose();
}

/** The farthest that vertices get from where they are without tissue, over a hop, units of the mesh. */
function farthest(tissue: AvatarTissue, mesh: THREE.SkinnedMesh | undefined, still: Float32Array) {
  let most = 0;
  hop(tissue, () => {
    most = Math.max(most, largestOffset(shown(mesh).map((at, idx) => at - (still[idx] ?? 0))));
  });
  return most;
}

/** The farthest that a coordinate of the body is from 0, metres. */
function largestOf(model: Model): number {
  const avatar = model.body.createAvatar();
  const largest = avatar.positions.reduce((most, at) => Math.max(most, Math.abs(at)), 0);
  avatar.dispose();
  return largest;
}

describe("bindAvatar in three.js", () => {
  it("finds the body that the avatar was made of", () => {
    const { report } = binding;
    expect(report.bones).toContainEqual({ joint: "left_hip", bone: "mixamorig:LeftUpLeg" });
    // Fingers turn no palm.
    expect(report.missing).toEqual(["left_hand", "right_hand"]);
    expect(report.shareClose).toBeGreaterThan(0.98);
    expect(report.medianM).toBeLessThan(0.005);
    expect(report.moving).toBeGreaterThan(2000);
    expect(report.regionsOff).toEqual([]);
    expect(report.meshes).toMatchObject([{ name: "part 0", material: "Suit", vertices: 6890 }]);
    expect(report.proportions.statureM).toBeGreaterThan(1.5);
  });

  it("gives the same bytes in a worker, and says how far it is", async () => {
    const told: number[] = [];
    const { root } = makeInThree(THREE, model);
    const there = await bindAvatar(model, root, {
      depicts: "adult",
      createWorker: nodeWorker,
      onProgress: (fraction) => told.push(fraction),
    });
    expect(there.toBytes()).toEqual(binding.toBytes());
    expect(told.at(0)).toBe(0);
    expect(told.at(-1)).toBe(1);
    expect(told.length).toBeGreaterThan(5);
    expect(told).toEqual(told.toSorted((a, b) => a - b));
  });

  it("stops when it is told to", async () => {
    const stop = new AbortController();
    const { root } = makeInThree(THREE, model);
    const work = bindAvatar(model, root, {
      depicts: "adult",
      createWorker: nodeWorker,
      signal: stop.signal,
    });
    stop.abort(new Error("enough"));
    await expect(work).rejects.toThrow("enough");
  });

  it("refuses what it must, in a sentence", async () => {
    const { root } = makeInThree(THREE, model);
    const bind = (options: unknown, what: unknown = root) =>
      bindAvatar(model, what as THREE.Object3D, { worker: false, ...(options as BindOptions) });
    await expectError("adult", () => bind({}));
    await expectError("adult", () => bind({ depicts: "child" }));
    await expectError("avatar", () => bind(ADULT, new THREE.Group()));
    await expectError("argument", () => bind(ADULT, { name: "no object" }));
    await expectError("argument", () => bind({ depicts: "adult", bones: { nose: "x" } }));
    await expectError("humanoid", () => bind({ depicts: "adult", bones: { left_hip: "x" } }));
    await expectError("argument", () =>
      bindAvatar({} as Model, root, { depicts: "adult", worker: false }),
    );

    const child = makeInThree(THREE, model).root;
    child.children[0]?.scale.setScalar(0.8);
    await expectError("adult", () => bind(ADULT, new THREE.Group().add(child)));

    const { root: broken, meshes } = makeInThree(THREE, model);
    shown(meshes[0])[7] = Number.NaN;
    await expectError("avatar", () => bind(ADULT, broken));

    const { root: apart, meshes: loose } = makeInThree(THREE, model);
    loose[0]?.skeleton.bones[3]?.removeFromParent();
    await expectError("avatar", () => bind(ADULT, apart));
  });

  it("takes VRM's word for bones, and not that of the normalised ones", async () => {
    const { root, meshes } = makeInThree(THREE, model);
    const bones = meshes[0]?.skeleton.bones ?? [];
    for (const [joint, bone] of bones.entries()) bone.userData.name = `b${joint}`;
    const named = ["hips", "leftUpperLeg", "rightUpperLeg", "spine", "leftLowerLeg"];
    named.push("rightLowerLeg", "chest", "leftFoot", "rightFoot", "upperChest", "leftToes");
    named.push("rightToes", "neck", "leftShoulder", "rightShoulder", "head", "leftUpperArm");
    named.push("rightUpperArm", "leftLowerArm", "rightLowerArm", "leftHand", "rightHand");
    const humanBones = Object.fromEntries(
      named.map((name, joint) => [name, { node: bones[joint] as THREE.Object3D }]),
    );
    const rig = new THREE.Group();
    rig.name = "VRMHumanoidRig";
    root.add(rig);
    const found = await bindAvatar(model, root, { ...ADULT, vrm: { humanoid: { humanBones } } });
    expect(found.report.bones).toContainEqual({ joint: "left_hip", bone: "b1" });
    expect(found.report.missing).toEqual(["left_hand", "right_hand"]);
    expect(found.report.notes).toEqual([]);
    const byShape = await bindAvatar(model, root, ADULT);
    expect(byShape.report.notes.join()).toContain("names tell nothing");
  });

  it("wherever the avatar stands and whatever its arrays are", async () => {
    const variants: Options[] = [{ unitsPerM: 100 }, { quantised: true }, { split: true }];
    for (const options of variants) {
      const { root, meshes } = makeInThree(THREE, model, options);
      root.position.set(3, -1, 2);
      root.rotation.set(0.3, 2, -0.2);
      const own = await bindAvatar(model, root, ADULT);
      expect(own.report.shareClose, JSON.stringify(options)).toBeGreaterThan(0.98);
      const tissue = new AvatarTissue(model, root, own);
      expect(tissue.movingVertices).toBeGreaterThan(2000);
      const most = farthest(tissue, meshes[0], shown(meshes[0]).slice());
      // Quantised positions are shares of the largest.
      const unit = options.quantised ? 1 / largestOf(model) : (options.unitsPerM ?? 1);
      expect(most / unit).toBeGreaterThan(0.004);
      expect(most / unit).toBeLessThan(0.02);
      tissue.dispose();
    }
  });
});

describe("AvatarTissue in three.js", () => {
  it("moves the vertices as those of the body they were made of", () => {
    const { root, meshes } = makeInThree(THREE, model);
    const still = shown(meshes[0]).slice();
    const tissue = new AvatarTissue(model, root, binding);
    let [worst, most] = [0, 0];
    hop(tissue, () => {
      const { offsets } = tissue.avatar;
      const moved = shown(meshes[0]).map((at, idx) => at - (still[idx] ?? 0));
      worst = Math.max(worst, largestDifference(moved, offsets));
      most = Math.max(most, largestOffset(offsets));
    });
    expect(most).toBeGreaterThan(0.004);
    expect(worst).toBeLessThan(0.15 * most);
    tissue.dispose();
  });

  it("writes poses that it reads again, wherever the root is", () => {
    const { root } = makeInThree(THREE, model);
    root.position.set(2, 0.5, -1);
    root.scale.setScalar(1.5);
    const tissue = new AvatarTissue(model, root, binding);
    const motion = Motion.procedural("hop", tissue.avatar);
    const pose = motion.poseAt(0.4);
    tissue.writePose(pose);
    tissue.update(1 / 60);
    expect(largestDifference(tissue.pose.subarray(7), pose.subarray(7))).toBeLessThan(1e-5);
    // The pose is the world's, in the avatar's own size: the pelvis stands where the root takes it.
    const joints = tissue.avatar.restJointsM();
    const expected = [0, 1, 2].map(
      (axis) => (pose[axis] ?? 0) + root.position.getComponent(axis) / 1.5,
    );
    expect(joints[1]).toBeGreaterThan(0.8);
    expect(largestDifference(tissue.pose.subarray(0, 3), expected)).toBeLessThan(1e-4);
    motion.dispose();
    tissue.dispose();
  });

  it("gives everything back", () => {
    const { root, meshes } = makeInThree(THREE, model, { split: false });
    const { geometry } = meshes[0] as THREE.SkinnedMesh;
    const before = shown(meshes[0]).slice();
    const tissue = new AvatarTissue(model, root, binding);
    hop(tissue);
    expect(meshes[0]?.geometry).not.toBe(geometry);
    tissue.dispose();
    tissue.dispose();
    expect(meshes[0]?.geometry).toBe(geometry);
    expect(shown(meshes[0])).toEqual(before);
    return expectError("disposed", () => tissue.update(1 / 60));
  });

  it("adds to morph targets, relative and absolute", () => {
    for (const relative of [true, false]) {
      const { root, meshes } = makeInThree(THREE, model);
      const mesh = meshes[0] as THREE.SkinnedMesh;
      const still = shown(mesh).slice();
      const lift = still.map((at, idx) => (relative ? 0 : at) + (idx % 3 === 1 ? 0.1 : 0));
      mesh.geometry.morphAttributes.position = [new THREE.BufferAttribute(lift, 3)];
      mesh.geometry.morphTargetsRelative = relative;
      mesh.updateMorphTargets();
      mesh.morphTargetInfluences = [0.5];
      const tissue = new AvatarTissue(model, root, binding);
      hop(tissue, undefined, 30);
      const { geometry } = mesh;
      const target = geometry.morphAttributes.position?.[0];
      expect(geometry.morphTargetsRelative).toBe(true);
      for (const idx of [100, 3000, 5000]) {
        expect(target?.getX(idx)).toBeCloseTo(0, 6);
        expect(target?.getY(idx)).toBeCloseTo(0.1, 6);
      }
      tissue.dispose();
      expect(mesh.geometry.morphTargetsRelative).toBe(relative);
      expect(mesh.morphTargetInfluences).toEqual([0.5]);
    }
  });

  it("keeps tangents in the plane of the normals, packed or not", () => {
    for (const isPacked of [false, true]) {
      const { root, meshes } = makeInThree(THREE, model);
      const mesh = meshes[0] as THREE.SkinnedMesh;
      const { geometry } = mesh;
      const tangents = tangentsOf(geometry.getAttribute("normal").array as Float32Array);
      const numbers = isPacked ? Int8Array.from(tangents, (at) => Math.round(127 * at)) : tangents;
      geometry.setAttribute("tangent", new THREE.BufferAttribute(numbers, 4, isPacked));
      const tissue = new AvatarTissue(model, root, binding);
      const read = (name: string) => mesh.geometry.getAttribute(name).array as Float32Array;
      const still = read("tangent").slice();
      let [turned, worst] = [0, 0];
      hop(tissue, () => {
        turned = Math.max(turned, largestDifference(read("tangent"), still));
      });
      const [normal, tangent] = [read("normal"), read("tangent")];
      for (let vertex = 0; vertex < tangent.length / 4; vertex += 1) {
        const [x = 0, y = 0, z = 0, side] = tangent.subarray(4 * vertex, 4 * vertex + 4);
        const [nx = 0, ny = 0, nz = 0] = normal.subarray(3 * vertex, 3 * vertex + 3);
        expect(side).toBe(-1);
        worst = Math.max(worst, Math.abs(x * nx + y * ny + z * nz));
      }
      expect(turned).toBeGreaterThan(0.02);
      // What is packed is off by itself.
      expect(worst).toBeLessThan(isPacked ? 0.02 : 1e-5);
      tissue.dispose();
      expect(mesh.geometry.getAttribute("tangent").array).toBe(numbers);
    }
  });

  it("leaves alone what is excluded, and moves less what is stiff", async () => {
    const { root, meshes } = makeInThree(THREE, model, { split: true });
    const split = await bindAvatar(model, root, ADULT);
    const [upper, lower] = meshes as [THREE.SkinnedMesh, THREE.SkinnedMesh];
    const { geometry } = lower;
    const still = shown(upper).slice();
    const measured = (stiffness: number) => {
      const tissue = new AvatarTissue(model, root, split, {
        exclude: (_mesh, material) => /armor/i.test(material.name),
        stiffness: () => stiffness,
      });
      expect(lower.geometry).toBe(geometry);
      const most = farthest(tissue, upper, still);
      tissue.dispose();
      return most;
    };
    const whole = measured(0);
    expect(whole).toBeGreaterThan(0.004);
    expect(measured(0.5) / whole).toBeCloseTo(0.5, 2);
    await expectError("argument", () => measured(2));
  });

  it("writes shared vertices once, and skips what is hidden", async () => {
    const { root, meshes } = makeInThree(THREE, model, { split: true });
    const split = await bindAvatar(model, root, ADULT);
    const [upper, lower] = meshes as [THREE.SkinnedMesh, THREE.SkinnedMesh];
    const tissue = new AvatarTissue(model, root, split);
    expect(upper.geometry.getAttribute("position")).toBe(lower.geometry.getAttribute("position"));
    expect(upper.geometry.index).not.toBe(lower.geometry.index);
    upper.visible = false;
    lower.visible = false;
    const before = shown(upper).slice();
    hop(tissue);
    expect(shown(upper)).toEqual(before);
    lower.visible = true;
    tissue.update(1 / 60);
    expect(shown(upper)).not.toEqual(before);
    tissue.dispose();
  });

  it("keeps levels of detail up to date, as the renderer chooses one when it draws", () => {
    const { root, meshes } = makeInThree(THREE, model);
    const fine = meshes[0] as THREE.SkinnedMesh;
    const coarse = new THREE.SkinnedMesh(fine.geometry.clone(), fine.material);
    coarse.bind(fine.skeleton, fine.bindMatrix);
    const lod = new THREE.LOD();
    root.add(lod.addLevel(fine, 0).addLevel(coarse, 5));
    const camera = new THREE.PerspectiveCamera();
    lod.update(camera);
    expect(coarse.visible).toBe(false);
    const tissue = new AvatarTissue(model, root, binding);
    const still = shown(coarse).slice();
    hop(tissue, undefined, 20);
    expect(shown(coarse)).not.toEqual(still);
    expect(shown(coarse)).toEqual(shown(fine));
    // Who chooses them before the tissue moves pays for one alone.
    lod.autoUpdate = false;
    const before = shown(coarse).slice();
    hop(tissue, undefined, 20);
    expect(shown(coarse)).toEqual(before);
    camera.position.z = 10;
    camera.updateMatrixWorld();
    lod.update(camera);
    tissue.update(1 / 60);
    expect(shown(coarse)).not.toEqual(before);
    tissue.dispose();
  });

  it("plays on clones, each with a surface of its own", () => {
    const { root, meshes } = makeInThree(THREE, model);
    const tissue = new AvatarTissue(model, root, binding);
    hop(tissue, undefined, 20);
    const twin = clone(root);
    const twinMesh = twin.getObjectByProperty("isSkinnedMesh", true) as THREE.SkinnedMesh;
    const other = new AvatarTissue(model, twin, binding);
    const before = shown(twinMesh).slice();
    hop(tissue, undefined, 10);
    expect(shown(twinMesh)).toEqual(before);
    expect(shown(meshes[0])).not.toEqual(before);
    other.dispose();
    tissue.dispose();
    expect(twinMesh.geometry).toBe(meshes[0]?.geometry);
  });

  it("refuses another avatar, and changes nothing", async () => {
    const { root, meshes } = makeInThree(THREE, model);
    const mesh = meshes[0] as THREE.SkinnedMesh;
    const { geometry } = mesh;
    const moved = makeInThree(THREE, model);
    const other = shown(moved.meshes[0]);
    other[0] = (other[0] ?? 0) + 0.01;
    await expectError("binding", () => new AvatarTissue(model, moved.root, binding));
    const renamed = makeInThree(THREE, model);
    const hips = renamed.meshes[0]?.skeleton.bones[0] as THREE.Bone;
    hips.userData.name = "Bauch";
    const { message } = await expectError(
      "binding",
      () => new AvatarTissue(model, renamed.root, binding),
    );
    expect(message).toContain("mixamorig:Hips");
    await expectError("argument", () => new AvatarTissue(model, new THREE.Group(), binding));
    await expectError("argument", () => new AvatarTissue(model, root, {} as Binding));
    const tissue = new AvatarTissue(model, root, binding);
    await expectError("argument", () => new AvatarTissue(model, root, binding));
    tissue.dispose();
    expect(mesh.geometry).toBe(geometry);
    expect(renamed.meshes[0]?.geometry.getAttribute("position")).toBeDefined();
  });

  it("leaves no memory behind", async () => {
    const memory = await coreMemory();
    const { root } = makeInThree(THREE, model);
    const cycle = () => {
      const again = Binding.fromBytes(binding.toBytes(), model);
      const tissue = new AvatarTissue(model, root, again);
      tissue.update(1 / 60);
      tissue.dispose();
    };
    for (let idx = 0; idx < 10; idx += 1) cycle();
    const before = memory.buffer.byteLength;
    for (let idx = 0; idx < 30; idx += 1) cycle();
    expect(memory.buffer.byteLength).toBe(before);
  });
});

describe("Binding", () => {
  it("goes through bytes", () => {
    const bytes = binding.toBytes();
    expect(bytes.length).toBeLessThan(100_000);
    const again = Binding.fromBytes(bytes, model);
    expect(again.report).toEqual(binding.report);
    // It keeps a copy.
    bytes.fill(0);
    expect(again.toBytes()).toEqual(binding.toBytes());
  });

  it("refuses what is none", async () => {
    const bytes = binding.toBytes();
    await expectError("binding", () => Binding.fromBytes(bytes.subarray(0, 100), model));
    bytes[200] = (bytes[200] ?? 0) ^ 1;
    await expectError("binding", () => Binding.fromBytes(bytes, model));
    await expectError("argument", () => Binding.fromBytes("x" as unknown as Uint8Array, model));
    const male = await loadModel("male");
    await expectError("binding", () => Binding.fromBytes(binding.toBytes(), male));
    await expectError(
      "binding",
      () => new AvatarTissue(male, makeInThree(THREE, model).root, binding),
    );
    male.dispose();
  });
});
