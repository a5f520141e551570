// The code of the pages in docs/recipes, run as it stands there.
import { mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import * as vrmCore from "@pixiv/three-vrm-core";
import { type Avatar, JOINT_NAMES, type JointName, Motion, type Pose, restPose } from "dynaskin";
import { DynaSkin } from "dynaskin/three";
import oscModule from "osc-js";
import {
  AnimationClip,
  AnimationMixer,
  Group,
  Matrix4,
  Object3D,
  Quaternion,
  QuaternionKeyframeTrack,
  type SkinnedMesh,
  Vector3,
  VectorKeyframeTrack,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { afterAll, describe, expect, it } from "vitest";
import { hopGlb } from "../../../tests/hop-files.js";
import { largestDifference, largestOffset, loadModel, readModelFile } from "./support.js";

const PAGES = new URL("../../../docs/recipes/", import.meta.url);
const EXTRACTED = new URL("../../../test-results/recipes/", import.meta.url);
const TICK = 1 / 60;
// The package's types take its class for a module's default.
const OSC = oscModule as unknown as typeof oscModule.default;
const model = await loadModel();

afterAll(() => model.dispose());

/** The only block of code of a page. */
function codeOf(name: string): string {
  const page = readFileSync(new URL(`${name}.md`, PAGES), "utf8");
  const blocks = [...page.matchAll(/^```js\n([\s\S]*?)^```$/gm)].map(([, code = ""]) => code);
  expect(blocks.length, `blocks of code in ${name}.md`).toBe(1);
  return blocks[0] ?? "";
}

/** What the code of a page exports. */
async function recipe<Exports>(name: string): Promise<Exports> {
  const file = fileURLToPath(new URL(`${name}.mjs`, EXTRACTED));
  mkdirSync(EXTRACTED, { recursive: true });
  writeFileSync(file, codeOf(name));
  return (await import(/* @vite-ignore */ file)) as Exports;
}

/** How much the tissue shakes: watched after every frame, in metres. */
class Shaking {
  readonly #avatar: Avatar;
  #last: Float32Array[] = [];
  #squares = 0;
  #count = 0;
  /** Largest offset that was seen. */
  largestM = 0;

  constructor(avatar: Avatar) {
    this.#avatar = avatar;
  }

  watch(): void {
    const now = this.#avatar.offsets.slice();
    const [before, last] = this.#last;
    if (before && last) {
      for (const [idx, metres] of now.entries()) {
        this.#squares += (metres - 2 * (last[idx] ?? 0) + (before[idx] ?? 0)) ** 2;
      }
      this.#count += now.length;
    }
    this.largestM = Math.max(this.largestM, largestOffset(now));
    this.#last = [last ?? now, now];
  }

  /** Root mean square of second differences from frame to frame. */
  get rmsM(): number {
    return Math.sqrt(this.#squares / Math.max(1, this.#count));
  }
}

/** Where a joint is in the world, metres. */
function jointAt(avatar: Avatar, name: JointName): Vector3 {
  const joint = JOINT_NAMES.indexOf(name);
  const worldFromRest = new Matrix4().fromArray(avatar.skinMatrices, 16 * joint);
  return new Vector3().fromArray(avatar.restJointsM(), 3 * joint).applyMatrix4(worldFromRest);
}

/** Degrees between the line from one joint to another and a direction in the world. */
function degreesOff(avatar: Avatar, from: JointName, to: JointName, direction: number[]): number {
  const line = jointAt(avatar, to).sub(jointAt(avatar, from));
  return (line.angleTo(new Vector3(...direction)) * 180) / Math.PI;
}

/** Evenly spread numbers from 0 to 1, the same in every run. */
function randomNumbers(seed: number): () => number {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

it("each page has one block of at most 30 lines", () => {
  const names = readdirSync(PAGES).filter((name) => name.endsWith(".md"));
  expect(names.length).toBeGreaterThan(0);
  for (const name of names) {
    const lines = codeOf(name.replace(/\.md$/, "")).trimEnd().split("\n");
    expect(lines.length, name).toBeLessThanOrEqual(30);
    for (const line of lines) expect(line.length, `${name}: ${line}`).toBeLessThanOrEqual(100);
  }
});

describe("network-avatar", async () => {
  const { sendPose, networkAvatar } = await recipe<{
    sendPose(socket: { send(data: ArrayBuffer): void }, pose: Pose): void;
    networkAvatar(
      model: unknown,
      socket: EventTarget,
    ): { avatar: Avatar; frame(deltaSeconds: number): void };
  }>("network-avatar");

  /** Plays a hop of 4 s, and 2 s of standing still, sent at 15 Hz with arrivals late by 0 to 30 ms. */
  function play(change: (avatar: Avatar) => void = () => {}) {
    const socket = new EventTarget();
    const { avatar, frame } = networkAvatar(model, socket);
    change(avatar);
    const motion = Motion.procedural("hop", avatar, { durationSeconds: 4 });
    const random = randomNumbers(7);
    const sent: { at: number; data: ArrayBuffer }[] = [];
    for (let message = 0; message < 90; message += 1) {
      const send = (data: ArrayBuffer) => sent.push({ at: message / 15 + random() * 0.03, data });
      sendPose({ send }, motion.poseAt(message / 15));
    }
    const [moving, still] = [new Shaking(avatar), new Shaking(avatar)];
    const latenciesMs: number[] = [];
    for (let tick = 0; tick < 360; tick += 1) {
      while (sent[0] && sent[0].at <= tick / 60) {
        socket.dispatchEvent(new MessageEvent("message", { data: sent.shift()?.data }));
      }
      frame(TICK);
      if (tick < 270) moving.watch();
      if (tick > 330) still.watch();
      if (tick > 60 && tick < 200) latenciesMs.push(avatar.timings.source.latencyMs);
    }
    motion.dispose();
    return { avatar, frame, socket, moving, still, latenciesMs };
  }

  it("moves the tissue evenly, though poses come at 15 Hz and late", () => {
    const { avatar, moving, still, latenciesMs } = play();
    const held = play((other) => {
      other.poseSource = "as-given";
    });
    for (const ms of latenciesMs) expect(ms).toBeGreaterThan(60);
    for (const ms of latenciesMs) expect(ms).toBeLessThan(180);
    expect(moving.largestM).toBeGreaterThan(0.002);
    expect(moving.rmsM).toBeLessThan(0.5 * held.moving.rmsM);
    expect(still.rmsM).toBeLessThan(1e-5);
    avatar.dispose();
    held.avatar.dispose();
  });

  it("stays as it was where a message is no pose, and goes on with the next", () => {
    const { avatar, frame, socket } = play();
    const before = avatar.skinMatrices.slice();
    for (const data of [
      new ArrayBuffer(3),
      new Float32Array(99).fill(Number.NaN).buffer,
      "hello",
    ]) {
      socket.dispatchEvent(new MessageEvent("message", { data }));
      frame(TICK);
      expect(avatar.skinMatrices).toEqual(before);
    }
    const pose = restPose();
    pose[1] = 0.01;
    sendPose({ send: (data) => socket.dispatchEvent(new MessageEvent("message", { data })) }, pose);
    frame(TICK);
    expect(avatar.skinMatrices).not.toEqual(before);
    avatar.dispose();
  });
});

describe("vmc", async () => {
  const { vmcAvatar } = await recipe<{
    vmcAvatar(model: unknown, osc: unknown, hipsHeightM: number): { avatar: Avatar; pose: Pose };
  }>("vmc");
  const [IDENTITY, HIPS_M] = [[0, 0, 0, 1], 1.1];
  const LIMBS = ["UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand"];

  /** A plugin of osc-js into which the bytes of a datagram are put. */
  function receiver() {
    let notify: (bytes: Uint8Array) => void = () => {};
    const plugin = {
      registerNotify(callback: typeof notify) {
        notify = callback;
      },
      open() {},
    };
    const osc = new OSC({ plugin } as unknown as ConstructorParameters<typeof OSC>[0]);
    const send = (bones: Record<string, number[]>) => {
      const messages = Object.entries(bones).map(([name, numbers]) => {
        const message = new OSC.Message(`/VMC/Ext/${name === "root" ? "Root" : "Bone"}/Pos`);
        message.add(name);
        for (const value of numbers) {
          message.types += "f";
          message.args.push(value);
        }
        return message;
      });
      const bundle = new OSC.Bundle(messages);
      bundle.timestamp(0); // "at once": senders do not date their bundles
      notify(bundle.pack());
    };
    return { osc, send };
  }

  /** An avatar to which this was sent, a quaternion or place and quaternion by bone. */
  function sent(bones: Record<string, number[]>) {
    const { osc, send } = receiver();
    const { avatar, pose } = vmcAvatar(model, osc, HIPS_M);
    // As programs do, all of it is sent, turned or not.
    const unturned = LIMBS.flatMap((name) => [`Left${name}`, `Right${name}`]);
    const whole = {
      root: IDENTITY,
      Hips: [0, HIPS_M, 0, ...IDENTITY],
      ...Object.fromEntries(unturned.map((name) => [name, IDENTITY])),
      ...bones,
    };
    send(
      Object.fromEntries(
        Object.entries(whole).map(([name, n]) => [name, n.length === 4 ? [0, 0, 0, ...n] : n]),
      ),
    );
    avatar.step(pose, 0);
    return { avatar, pose, send };
  }
  const about = (axis: 0 | 1 | 2, degrees: number) => {
    const half = (degrees * Math.PI) / 360;
    const turn = [0, 0, 0, Math.cos(half)];
    turn[axis] = Math.sin(half);
    return turn;
  };

  it("stands in a T where no bone is turned", () => {
    const { avatar } = sent({});
    expect(degreesOff(avatar, "left_shoulder", "left_elbow", [1, 0, 0])).toBeLessThan(1);
    expect(degreesOff(avatar, "right_elbow", "right_wrist", [-1, 0, 0])).toBeLessThan(1);
    expect(degreesOff(avatar, "left_knee", "left_ankle", [0, -1, 0])).toBeLessThan(1);
    expect(jointAt(avatar, "pelvis").y).toBeCloseTo(avatar.restJointsM()[1] ?? 0, 5);
  });

  it("takes Unity's left-handed turns as they are meant", () => {
    // A positive turn about z lowers Unity's left arm, about x bends a knee backwards.
    const { avatar } = sent({
      LeftUpperArm: about(2, 90),
      RightLowerArm: about(1, 60),
      RightLowerLeg: about(0, 60),
      Chest: about(1, 30),
    });
    // The chest turns to its right, and the arms with it.
    const [cos, sin] = [Math.cos(Math.PI / 6), Math.sin(Math.PI / 6)];
    expect(degreesOff(avatar, "left_shoulder", "left_elbow", [0, -1, 0])).toBeLessThan(1);
    expect(degreesOff(avatar, "right_shoulder", "right_elbow", [-cos, 0, -sin])).toBeLessThan(1);
    expect(degreesOff(avatar, "right_elbow", "right_wrist", [0, 0, -1])).toBeLessThan(1);
    expect(degreesOff(avatar, "right_knee", "right_ankle", [0, -0.5, -cos])).toBeLessThan(1);
  });

  it("puts the hips where root and hips say, in this body's size", () => {
    // The root 2 m to Unity's right, turned to its own left.
    const { avatar } = sent({ root: [2, 0, 0, ...about(1, -90)], Hips: [0, 0.55, 1, ...IDENTITY] });
    const height = avatar.restJointsM()[1] ?? 0;
    const scale = height / HIPS_M;
    const pelvis = jointAt(avatar, "pelvis");
    // Ahead is now Unity's left, which is our +x.
    expect(pelvis.distanceTo(new Vector3(-2 * scale + scale, height / 2, 0))).toBeLessThan(1e-5);
    const hips = jointAt(avatar, "left_hip").sub(jointAt(avatar, "right_hip"));
    expect(hips.angleTo(new Vector3(0, 0, -1))).toBeLessThan(0.02);
  });

  it("moves the tissue of somebody who bounces, and lets it rest after", () => {
    const { avatar, pose, send } = sent({});
    const [moving, still] = [new Shaking(avatar), new Shaking(avatar)];
    for (let tick = 1; tick < 300; tick += 1) {
      const bounceM = tick < 150 ? 0.06 * Math.sin((tick / 60) * 2 * Math.PI * 2.5) : 0;
      send({ Hips: [0, HIPS_M + bounceM, 0, ...IDENTITY] });
      avatar.step(pose, TICK);
      if (tick < 150) moving.watch();
      if (tick > 270) still.watch();
    }
    expect(moving.largestM).toBeGreaterThan(0.005);
    expect(still.rmsM).toBeLessThan(1e-5);
  });
});

describe("mediapipe", async () => {
  interface Point {
    x: number;
    y: number;
    z: number;
  }
  interface Result {
    worldLandmarks: Point[][];
    landmarks: Point[][];
  }
  const { mediapipePose } = await recipe<{
    mediapipePose(result: Result, first: Result, restJointsM: Float32Array, aspect: number): Pose;
  }>("mediapipe");
  const ASPECT = 4 / 3;
  const LANDMARKS = new Map<number, JointName>();
  for (const [left, part] of [
    [11, "shoulder"],
    [13, "elbow"],
    [15, "wrist"],
    [23, "hip"],
    [25, "knee"],
    [27, "ankle"],
  ] as const) {
    LANDMARKS.set(left, `left_${part}`).set(left + 1, `right_${part}`);
  }

  /** What a camera 3.4 m before a body in this pose sees, with `noise` on every number; legs without depth. */
  function seen(truth: Avatar, pose: Pose, noise: () => number = () => 0): Result {
    truth.step(pose, 0);
    const hips = jointAt(truth, "left_hip").lerp(jointAt(truth, "right_hip"), 0.5);
    const [world, picture]: Point[][] = [[], []];
    for (let landmark = 0; landmark < 33; landmark += 1) {
      const at = jointAt(truth, LANDMARKS.get(landmark) ?? "head");
      at.add(new Vector3(noise(), noise(), noise()));
      const enlarged = 1.3 / (3.4 - at.z);
      picture?.push({
        x: 0.5 + (at.x * enlarged) / ASPECT,
        y: 0.5 - (at.y - 0.9) * enlarged,
        z: 0,
      });
      const { x, y, z } = at.sub(hips);
      world?.push({ x, y: -y, z: landmark > 24 ? 0 : -z });
    }
    return { worldLandmarks: [world ?? []], landmarks: [picture ?? []] };
  }

  const turned = (turns: Partial<Record<JointName, [Vector3, number]>>) => {
    const pose = restPose();
    for (const [name, [axis, degrees]] of Object.entries(turns)) {
      const turn = new Quaternion().setFromAxisAngle(axis, (degrees * Math.PI) / 180);
      turn.toArray(pose, 3 + 4 * JOINT_NAMES.indexOf(name as JointName));
    }
    return pose;
  };
  const [X, Y, Z] = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)];

  /** Degrees by which the worst of the limbs of two avatars differ. */
  function worstLimb(a: Avatar, b: Avatar, parts: readonly (readonly [string, string])[]): number {
    const sides = ["left", "right"].flatMap((side) =>
      parts.map(([from, to]) => [`${side}_${from}`, `${side}_${to}`] as [JointName, JointName]),
    );
    return Math.max(
      ...sides.map(([from, to]) =>
        degreesOff(a, from, to, jointAt(b, to).sub(jointAt(b, from)).toArray()),
      ),
    );
  }
  const ARMS = [
    ["shoulder", "elbow"],
    ["elbow", "wrist"],
  ] as const;
  const LEGS = [
    ["hip", "knee"],
    ["knee", "ankle"],
  ] as const;

  it("turns trunk and arms as the person has them", () => {
    const [truth, avatar] = [model.body.createAvatar(), model.createAvatar()];
    const first = seen(truth, restPose());
    const pose = turned({
      pelvis: [Y, 20],
      spine2: [Y, -35],
      left_shoulder: [Z, 80],
      left_elbow: [Y, -60],
      right_shoulder: [X, -70],
      right_elbow: [X, -40],
    });
    avatar.step(mediapipePose(seen(truth, pose), first, avatar.restJointsM(), ASPECT), 0);
    expect(worstLimb(avatar, truth, ARMS)).toBeLessThan(1);
    const across = jointAt(truth, "left_hip").sub(jointAt(truth, "right_hip"));
    // The line from hips to shoulders counts as the trunk's up; at rest it leans by two degrees.
    expect(degreesOff(avatar, "right_hip", "left_hip", across.toArray())).toBeLessThan(2);
  });

  it.each([0, 20, 45, 70])("finds thighs that bend by %f degrees towards the camera", (degrees) => {
    const [truth, avatar] = [model.body.createAvatar(), model.createAvatar()];
    const first = seen(truth, restPose());
    const pose = turned({
      left_hip: [X, -degrees],
      right_hip: [X, -degrees],
      left_knee: [X, 2 * degrees],
      right_knee: [X, 2 * degrees],
    });
    pose[1] = -0.77 * (1 - Math.cos((degrees * Math.PI) / 180));
    const result = seen(truth, pose);
    const found = mediapipePose(result, first, avatar.restJointsM(), ASPECT);
    avatar.step(found, 0);
    // The camera enlarges knees that come near, and 2 % of each length count as noise.
    expect(worstLimb(avatar, truth, LEGS)).toBeLessThan(15);
    expect(Math.abs((found[1] ?? Number.NaN) - pose[1])).toBeLessThan(0.02);
  });

  it("moves the tissue of somebody who hops, and hardly that of somebody who stands", () => {
    const shaking = (poseSource: "tracker" | "as-given", hops: boolean) => {
      const [truth, avatar] = [model.body.createAvatar(), model.createAvatar({ poseSource })];
      const motion = Motion.procedural("hop", truth);
      const random = randomNumbers(3);
      // As a tracker's own smoothing leaves it: 1.5 mm that wander slowly.
      const wandering = new Float64Array(99);
      let number = 0;
      const noise = () => {
        const idx = number++ % wandering.length;
        const fresh = 2 * (random() + random() + random() - 1.5);
        wandering[idx] = 0.97 * (wandering[idx] ?? 0) + 0.0015 * Math.sqrt(1 - 0.97 ** 2) * fresh;
        return wandering[idx] ?? 0;
      };
      const first = seen(truth, restPose());
      const shaken = new Shaking(avatar);
      let pose = restPose();
      for (let tick = 0; tick < 240; tick += 1) {
        const truePose = hops ? motion.poseAt(tick / 60) : restPose();
        if (tick % 2 === 0) {
          pose = mediapipePose(seen(truth, truePose, noise), first, avatar.restJointsM(), ASPECT);
        }
        avatar.step(pose, tick === 0 ? 0 : TICK);
        if (tick > 120) shaken.watch();
      }
      motion.dispose();
      return shaken;
    };
    const [hop, still, raw] = [
      shaking("tracker", true),
      shaking("tracker", false),
      shaking("as-given", false),
    ];
    expect(hop.largestM).toBeGreaterThan(0.01);
    expect(still.rmsM).toBeLessThan(0.2 * raw.rmsM);
    expect(still.largestM).toBeLessThan(0.003);
  });
});

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
