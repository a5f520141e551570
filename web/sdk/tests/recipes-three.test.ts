// The recipes for humanoids and their animations.
import * as vrmCore from "@pixiv/three-vrm-core";
import type { Avatar, Motion } from "dynaskin";
import { DynaSkin } from "dynaskin/three";
import {
  AnimationClip,
  AnimationMixer,
  Group,
  Object3D,
  Quaternion,
  QuaternionKeyframeTrack,
  type SkinnedMesh,
  Vector3,
  VectorKeyframeTrack,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { afterAll, describe, expect, it, vi } from "vitest";
import { hopGlb } from "../../../tests/hop-files.js";
import { degreesOff, jointAt, recipe, Shaking, TICK } from "./recipe-support.js";
import { largestDifference, largestOffset, loadModel, readModelFile } from "./support.js";

// GLTFLoader asks the page for it, to make addresses of textures.
vi.stubGlobal("self", globalThis);

const model = await loadModel();

afterAll(() => model.dispose());

describe("three-vrm", async () => {
  interface Humanoid {
    readonly normalizedHumanBonesRoot: Object3D;
    getNormalizedBoneNode(name: string): Object3D | null;
    update(): void;
  }
  // The package's declarations do not resolve as Node resolves modules.
  const { VRMHumanoid } = vrmCore as unknown as {
    VRMHumanoid: new (bones: Record<string, { node: Object3D }>) => Humanoid;
  };
  const { followVrm } = await recipe<{
    followVrm(skin: DynaSkin, vrm: { humanoid: Humanoid }): (deltaSeconds: number) => void;
  }>("three-vrm");

  /** A person of a VRM 1.0, 1.1 m at the hips, whose own bones are turned in their rest. */
  function humanoid(): { scene: Group; humanoid: Humanoid } {
    const scene = new Group();
    const bones: Record<string, { node: Object3D }> = {};
    const add = (parent: Object3D, name: string, x: number, y: number) => {
      const node = new Object3D();
      node.rotation.set(x, 2 * y, 1);
      scene.add(node);
      node.position.copy(parent.position).add(new Vector3(x, y, 0));
      bones[name] = { node };
      return node;
    };
    const parents: [Object3D, Object3D][] = [];
    const chain = (from: Object3D, ...links: [string, number, number][]) => {
      let last = from;
      for (const [name, x, y] of links) {
        const node = add(last, name, x, y);
        if (last !== scene) parents.push([last, node]);
        last = node;
      }
      return last;
    };
    const hips = chain(scene, ["hips", 0, 1.1]);
    const chest = chain(hips, ["spine", 0, 0.1], ["chest", 0, 0.15]);
    chain(chest, ["neck", 0, 0.3], ["head", 0, 0.1]);
    for (const [side, x] of [
      ["left", 1],
      ["right", -1],
    ] as const) {
      chain(
        hips,
        [`${side}UpperLeg`, 0.1 * x, -0.05],
        [`${side}LowerLeg`, 0, -0.5],
        [`${side}Foot`, 0, -0.47],
      );
      chain(
        chest,
        [`${side}Shoulder`, 0.05 * x, 0.2],
        [`${side}UpperArm`, 0.12 * x, 0],
        [`${side}LowerArm`, 0.28 * x, 0],
        [`${side}Hand`, 0.26 * x, 0],
      );
    }
    scene.updateMatrixWorld(true);
    for (const [parent, child] of parents) parent.attach(child);
    const made = new VRMHumanoid(bones);
    scene.add(made.normalizedHumanBonesRoot);
    return { scene, humanoid: made };
  }

  async function follower() {
    const { buffer } = readModelFile("body.glb");
    const { scene: body } = await new GLTFLoader().parseAsync(buffer as ArrayBuffer, "");
    const avatar = model.createAvatar();
    const mesh = body.getObjectByProperty("isSkinnedMesh", true) as SkinnedMesh;
    const skin = new DynaSkin(avatar, mesh);
    const vrm = humanoid();
    return { avatar, ...vrm, follow: followVrm(skin, vrm) };
  }

  /** Somebody who stands for half a second, bounces, and throws up the left arm. */
  function bounce(vrm: Humanoid): AnimationClip {
    const times = Array.from({ length: 181 }, (_, key) => key / 60);
    const phase = (seconds: number) => Math.max(0, seconds - 0.5);
    const heights = times.flatMap((s) => [0, 1.1 - 0.05 * Math.sin(15 * phase(s)) ** 2, 0]);
    const turns = times.flatMap((s) => {
      const turn = new Quaternion();
      return turn.setFromAxisAngle(new Vector3(0, 0, 1), 0.4 * phase(s)).toArray();
    });
    const name = (bone: string) => vrm.getNormalizedBoneNode(bone)?.name;
    return new AnimationClip("bounce", -1, [
      new VectorKeyframeTrack(`${name("hips")}.position`, times, heights),
      new QuaternionKeyframeTrack(`${name("leftUpperArm")}.quaternion`, times, turns),
    ]);
  }

  it("does what the humanoid does, whatever axes the VRM's bones have", async () => {
    const { avatar, humanoid: vrm, follow } = await follower();
    follow(0);
    expect(degreesOff(avatar, "left_shoulder", "left_elbow", [1, 0, 0])).toBeLessThan(1);
    expect(degreesOff(avatar, "right_elbow", "right_wrist", [-1, 0, 0])).toBeLessThan(1);
    vrm.getNormalizedBoneNode("leftUpperArm")?.rotateZ(-Math.PI / 2);
    vrm.getNormalizedBoneNode("rightLowerLeg")?.rotateX(Math.PI / 3);
    vrm.getNormalizedBoneNode("hips")?.position.set(0, 0.55, 0);
    follow(TICK);
    const back = Math.sin(Math.PI / 3);
    expect(degreesOff(avatar, "left_shoulder", "left_elbow", [0, -1, 0])).toBeLessThan(1);
    expect(degreesOff(avatar, "right_knee", "right_ankle", [0, -0.5, -back])).toBeLessThan(1);
    const restHeight = avatar.restJointsM()[1] ?? 0;
    expect(jointAt(avatar, "pelvis").y).toBeCloseTo(restHeight / 2, 5);
  });

  it("gives the same tissue in any order of the updates", async () => {
    const played = async (order: readonly ("mixer" | "vrm" | "skin")[]) => {
      const { avatar, scene, humanoid: vrm, follow } = await follower();
      const mixer = new AnimationMixer(scene);
      mixer.clipAction(bounce(vrm)).play();
      const update = {
        mixer: () => mixer.update(TICK),
        vrm: () => vrm.update(),
        skin: () => follow(TICK),
      };
      const frames: Float32Array[] = [];
      for (let frame = 0; frame < 120; frame += 1) {
        for (const part of order) update[part]();
        frames.push(avatar.offsets.slice());
      }
      avatar.dispose();
      return frames;
    };
    const usual = await played(["mixer", "vrm", "skin"]);
    expect(Math.max(...usual.map(largestOffset))).toBeGreaterThan(0.005);
    for (const [order, framesLate] of [
      [["mixer", "skin", "vrm"], 0],
      [["vrm", "mixer", "skin"], 0],
      [["vrm", "skin", "mixer"], 1],
      [["skin", "vrm", "mixer"], 1],
      [["skin", "mixer", "vrm"], 1],
    ] as const) {
      const frames = await played(order);
      for (let frame = 30; frame < 120; frame += 1) {
        const [got = [], expected = []] = [frames[frame], usual[frame - framesLate]];
        expect(largestDifference(got, expected), `${order}`).toBeLessThan(1e-5);
      }
    }
  });
});

describe("vrma", async () => {
  const { playVrma } = await recipe<{
    playVrma(
      address: string,
      avatar: Avatar,
    ): Promise<{ motion: Motion; notes: string[]; frame(deltaSeconds: number): void }>;
  }>("vrma");

  it("plays the file over and over", async () => {
    const avatar = model.createAvatar();
    const file = Buffer.from(await hopGlb("vrma")).toString("base64");
    const { motion, notes, frame } = await playVrma(`data:model/gltf;base64,${file}`, avatar);
    expect(notes).toEqual([]);
    const knees = motion.jointReport?.mapped.find(({ joint }) => joint === "left_knee");
    expect(knees?.source).toBe("leftLowerLeg");
    const heights: number[] = [];
    const shaken = new Shaking(avatar);
    const frames = Math.round(motion.durationSeconds * 60);
    for (let tick = 0; tick < 1.5 * frames; tick += 1) {
      frame(TICK);
      shaken.watch();
      heights.push(jointAt(avatar, "pelvis").y);
    }
    expect(shaken.largestM).toBeGreaterThan(0.005);
    const riseM = Math.max(...heights) - (avatar.restJointsM()[1] ?? 0);
    expect(riseM).toBeGreaterThan(0.05);
    expect(riseM).toBeLessThan(0.2);
    for (let tick = 0; tick < 0.4 * frames; tick += 1) {
      expect(heights[frames + tick]).toBeCloseTo(heights[tick] ?? Number.NaN, 2);
    }
    motion.dispose();
    avatar.dispose();
  });

  it("says that a file is not there", async () => {
    const nowhere = "data:application/x-unknown;base64,!!!";
    await expect(playVrma(nowhere, model.createAvatar())).rejects.toThrow();
  });
});
