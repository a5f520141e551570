import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { Ray } from "@babylonjs/core/Culling/ray.js";
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { Quaternion, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/index.js";
import { type Avatar, type Model, Motion, restPose } from "dynaskin";
import { DynaSkin } from "dynaskin/babylon";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { quantised } from "../../../tests/avatars/quantised.js";
import { createThreadAvatar } from "./node-worker.js";
import {
  expectError,
  largestDifference,
  largestOffset,
  loadModel,
  readModelFile,
} from "./support.js";

const SHAPE = [0.8, 1.5, -0.5, 0.4, 0, 0, 0, 0, 0, 0];

let model: Model;
const engine = new NullEngine();
beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => {
  model.dispose();
  engine.dispose();
});

/** The body as Babylon loads it, in a scene of its own, under a node that moves it. */
async function loadBody(
  rightHanded = false,
  change = (file: Uint8Array) => file,
): Promise<{ mesh: Mesh; mover: TransformNode }> {
  const scene = new Scene(engine);
  scene.useRightHandedSystem = rightHanded;
  const file = change(readModelFile("body.glb"));
  const { meshes } = await ImportMeshAsync(file, scene, { pluginExtension: ".glb" });
  const mover = new TransformNode("mover", scene);
  const root = meshes[0];
  if (root) root.parent = mover;
  return { mesh: meshes.find((mesh) => mesh.skeleton) as Mesh, mover };
}

/** The mesh's vertices as Babylon draws them, in the world; z mirrored back if the scene does so. */
function drawnPositions(mesh: Mesh): Float32Array {
  mesh.skeleton?.prepare(true);
  const world = mesh.computeWorldMatrix(true);
  const local = mesh.getPositionData(true) ?? [];
  const sign = world.determinant() < 0 ? -1 : 1;
  const positions = new Float32Array(local.length);
  for (let at = 0; at < local.length; at += 3) {
    const point = Vector3.TransformCoordinates(Vector3.FromArray(local, at), world);
    positions.set([point.x, point.y, point.z * sign], at);
  }
  return positions;
}

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

describe("DynaSkin in Babylon.js", () => {
  it.each([
    ["left-handed", false],
    ["right-handed", true],
  ])("draws the surface that the avatar skins in a %s scene", async (_name, rightHanded) => {
    const { mesh } = await loadBody(rightHanded);
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    expect(hop(skin, avatar)).toBeGreaterThan(0.002);
    expect(largestDifference(drawnPositions(mesh), avatar.skinned().positions)).toBeLessThan(5e-6);
    skin.dispose();
    avatar.dispose();
  });

  it("moves a body whose numbers the inverse bind matrices scale", async () => {
    const { mesh } = await loadBody(true, quantised);
    const avatar = model.createAvatar();
    const skin = new DynaSkin(avatar, mesh);
    hop(skin, avatar, 0.5);
    expect(largestDifference(drawnPositions(mesh), avatar.skinned().positions)).toBeLessThan(4e-6);
    skin.dispose();
    avatar.dispose();
  });

  it("gives a giant the same tissue, wherever it stands", async () => {
    const offsets: Float32Array[] = [];
    for (const [scale, x, turn] of [
      [1, 0, 0],
      [10, 3, 1],
      [0.1, -2, -2],
    ] as const) {
      const { mesh, mover } = await loadBody();
      mover.scaling.setAll(scale);
      mover.position.set(x, 0, x);
      mover.rotationQuaternion = Quaternion.RotationAxis(Vector3.Up(), turn);
      const avatar = model.createAvatar({ shape: SHAPE });
      const skin = new DynaSkin(avatar, mesh);
      hop(skin, avatar);
      offsets.push(avatar.offsets.slice());
      skin.dispose();
      avatar.dispose();
    }
    const [usual = new Float32Array(), giant = [], dwarf = []] = offsets;
    expect(largestOffset(usual)).toBeGreaterThan(1e-3);
    // Babylon's world matrices are single precision, and accelerations are second differences.
    expect(largestDifference(usual, giant)).toBeLessThan(1e-3);
    expect(largestDifference(usual, dwarf)).toBeLessThan(1e-3);
  });

  it("takes the size from the scene, whatever the avatar's own scale is", async () => {
    const offsets: Float32Array[] = [];
    for (const [avatarScale, moverScale] of [
      [1, 1],
      [2, 1],
      [0.5, 3],
    ] as const) {
      const { mesh, mover } = await loadBody();
      mover.scaling.setAll(moverScale);
      const avatar = model.createAvatar({ shape: SHAPE });
      const skin = new DynaSkin(avatar, mesh);
      hop(skin, avatar, 0.5);
      avatar.scale = avatarScale; // in mid-motion, as a slider would
      hop(skin, avatar);
      expect(avatar.timings.settled).toBe(false);
      offsets.push(avatar.offsets.slice());
      const drawn = drawnPositions(mesh).map((value) => value / moverScale);
      const skinned = avatar.skinned().positions.map((value) => value / avatarScale);
      expect(largestDifference(drawn, skinned)).toBeLessThan(5e-6);
      skin.dispose();
      avatar.dispose();
    }
    const [usual = new Float32Array(), scaled = [], both = []] = offsets;
    expect(largestOffset(usual)).toBeGreaterThan(1e-3);
    expect(largestDifference(usual, scaled)).toBeLessThan(1e-3);
    expect(largestDifference(usual, both)).toBeLessThan(1e-3);
  });

  it("hands over the normals of the moved surface, which rays meet", async () => {
    const { mesh } = await loadBody(true);
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    const before = Float32Array.from(mesh.getVerticesData(VertexBuffer.NormalKind) ?? []);
    hop(skin, avatar);
    const normals = mesh.getVerticesData(VertexBuffer.NormalKind) ?? [];
    expect(largestDifference(normals, avatar.normals)).toBe(0);
    expect(largestDifference(normals, before)).toBeGreaterThan(0.005);
    // Babylon picks skinned meshes where they rest, unless it is asked to skin them first.
    skin.mesh.position.x = 4;
    skin.update(1 / 60);
    const drawn = drawnPositions(mesh);
    mesh.refreshBoundingInfo({ applySkeleton: true });
    const height = Math.max(...drawn.filter((_, at) => at % 3 === 1));
    const ray = new Ray(new Vector3(4, height - 0.1, 3), new Vector3(0, 0, -1), 10);
    const { hit, pickedPoint } = ray.intersectsMesh(mesh, false);
    expect(hit).toBe(true);
    const nearest = Math.min(
      ...Array.from({ length: drawn.length / 3 }, (_, idx) =>
        Vector3.Distance(Vector3.FromArray(drawn, idx * 3), pickedPoint ?? Vector3.Zero()),
      ),
    );
    expect(nearest).toBeLessThan(0.02);
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

  it("draws an avatar in a worker as one in the page", async () => {
    const { mesh } = await loadBody();
    const here = model.createAvatar();
    const there = await createThreadAvatar();
    const skin = new DynaSkin(there, mesh);
    const motion = Motion.procedural("hop", here);
    for (let tick = 0; tick < 90; tick += 1) {
      if (tick === 30) for (const avatar of [here, there]) avatar.setShape(SHAPE);
      await there.whenAnswered();
      skin.writePose(motion.poseAt(tick / 60));
      skin.update(1 / 60);
      here.step(skin.pose, 1 / 60);
    }
    skin.update(0);
    await there.whenAnswered();
    skin.update(0);
    expect(largestOffset(there.offsets)).toBeGreaterThan(1e-3);
    expect(largestDifference(there.offsets, here.offsets)).toBe(0);
    expect(largestDifference(drawnPositions(mesh), here.skinned().positions)).toBeLessThan(5e-6);
    skin.dispose();
    there.dispose();
    here.dispose();
    motion.dispose();
  });

  it("follows a change of shape, within its bounds", async () => {
    const { mesh, mover } = await loadBody();
    const avatar = model.createAvatar();
    const skin = new DynaSkin(avatar, mesh);
    skin.update(1 / 60);
    avatar.setShape(SHAPE);
    mover.position.set(4, 0, 0);
    skin.update(1 / 60);
    const drawn = drawnPositions(mesh);
    const skinned = avatar.skinned().positions;
    expect(largestDifference(drawn, skinned)).toBeLessThan(5e-6);
    const { minimumWorld, maximumWorld } = mesh.getBoundingInfo().boundingBox;
    for (let at = 0; at < drawn.length; at += 3) {
      expect(drawn[at]).toBeGreaterThan(minimumWorld.x);
      expect(drawn[at]).toBeLessThan(maximumWorld.x);
      expect(drawn[at + 1]).toBeLessThan(maximumWorld.y);
    }
    expect(maximumWorld.x - minimumWorld.x).toBeLessThan(6);
    skin.dispose();
    avatar.dispose();
  });

  it("restores the mesh on dispose, which may be repeated", async () => {
    const { mesh } = await loadBody();
    const before = drawnPositions(mesh);
    const { geometry, morphTargetManager } = mesh;
    const avatar = model.createAvatar({ shape: SHAPE });
    const skin = new DynaSkin(avatar, mesh);
    skin.update(1 / 60);
    expect(largestDifference(drawnPositions(mesh), before)).toBeGreaterThan(0.01);
    skin.dispose();
    skin.dispose();
    expect(mesh.geometry).toBe(geometry);
    expect(mesh.morphTargetManager).toBe(morphTargetManager);
    expect(largestDifference(drawnPositions(mesh), before)).toBeLessThan(1e-6);
    await expectError("disposed", () => skin.update(1 / 60));
    await expectError("disposed", () => skin.writePose(restPose()));
    new DynaSkin(avatar, mesh).dispose();
    avatar.dispose();
  });

  it("refuses meshes that do not fit", async () => {
    const { mesh } = await loadBody();
    const avatar = model.createAvatar();
    await expectError("argument", () => new DynaSkin(avatar, undefined as unknown as Mesh));
    await expectError("argument", () => new DynaSkin(avatar, mesh, { vertexMap: [1] }));
    await expectError("argument", () => new DynaSkin(undefined as unknown as Avatar, mesh));
    const first = new DynaSkin(avatar, mesh);
    await expectError("argument", () => new DynaSkin(avatar, mesh));
    first.dispose();
    const twin = mesh.clone("twin");
    twin.skeleton = mesh.skeleton;
    await expectError("argument", () => new DynaSkin(avatar, mesh));
    twin.dispose();
    new DynaSkin(avatar, mesh).dispose();
    avatar.dispose();
  });
});
