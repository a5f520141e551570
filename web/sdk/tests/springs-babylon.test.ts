// Bones of breasts that move by themselves, beside tissue in Babylon.js.
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { LoadAssetContainerAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { Quaternion } from "@babylonjs/core/Maths/math.vector.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/index.js";
import { type Model, Motion } from "dynaskin";
import { AvatarTissue, type Binding, bindAvatar, type SpringBones } from "dynaskin/babylon";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { BUST_BONES } from "../../../tests/avatars/made.js";
import { madeGlb } from "../../../tests/avatars/made-glb.js";
import { loadModel } from "./support.js";

let model: Model;
let binding: Binding;
let file: Uint8Array;
let tips: number[];
const engine = new NullEngine();
beforeAll(async () => {
  model = await loadModel();
  ({ bytes: file, tips } = await madeGlb(model));
  const { root } = await loadAvatar(false);
  binding = await bindAvatar(model, root, { depicts: "adult", worker: false });
});
afterAll(() => {
  model.dispose();
  engine.dispose();
});

async function loadAvatar(isClone: boolean): Promise<{ root: TransformNode; mesh: Mesh }> {
  const scene = new Scene(engine);
  const container = await LoadAssetContainerAsync(file, scene, { pluginExtension: ".glb" });
  const root = isClone
    ? (container.instantiateModelsToScene().rootNodes[0] as TransformNode)
    : (container.meshes[0] as TransformNode);
  const mesh = root.getChildMeshes().find(({ skeleton }) => skeleton) as Mesh;
  return { root, mesh };
}

/** Over a hop in which the breasts' bones are turned: whether they stay so, and how far a tip moves. */
async function played(springBones?: SpringBones, isClone = false) {
  const { root, mesh } = await loadAvatar(isClone);
  const shown = () => Float32Array.from(mesh.getVerticesData(VertexBuffer.PositionKind) ?? []);
  const still = shown();
  const tissue = new AvatarTissue(model, root, binding, springBones && { springBones });
  const bones = root
    .getDescendants()
    .filter(({ name }) => BUST_BONES.some((bone) => name.endsWith(bone))) as TransformNode[];
  expect(bones).toHaveLength(2);
  const turn = Quaternion.RotationAxis(root.up, 0.4);
  const places = bones.map(({ position }) => position.clone());
  const motion = Motion.procedural("hop", tissue.avatar);
  const most = { turned: 0, apartM: 0, breastM: 0 };
  for (let tick = 0; tick < 90; tick += 1) {
    tissue.writePose(motion.poseAt(tick / 60));
    for (const bone of bones) bone.rotationQuaternion = turn.clone();
    tissue.update(1 / 60);
    const moved = shown().map((at, idx) => at - (still[idx] ?? 0));
    for (const [idx, bone] of bones.entries()) {
      const w = bone.rotationQuaternion?.w ?? 1;
      most.turned = Math.max(most.turned, 2 * Math.acos(Math.min(1, Math.abs(w))));
      const apartM = bone.position.subtract(places[idx] ?? bone.position).length();
      most.apartM = Math.max(most.apartM, apartM);
    }
    for (const tip of tips) {
      most.breastM = Math.max(most.breastM, Math.hypot(...moved.subarray(3 * tip, 3 * tip + 3)));
    }
  }
  motion.dispose();
  tissue.dispose();
  return most;
}

describe("springBones in Babylon.js", () => {
  it("are told", () => {
    expect(binding.report.doubleMotion).toEqual(BUST_BONES);
  });

  it("are held where they were bound, also on clones", async () => {
    const replaced = await played();
    expect(replaced.turned).toBeLessThan(1e-3);
    expect(replaced.apartM).toBeLessThan(1e-5);
    expect(replaced.breastM).toBeGreaterThan(0.01);
    expect(await played("replace", true)).toEqual(replaced);
  });

  it("go on where they are kept, and share where they share", async () => {
    const kept = await played("keep");
    expect(kept.turned).toBeCloseTo(0.4, 3);
    expect(kept.breastM).toBe(0);
    const { breastM } = await played("replace");
    expect((await played("share")).breastM / breastM).toBeCloseTo(0.5, 2);
  });
});
