// Skin blended with dual quaternions: by the WebAssembly as the equations say, by the adapters where an engine can.
import { readFileSync } from "node:fs";
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { ImportMeshAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import type { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/index.js";
import { loadBody, type Model, restPose, type Skinning } from "dynaskin";
import { DynaSkin as BabylonSkin } from "dynaskin/babylon";
import { loadBody as loadBodySlim } from "dynaskin/slim";
import { DynaSkin as ThreeSkin } from "dynaskin/three";
import { MeshBasicMaterial, ShaderMaterial, type SkinnedMesh } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { afterAll, beforeAll, describe, expect, it, vi } from "vitest";
import { createThreadAvatar } from "./node-worker.js";
import { expectError, largestDifference, loadModel, readModelFile } from "./support.js";

// GLTFLoader asks the page for it, to make addresses of textures.
vi.stubGlobal("self", globalThis);

/** What `crates/runtime/tests/dual_quaternions.rs` writes. */
interface Golden {
  shape: number[];
  scale: number;
  /** Of 99 numbers each. */
  poses: number[][];
  /** `[pose][vertex][axis]` flattened, metres. */
  skinnedM: number[][];
}

const read = (name: string) =>
  new Uint8Array(readFileSync(new URL(`../../../tests/golden/${name}`, import.meta.url)));

const golden: Golden = JSON.parse(new TextDecoder().decode(read("dual-quaternions.json")));
const glb = read("pose-correctives.glb");
const UNKNOWN = "dual" as unknown as Skinning;

let model: Model;
beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => model.dispose());

/** A pose with a wrist that is twisted by 2 radians. */
function twistedWrist(): Float64Array {
  const pose = restPose();
  const leftWrist = 3 + 20 * 4;
  pose.set([Math.sin(1), 0, 0, Math.cos(1)], leftWrist);
  return pose;
}

describe("avatar.skinning", () => {
  it.each([
    ["the whole core", loadBody],
    ["the slim core", loadBodySlim],
  ])("dual-quaternion is the native reference's with %s", async (_name, loads) => {
    const body = await loads({ body: glb });
    const { shape } = golden;
    const avatar = body.createAvatar({ shape, skinning: "dual-quaternion" });
    const linear = body.createAvatar({ shape });
    expect([avatar.skinning, linear.skinning]).toEqual(["dual-quaternion", "linear"]);
    for (const each of [avatar, linear]) each.scale = golden.scale;
    for (const [idx, numbers] of golden.poses.entries()) {
      for (const each of [avatar, linear]) each.step(Float64Array.from(numbers), 1 / 60);
      const skinned = avatar.skinned().positions.slice();
      expect(largestDifference(skinned, golden.skinnedM[idx] ?? [])).toBeLessThanOrEqual(1e-5);
      expect(largestDifference(skinned, linear.skinned().positions)).toBeGreaterThan(5e-3);
      expect(largestDifference(avatar.positions, linear.positions)).toBe(0);
    }
    // At once, also between steps.
    linear.skinning = "dual-quaternion";
    expect(
      largestDifference(linear.skinned().positions, golden.skinnedM.at(-1) ?? []),
    ).toBeLessThan(1e-5);
    for (const made of [avatar, linear, body]) made.dispose();
  });

  it("takes no other string, also when an avatar is made", async () => {
    const avatar = model.createAvatar();
    const { message } = await expectError("argument", () => {
      avatar.skinning = UNKNOWN;
    });
    expect(message).toBe("There is no skinning dual; there are linear, dual-quaternion.");
    expect(avatar.skinning).toBe("linear");
    await expectError("argument", () => model.createAvatar({ skinning: UNKNOWN }));
    avatar.dispose();
  });

  it("is that of an avatar in a worker, too", async () => {
    const avatar = await createThreadAvatar();
    expect(avatar.skinning).toBe("linear");
    avatar.skinning = "dual-quaternion";
    expect(avatar.skinning).toBe("dual-quaternion");
    await avatar.whenAnswered();
    expect(avatar.skinning).toBe("dual-quaternion");
    await expectError("argument", () => {
      avatar.skinning = UNKNOWN;
    });
    avatar.dispose();
  });
});

async function threeMesh(): Promise<SkinnedMesh> {
  const { buffer } = readModelFile("body.glb");
  const { scene } = await new GLTFLoader().parseAsync(buffer as ArrayBuffer, "");
  return scene.getObjectByProperty("isSkinnedMesh", true) as SkinnedMesh;
}

describe("DynaSkin of three.js", () => {
  it("has materials skin otherwise while the avatar asks for it, and gives them back", async () => {
    const mesh = await threeMesh();
    const { material } = mesh;
    const avatar = model.createAvatar({ skinning: "dual-quaternion" });
    const skin = new ThreeSkin(avatar, mesh);
    expect(mesh.material).not.toBe(material);
    expect(mesh.customDepthMaterial).toBeDefined();
    skin.writePose(twistedWrist());
    skin.update(1 / 60);
    avatar.skinning = "linear";
    skin.update(1 / 60);
    expect(mesh.material).toBe(material);
    expect(mesh.customDepthMaterial).toBeUndefined();
    avatar.skinning = "dual-quaternion";
    skin.show();
    expect(mesh.material).not.toBe(material);
    // A material that the page sets meanwhile is the mesh's afterwards.
    const other = new MeshBasicMaterial();
    mesh.material = other;
    expect(mesh.material).not.toBe(other);
    skin.dispose();
    expect(mesh.material).toBe(other);
    expect(Object.hasOwn(mesh, "onBeforeRender")).toBe(false);
    avatar.dispose();
  });

  it("refuses what skins by itself, and leaves the mesh as it was", async () => {
    const mesh = await threeMesh();
    const { geometry, skeleton } = mesh;
    mesh.material = new ShaderMaterial({ name: "own" });
    const avatar = model.createAvatar({ skinning: "dual-quaternion" });
    const { message } = await expectError("argument", () => new ThreeSkin(avatar, mesh));
    expect(message).toMatch(/own \(ShaderMaterial\).*Set avatar\.skinning to "linear"/);
    expect([mesh.geometry, mesh.skeleton]).toEqual([geometry, skeleton]);
    avatar.skinning = "linear";
    const skin = new ThreeSkin(avatar, mesh);
    skin.update(1 / 60);
    const before = avatar.positions.slice();
    avatar.skinning = "dual-quaternion";
    await expectError("argument", () => skin.update(1 / 60));
    expect(largestDifference(avatar.positions, before)).toBe(0);
    avatar.skinning = "linear";
    skin.update(1 / 60);
    skin.dispose();
    avatar.dispose();
  });

  it("says so where another renderer draws", async () => {
    const mesh = await threeMesh();
    const avatar = model.createAvatar({ skinning: "dual-quaternion" });
    const skin = new ThreeSkin(avatar, mesh);
    const draw = mesh.onBeforeRender as unknown as (renderer: object) => void;
    const { message } = await expectError("argument", () => draw({ isWebGPURenderer: true }));
    expect(message).toContain("for WebGLRenderer");
    skin.dispose();
    avatar.dispose();
  });
});

describe("DynaSkin of Babylon.js", () => {
  it("refuses another engine than that of WebGL 2, and leaves the mesh as it was", async () => {
    const engine = new NullEngine();
    const scene = new Scene(engine);
    const file = readModelFile("body.glb");
    const { meshes } = await ImportMeshAsync(file, scene, { pluginExtension: ".glb" });
    const mesh = meshes.find((candidate) => candidate.skeleton) as Mesh;
    const { geometry } = mesh;
    const avatar = model.createAvatar({ skinning: "dual-quaternion" });
    Object.defineProperty(engine, "isWebGPU", { value: true });
    const { message } = await expectError("argument", () => new BabylonSkin(avatar, mesh));
    expect(message).toContain("WebGL 2");
    expect(mesh.geometry).toBe(geometry);
    avatar.skinning = "linear";
    const skin = new BabylonSkin(avatar, mesh);
    skin.update(1 / 60);
    skin.dispose();
    avatar.dispose();
    engine.dispose();
  });
});
