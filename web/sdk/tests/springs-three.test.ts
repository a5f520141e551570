// Bones of breasts that move by themselves, as three-vrm moves them, beside tissue.
import { type Model, Motion } from "dynaskin";
import { AvatarTissue, type Binding, bindAvatar, type SpringBones } from "dynaskin/three";
import * as THREE from "three";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { BUST_BONES, makeInThree } from "../../../tests/avatars/made.js";
import { springsOn } from "../../../tests/avatars/springs.js";
import { expectError, loadModel } from "./support.js";

let model: Model;
let binding: Binding;
beforeAll(async () => {
  model = await loadModel();
  const { root } = makeInThree(THREE, model, { bust: true });
  binding = await bindAvatar(model, root, { depicts: "adult", worker: false });
});
afterAll(() => model.dispose());

/** An avatar whose breasts have springs of three-vrm. */
function springy() {
  const { root, meshes, tips } = makeInThree(THREE, model, { bust: true });
  const mesh = meshes[0] as THREE.SkinnedMesh;
  const bones = mesh.skeleton.bones.filter(({ name }) => BUST_BONES.includes(name));
  const springs = springsOn(THREE, root, bones);
  return { root, mesh, tips, springs, bones };
}

/** Over a hop: the farthest that springs turn (degrees), a breast and the rest of the mesh move (metres). */
function played(springBones?: SpringBones) {
  const { root, mesh, tips, springs, bones } = springy();
  const rests = bones.map(({ quaternion }) => quaternion.clone());
  const still = (mesh.geometry.getAttribute("position").array as Float32Array).slice();
  const tissue = new AvatarTissue(model, root, binding, springBones && { springBones });
  const motion = Motion.procedural("hop", tissue.avatar);
  const most = { degrees: 0, breastM: 0, anyM: 0 };
  const turned = () =>
    bones.reduce((worst, { quaternion }, idx) => {
      const angle = quaternion.angleTo(rests[idx] as THREE.Quaternion);
      return Math.max(worst, THREE.MathUtils.radToDeg(angle));
    }, 0);
  const step = (tick: number) => {
    tissue.writePose(motion.poseAt(tick / 60));
    root.updateMatrixWorld(true);
    springs.update(1 / 60);
  };
  for (let tick = 0; tick < 90; tick += 1) {
    step(tick);
    tissue.update(1 / 60);
    most.degrees = Math.max(most.degrees, turned());
    const shown = mesh.geometry.getAttribute("position").array as Float32Array;
    const moved = (vertex: number) =>
      Math.hypot(
        ...[0, 1, 2].map(
          (axis) => (shown[3 * vertex + axis] ?? 0) - (still[3 * vertex + axis] ?? 0),
        ),
      );
    for (let vertex = 0; vertex < shown.length / 3; vertex += 1) {
      most.anyM = Math.max(most.anyM, moved(vertex));
    }
    for (const tip of tips) most.breastM = Math.max(most.breastM, moved(tip));
  }
  step(76);
  const degreesAlone = turned();
  motion.dispose();
  tissue.dispose();
  return { ...most, degreesAlone };
}

describe("springBones in three.js", () => {
  it("are told", () => {
    expect(binding.report.doubleMotion).toEqual(BUST_BONES);
  });

  it("are held still where tissue takes their place, which is the default", () => {
    const replaced = played();
    expect(replaced.degrees).toBeLessThan(0.01);
    // The springs themselves go on.
    expect(replaced.degreesAlone).toBeGreaterThan(1);
    expect(replaced.breastM).toBeGreaterThan(0.01);
    expect(played("replace")).toEqual(replaced);
  });

  it("go on where they are kept, on skin without tissue", () => {
    const kept = played("keep");
    expect(kept.degrees).toBeGreaterThan(3);
    expect(kept.breastM).toBe(0);
    expect(kept.anyM).toBeGreaterThan(0.004);
  });

  it("share the skin with half of the tissue", () => {
    const shared = played("share");
    expect(shared.degrees).toBeGreaterThan(3);
    expect(shared.breastM / played("replace").breastM).toBeCloseTo(0.5, 2);
  });

  it("leave bones that turn the body's joints alone", async () => {
    const { root, meshes } = makeInThree(THREE, model);
    const chest = meshes[0]?.skeleton.bones[9] as THREE.Bone;
    // Japanese for chest: also what rigs call the upper spine.
    chest.userData.name = "mune";
    const bones = { spine3: "mune" };
    const own = await bindAvatar(model, root, { depicts: "adult", worker: false, bones });
    const tissue = new AvatarTissue(model, root, own);
    chest.rotation.x = 0.3;
    tissue.update(1 / 60);
    expect(chest.rotation.x).toBeCloseTo(0.3, 6);
    tissue.dispose();
  });

  it("refuse another word", async () => {
    const { root } = springy();
    const springBones = "both" as SpringBones;
    await expectError("argument", () => new AvatarTissue(model, root, binding, { springBones }));
  });
});
