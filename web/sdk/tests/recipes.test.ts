// The recipes for poses that come as messages, and what all recipes have in common.
import { readdirSync } from "node:fs";
import { type Avatar, Motion, type Pose, restPose } from "dynaskin";
import oscModule from "osc-js";
import { Vector3 } from "three";
import { afterAll, describe, expect, it } from "vitest";
import {
  codeOf,
  degreesOff,
  jointAt,
  PAGES,
  randomNumbers,
  recipe,
  Shaking,
  TICK,
} from "./recipe-support.js";
import { loadModel } from "./support.js";

// The package's types take its class for a module's default.
const OSC = oscModule as unknown as typeof oscModule.default;
const model = await loadModel();

afterAll(() => model.dispose());

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
