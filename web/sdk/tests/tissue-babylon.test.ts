import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import type { Material } from "@babylonjs/core/Materials/material.js";
import { Quaternion, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/index.js";
import { type Model, Motion } from "dynaskin";
import { AvatarTissue, type Binding, bindAvatar, DynaSkin } from "dynaskin/babylon";
import { bindAvatar as bindInThree } from "dynaskin/three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { afterAll, beforeAll, describe, expect, it, vi } from "vitest";
import { quantised } from "../../../tests/avatars/quantised.js";
import {
  expectError,
  largestDifference,
  largestOffset,
  loadModel,
  readModelFile,
} from "./support.js";

// GLTFLoader asks the page for it, to make addresses of textures.
vi.stubGlobal("self", globalThis);

const ADULT = { depicts: "adult", worker: false } as const;

let model: Model;
let binding: Binding;
const engine = new NullEngine();
beforeAll(async () => {
  model = await loadModel();
  binding = await bindAvatar(model, (await loadBody()).root, ADULT);
});
afterAll(() => {
  model.dispose();
  engine.dispose();
});

/** The body as if it were somebody else's avatar: quantised, with morph targets. */
async function loadBody(rightHanded = false): Promise<{ root: TransformNode; mesh: Mesh }> {
  const scene = new Scene(engine);
  scene.useRightHandedSystem = rightHanded;
  const file = quantised(readModelFile("body.glb"));
  const { meshes } = await ImportMeshAsync(file, scene, { pluginExtension: ".glb" });
  const mesh = meshes.find(({ skeleton }) => skeleton) as Mesh;
  return { root: meshes[0] as TransformNode, mesh };
}

function shown(mesh: Mesh): Float32Array {
  return Float32Array.from(mesh.getVerticesData(VertexBuffer.PositionKind) ?? []);
}

/** Plays a hop; gives the largest offset of the body, and of the mesh in the mesh's own unit. */
function hop(tissue: AvatarTissue, mesh: Mesh, still: Float32Array, ticks = 60) {
  const motion = Motion.procedural("hop", tissue.avatar);
  let [ofBody, ofMesh] = [0, 0];
  for (let tick = 0; tick < ticks; tick += 1) {
    tissue.writePose(motion.poseAt(tick / 60));
    tissue.update(1 / 60);
    ofBody = Math.max(ofBody, largestOffset(tissue.avatar.offsets));
    const moved = shown(mesh).map((at, idx) => at - (still[idx] ?? 0));
    ofMesh = Math.max(ofMesh, largestOffset(moved));
  }
  motion.dispose();
  return { ofBody, ofMesh };
}

describe("AvatarTissue in Babylon.js", () => {
  it("finds the body, as three.js does", async () => {
    expect(binding.report.shareClose).toBeGreaterThan(0.98);
    expect(binding.report.missing).toEqual([]);
    const { buffer } = quantised(readModelFile("body.glb"));
    const { scene } = await new GLTFLoader().parseAsync(buffer as ArrayBuffer, "");
    const inThree = await bindInThree(model, scene, ADULT);
    expect(inThree.report.bones).toEqual(binding.report.bones);
    // What one engine bound plays in the other.
    const { root, mesh } = await loadBody();
    const tissue = new AvatarTissue(model, root, inThree);
    expect(hop(tissue, mesh, shown(mesh), 30).ofMesh).toBeGreaterThan(0);
    tissue.dispose();
  });

  it.each([
    ["left-handed", false],
    ["right-handed", true],
  ])("moves the mesh in a %s scene, and gives it back", async (_name, rightHanded) => {
    const { root, mesh } = await loadBody(rightHanded);
    const mover = new TransformNode("mover", root.getScene());
    root.parent = mover;
    mover.position = new Vector3(2, 0.3, -1);
    mover.rotationQuaternion = Quaternion.RotationYawPitchRoll(0.8, 0, 0);
    const { geometry } = mesh;
    const still = shown(mesh);
    const tissue = new AvatarTissue(model, root, binding);
    expect(tissue.movingVertices).toBeGreaterThan(2000);
    const { ofBody, ofMesh } = hop(tissue, mesh, still);
    expect(ofBody).toBeGreaterThan(0.004);
    // The mesh counts in steps of a tenth of a millimetre.
    expect(ofMesh / 1e4 / ofBody).toBeGreaterThan(0.8);
    expect(ofMesh / 1e4 / ofBody).toBeLessThan(1.2);
    tissue.dispose();
    expect(mesh.geometry).toBe(geometry);
    expect(shown(mesh)).toEqual(still);
    await expectError("disposed", () => tissue.update(1 / 60));
  });

  it("reads the pose that it writes, in both kinds of scenes", async () => {
    for (const rightHanded of [false, true]) {
      const { root } = await loadBody(rightHanded);
      const tissue = new AvatarTissue(model, root, binding);
      const motion = Motion.procedural("walk", tissue.avatar);
      const pose = motion.poseAt(0.7);
      tissue.writePose(pose);
      tissue.update(1 / 60);
      const read = tissue.pose;
      expect(largestDifference(read.subarray(7), pose.subarray(7))).toBeLessThan(1e-4);
      motion.dispose();
      tissue.dispose();
    }
  });

  it.each([
    ["0.5", [0.5]],
    ["1", [1]],
    ["1 in all", [0.4, 0.6]],
    ["more than 1", [1, 0.8]],
    ["0 in all", [0.7, -0.7]],
  ])("keeps the tissue whole where morph targets add up to %s", async (_sum, influences) => {
    const { root, mesh } = await loadBody();
    const manager = mesh.morphTargetManager;
    const targets = manager?.numTargets ?? 0;
    const setTargets = (to: readonly number[]) => {
      for (const [idx, influence] of to.entries()) {
        const target = manager?.getTarget(idx);
        if (target) target.influence = influence;
      }
    };
    // As Babylon's shaders do it, before bones.
    const morphed = () => Float32Array.from(mesh.getPositionData(false, true) ?? []);
    setTargets(influences);
    const wanted = morphed();
    setTargets(influences.map(() => 0));
    const still = shown(mesh);
    const tissue = new AvatarTissue(model, root, binding);
    hop(tissue, mesh, still, 40);
    const offsets = shown(mesh).map((at, idx) => at - (still[idx] ?? 0));
    expect(largestOffset(offsets)).toBeGreaterThan(0);
    setTargets(influences);
    const together = morphed().map((at, idx) => at - (offsets[idx] ?? 0));
    expect(largestDifference(together, wanted)).toBeLessThan(1e-6 * largestOf(still));
    tissue.dispose();
    expect(manager?.numTargets).toBe(targets);
    expect(morphed()).toEqual(wanted);
  });

  it("shares morph targets with clones, and leaves them as they were", async () => {
    const { root, mesh } = await loadBody();
    const manager = mesh.morphTargetManager;
    const targets = manager?.numTargets ?? 0;
    const first = new AvatarTissue(model, root, binding);
    const twin = root.clone("twin", null, false) as TransformNode;
    const second = new AvatarTissue(model, twin, binding);
    expect(manager?.numTargets).toBe(targets + 1);
    first.dispose();
    expect(manager?.numTargets).toBe(targets + 1);
    second.dispose();
    expect(manager?.numTargets).toBe(targets);
  });

  it("keeps tangents in the plane of the normals", async () => {
    const { root, mesh } = await loadBody();
    const normals = Float32Array.from(mesh.getVerticesData(VertexBuffer.NormalKind) ?? []);
    const tangents = Float32Array.from({ length: (4 * normals.length) / 3 }, (_, idx) => {
      const [nx = 0, ny = 0] = normals.subarray(3 * Math.floor(idx / 4));
      const size = Math.hypot(nx, ny) || 1;
      return [ny / size, -nx / size, 0, 1][idx % 4] ?? 0;
    });
    mesh.setVerticesData(VertexBuffer.TangentKind, tangents, false, 4);
    const tissue = new AvatarTissue(model, root, binding);
    const read = (kind: string) => mesh.getVerticesData(kind) ?? [];
    hop(tissue, mesh, shown(mesh), 70);
    const [normal, tangent] = [read(VertexBuffer.NormalKind), read(VertexBuffer.TangentKind)];
    let worst = 0;
    for (let vertex = 0; 4 * vertex < tangent.length; vertex += 1) {
      const dot = [0, 1, 2].map(
        (axis) => (normal[3 * vertex + axis] ?? 0) * (tangent[4 * vertex + axis] ?? 0),
      );
      worst = Math.max(worst, Math.abs(dot.reduce((sum, part) => sum + part)));
    }
    expect(largestDifference(tangent, tangents)).toBeGreaterThan(0.02);
    expect(worst).toBeLessThan(1e-5);
    tissue.dispose();
  });

  it("shares a material and its shadows with dual quaternions, in either order", async () => {
    const { root, mesh } = await loadBody();
    const other = (await loadBody()).mesh;
    const material = mesh.material as Material;
    other.material = material;
    const version = vi.spyOn(engine, "version", "get").mockReturnValue(2);
    const avatar = model.createAvatar({ skinning: "dual-quaternion" });
    const starts = [
      () => new AvatarTissue(model, root, binding, { write: "texture" }),
      () => new DynaSkin(avatar, other),
    ];
    for (const order of [starts, starts.toReversed()]) {
      const [first, second] = order.map((start) => start());
      const wrapper = material.shadowDepthWrapper;
      expect(wrapper).not.toBeNull();
      first?.dispose();
      expect(material.shadowDepthWrapper).toBe(wrapper);
      second?.dispose();
      expect(material.shadowDepthWrapper).toBeNull();
    }
    version.mockRestore();
    avatar.dispose();
  });

  it("refuses another avatar, and nothing", async () => {
    const { root, mesh } = await loadBody();
    const { geometry } = mesh;
    const bones = mesh.skeleton?.bones ?? [];
    for (const bone of bones) {
      const node = bone.getTransformNode();
      if (node) node.name = `x${node.name}x`;
    }
    await expectError("binding", () => new AvatarTissue(model, root, binding));
    expect(mesh.geometry).toBe(geometry);
    await expectError("argument", () => new AvatarTissue(model, {} as TransformNode, binding));
    const empty = new TransformNode("empty", root.getScene());
    await expectError("argument", () => new AvatarTissue(model, empty, binding));
    await expectError("avatar", () => bindAvatar(model, empty, ADULT));
    const excluded = new AvatarTissue(model, (await loadBody()).root, binding, {
      exclude: () => true,
    });
    expect(excluded.movingVertices).toBe(0);
    excluded.dispose();
  });
});

function largestOf(numbers: Float32Array): number {
  return numbers.reduce((most, at) => Math.max(most, Math.abs(at)), 0);
}
