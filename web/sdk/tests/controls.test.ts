import { type Avatar, type Model, Motion, REGION_NAMES, restPose } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { expectError, largestDifference, largestOffset, loadModel } from "./support.js";

const TICK = 1 / 60;
let model: Model;

beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => model.dispose());

/** Largest offset of a hop under the controls that `set` gives, in metres. */
function hopped(set: (avatar: Avatar) => void, scale = 1): { largest: number; end: Float32Array } {
  const avatar = model.createAvatar();
  set(avatar);
  const motion = Motion.procedural("hop", avatar, { durationSeconds: 4 });
  let largest = 0;
  for (let frame = 0; frame < 180; frame += 1) {
    const pose = motion.poseAt(frame * TICK);
    for (const axis of [0, 1, 2]) pose[axis] = (pose[axis] ?? 0) * scale;
    avatar.step(pose, TICK);
    largest = Math.max(largest, largestOffset(avatar.offsets));
  }
  const end = avatar.offsets.slice();
  motion.dispose();
  avatar.dispose();
  return { largest, end };
}

function allRegions<T>(value: T): Record<string, T> {
  return Object.fromEntries(REGION_NAMES.map((name) => [name, value]));
}

describe("controls", () => {
  it("begin as predicted and are given back as they were set", () => {
    const avatar = model.createAvatar();
    const { strength, rootInertia, regions } = avatar.controls;
    expect([strength, rootInertia]).toEqual([1, 1]);
    expect(regions.chest.limitCm).toBeCloseTo(17, 4);
    expect(regions.belly.limitCm).toBeCloseTo(12, 4);
    expect(regions.calves.limitCm).toBeCloseTo(3, 4);
    avatar.setControls({ strength: 0.5, regions: { thighs: { stiffness: 2, limitCm: 3 } } });
    const changed = avatar.controls;
    expect(changed.strength).toBe(0.5);
    expect(changed.regions.thighs.stiffness).toBe(2);
    expect(changed.regions.thighs.limitCm).toBeCloseTo(3, 4);
    expect(changed.regions.thighs.damping).toBe(1);
    expect(changed.regions.calves).toEqual(regions.calves);
    avatar.setControls("as-predicted");
    expect(avatar.controls).toEqual({ strength, rootInertia, regions });
    avatar.dispose();
  });

  it("make tissue stiffer, more damped, limited and calm", () => {
    const plain = hopped(() => {}).largest;
    const stiff = hopped((a) => a.setControls({ regions: allRegions({ stiffness: 6 }) })).largest;
    const damped = hopped((a) => a.setControls({ regions: allRegions({ damping: 4 }) })).largest;
    const limited = hopped((a) => a.setControls({ regions: allRegions({ limitCm: 1 }) })).largest;
    const calm = hopped((a) => a.setControls("calm-clothes")).largest;
    const still = hopped((a) => a.setControls({ strength: 0 })).largest;
    expect(stiff).toBeLessThan(0.7 * plain);
    expect(damped).toBeLessThan(0.9 * plain);
    expect(limited).toBeLessThan(0.01001);
    expect(calm).toBeLessThan(0.6 * plain);
    expect(calm).toBeLessThan(0.02001);
    expect(still).toBe(0);
  });

  it("hold chest and hips under sportswear, and leave the arms alone", () => {
    const { regions } = model.createAvatar().controls;
    const avatar = model.createAvatar();
    avatar.setControls("sportswear");
    const held = avatar.controls.regions;
    expect(held.chest.gain).toBeLessThan(regions.chest.gain);
    expect(held.chest.stiffness).toBeGreaterThan(held.buttocks.stiffness);
    expect(held.buttocks.stiffness).toBeGreaterThan(1);
    expect(held["upper-arms"]).toEqual(regions["upper-arms"]);
    avatar.dispose();
    const plain = hopped(() => {}).largest;
    const worn = hopped((a) => a.setControls("sportswear")).largest;
    expect(worn).toBeLessThan(0.9 * plain);
    expect(worn).toBeGreaterThan(0.1 * plain);
  });

  it("leave a jerking lift out without root inertia", () => {
    const avatar = model.createAvatar();
    avatar.setControls({ rootInertia: 0 });
    const pose = restPose();
    avatar.step(pose, 0);
    const rest = avatar.offsets.slice();
    for (let frame = 0; frame < 60; frame += 1) {
      pose[1] = 0.05 * Math.sin(0.2 * frame);
      avatar.step(pose, TICK);
      expect(largestDifference(avatar.offsets, rest)).toBeLessThan(5e-4);
    }
    avatar.dispose();
  });

  it.each([0.1, 10])("give the same offsets at scale %s", (scale) => {
    const scaled = hopped((avatar) => {
      avatar.scale = scale;
      expect(avatar.scale).toBe(scale);
    }, scale);
    expect(largestDifference(scaled.end, hopped(() => {}).end)).toBeLessThan(1e-5);
  });

  const refused: [string, (avatar: Avatar) => void][] = [
    ["a negative strength", (avatar) => avatar.setControls({ strength: -1 })],
    ["a stiffness of 0", (avatar) => avatar.setControls({ regions: { belly: { stiffness: 0 } } })],
    [
      "a damping that is no number",
      (avatar) => avatar.setControls({ regions: { belly: { damping: Number.NaN } } }),
    ],
    [
      "a limit of a metre",
      (avatar) => avatar.setControls({ regions: { chest: { limitCm: 100 } } }),
    ],
    [
      "a control that is a text",
      (avatar) => avatar.setControls({ rootInertia: "much" as unknown as number }),
    ],
    [
      "an unknown region",
      (avatar) => avatar.setControls({ regions: { nose: { gain: 1 } } as never }),
    ],
    ["an unknown preset", (avatar) => avatar.setControls("wobbly" as "calm-clothes")],
    [
      "a scale of 0",
      (avatar) => {
        avatar.scale = 0;
      },
    ],
    [
      "a scale that is no number",
      (avatar) => {
        avatar.scale = Number.NaN;
      },
    ],
  ];
  it.each(refused)("refuse %s and stay as they were", async (_name, spoil) => {
    const avatar = model.createAvatar();
    avatar.setControls("calm-clothes");
    const before = avatar.controls;
    await expectError("argument", () => spoil(avatar));
    expect(avatar.controls).toEqual(before);
    expect(avatar.scale).toBe(1);
    avatar.dispose();
  });
});

describe("time", () => {
  const shaken = (): { avatar: Avatar; motion: Motion; time: number } => {
    const avatar = model.createAvatar();
    const motion = Motion.procedural("hop", avatar, { durationSeconds: 4 });
    let time = 0;
    avatar.step(motion.poseAt(0), 0);
    while (time < 3 && (time < 1 || largestOffset(avatar.offsets) < 0.01)) {
      time += TICK;
      avatar.step(motion.poseAt(time), TICK);
    }
    expect(largestOffset(avatar.offsets)).toBeGreaterThan(0.005);
    return { avatar, motion, time };
  };

  it("says why tissue was settled, and fades after a teleport and a stall", () => {
    for (const [because, dtSeconds, far] of [
      ["cut", TICK, 5],
      ["stall", 30, 0],
    ] as const) {
      const { avatar, motion, time } = shaken();
      expect(avatar.timings.settledBecause).toBeNull();
      const before = avatar.offsets.slice();
      const pose = motion.poseAt(time);
      pose[0] = (pose[0] ?? 0) + far;
      avatar.step(pose, dtSeconds);
      expect(avatar.timings.settledBecause).toBe(because);
      expect(largestDifference(avatar.offsets, before)).toBeLessThan(1e-6);
      for (let frame = 0; frame < 15; frame += 1) avatar.step(pose, TICK);
      const settled = model.createAvatar();
      settled.step(pose, 0);
      const left = largestDifference(avatar.offsets, settled.offsets);
      expect(left).toBeLessThan(0.2 * largestOffset(before));
      settled.dispose();
      motion.dispose();
      avatar.dispose();
    }
  });

  it.each([-TICK, Number.NaN, Number.POSITIVE_INFINITY, 1.7e12])(
    "refuses a step of %s s and goes on",
    async (dtSeconds) => {
      const { avatar, motion, time } = shaken();
      const before = avatar.offsets.slice();
      await expectError("argument", () => avatar.step(motion.poseAt(time + TICK), dtSeconds));
      expect(largestDifference(avatar.offsets, before)).toBe(0);
      avatar.step(motion.poseAt(time + TICK), TICK);
      expect(avatar.timings.settled).toBe(false);
      motion.dispose();
      avatar.dispose();
    },
  );
});
