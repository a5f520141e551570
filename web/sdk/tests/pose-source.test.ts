// Where poses come from: the option, the property, and what the avatar finds out.
import { type Avatar, Motion, type Pose, type PoseSource } from "dynaskin";
import { afterAll, describe, expect, it } from "vitest";
import { expectError, largestDifference, loadModel } from "./support.js";

const TICK = 1 / 60;
const model = await loadModel("female");

afterAll(() => model.dispose());

/**
 * Plays `seconds` of a hop whose poses are made `rateHz` times a second; gives how much the tissue shakes: the root mean
 * square of its second differences from frame to frame, in metres.
 */
function shaking(avatar: Avatar, rateHz: number, seconds: number): number {
  const motion = Motion.procedural("hop", avatar);
  let [before, last] = [avatar.offsets.slice(), avatar.offsets.slice()];
  let squares = 0;
  const frames = seconds * 60;
  for (let frame = 0; frame < frames; frame += 1) {
    const made = Math.floor((frame / 60) * rateHz + 1e-6) / rateHz;
    avatar.step(motion.poseAt(made), frame === 0 ? 0 : TICK);
    const now = avatar.offsets.slice();
    for (const [idx, metres] of now.entries()) {
      squares += (metres - 2 * (last[idx] ?? 0) + (before[idx] ?? 0)) ** 2;
    }
    [before, last] = [last, now];
  }
  motion.dispose();
  return Math.sqrt(squares / frames / last.length);
}

describe("poseSource", () => {
  it("conditions held poses in a crowd as alone", () => {
    const [alone, member, plain] = (["network", "network", "as-given"] as const).map((poseSource) =>
      model.createAvatar({ poseSource }),
    ) as [Avatar, Avatar, Avatar];
    const crowd = model.createCrowd();
    crowd.add(member);
    const motion = Motion.procedural("hop", alone);
    for (let tick = 0; tick < 90; tick += 1) {
      // 30 poses a second, each held over two frames.
      const pose = motion.poseAt(Math.floor(tick / 2) / 30);
      alone.step(pose, TICK);
      plain.step(pose, TICK);
      crowd.stepAll([pose], TICK);
    }
    expect(largestDifference(member.offsets, alone.offsets)).toBeLessThan(1e-6);
    expect(largestDifference(member.offsets, plain.offsets)).toBeGreaterThan(1e-3);
    for (const each of [crowd, alone, member, plain, motion]) each.dispose();
  });

  it("is an option and a property", async () => {
    const avatar = model.createAvatar({ poseSource: "tracker" });
    expect(avatar.poseSource).toBe("tracker");
    for (const source of ["display", "network", "as-given"] as const) {
      avatar.poseSource = source;
      expect(avatar.poseSource).toBe(source);
    }
    const webcam = "webcam" as PoseSource;
    await expectError("argument", () => model.createAvatar({ poseSource: webcam }));
    await expectError("argument", () => {
      avatar.poseSource = webcam;
    });
    expect(avatar.poseSource).toBe("as-given");
    avatar.dispose();
    expect(model.createAvatar().poseSource).toBe("display");
  });

  it("finds out about held poses, and says how late the tissue is", () => {
    const avatar = model.createAvatar();
    shaking(avatar, 30, 3);
    const { repeats, intervalMs, latencyMs } = avatar.timings.source;
    expect(repeats).toBe(true);
    expect(intervalMs).toBeCloseTo(1000 / 30, 0);
    expect(latencyMs).toBeGreaterThan(10);
    expect(latencyMs).toBeLessThan(40);
    avatar.dispose();
  });

  it("leaves alone what is new in every frame", () => {
    const [conditioned, asGiven] = [
      model.createAvatar(),
      model.createAvatar({ poseSource: "as-given" }),
    ];
    const motion = Motion.procedural("run-in-place", conditioned);
    for (let frame = 60; frame < 180; frame++) {
      const pose: Pose = motion.poseAt(frame / 60);
      for (const avatar of [conditioned, asGiven]) avatar.step(pose, TICK);
    }
    expect(conditioned.offsets).toEqual(asGiven.offsets);
    expect(conditioned.timings.source).toMatchObject({
      repeats: false,
      latencyMs: 0,
      advice: null,
    });
  });

  it("keeps held poses from shaking the tissue", () => {
    const even = shaking(model.createAvatar(), 60, 3);
    const held = shaking(model.createAvatar({ poseSource: "as-given" }), 30, 3);
    const conditioned = shaking(model.createAvatar(), 30, 3);
    expect(held).toBeGreaterThan(1.5 * even);
    expect(conditioned).toBeLessThan(1.2 * even);
  });
});
