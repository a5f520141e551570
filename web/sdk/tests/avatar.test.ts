import { type Avatar, type Model, Motion, POSE_LENGTH, restPose } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { expectError, largestDifference, largestOffset, loadModel, poseAt } from "./support.js";

const TICK = 1 / 60;
let model: Model;

beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => model.dispose());

function withAvatar(work: (avatar: Avatar) => void): void {
  const avatar = model.createAvatar();
  try {
    work(avatar);
  } finally {
    avatar.dispose();
  }
}

/** Steps through a motion; returns the largest offset on the way, in metres. */
function play(
  avatar: Avatar,
  motion: Motion,
  rateHz = 60,
  seconds = motion.durationSeconds,
): number {
  let largest = 0;
  for (let frame = 0; frame <= seconds * rateHz; frame += 1) {
    avatar.step(motion.poseAt(frame / rateHz), frame === 0 ? 0 : 1 / rateHz);
    largest = Math.max(largest, largestOffset(avatar.offsets));
  }
  return largest;
}

describe("stepping", () => {
  it("gives arrays of the body's size and adds the offsets to the positions", () =>
    withAvatar((avatar) => {
      const length = model.body.vertexCount * 3;
      const { positions, normals, offsets, skinMatrices } = avatar;
      expect([positions.length, normals.length, offsets.length]).toEqual([length, length, length]);
      expect(skinMatrices.length).toBe(24 * 16);
      const rest = positions.slice();
      play(avatar, Motion.procedural("hop", avatar), 60, 2);
      const expected = rest.map((value, idx) => value + (avatar.offsets[idx] ?? 0));
      expect(largestDifference(avatar.positions, expected)).toBeLessThan(1e-6);
    }));

  it("moves soft tissue by centimetres in a hop and lets it settle afterwards", () =>
    withAvatar((avatar) => {
      const largest = play(avatar, Motion.procedural("hop", avatar));
      expect(largest).toBeGreaterThan(0.01);
      expect(largest).toBeLessThan(0.12);
      const pose = restPose();
      for (let tick = 0; tick < 240; tick += 1) avatar.step(pose, TICK);
      expect(largestOffset(avatar.offsets)).toBeLessThan(1e-5);
    }));

  it("stands still without moving its skin", () =>
    withAvatar((avatar) => {
      for (let tick = 0; tick < 120; tick += 1) avatar.step(restPose(), TICK);
      expect(largestOffset(avatar.offsets)).toBeLessThan(1e-6);
    }));

  it("skins to the rest pose moved by the root's translation", () =>
    withAvatar((avatar) => {
      avatar.step(restPose(), 0);
      const rest = avatar.skinned().positions.slice();
      avatar.reset();
      avatar.step(poseAt(1, 2, 3), 0);
      const moved = avatar.skinned().positions;
      const expected = rest.map((value, idx) => value + (idx % 3) + 1);
      expect(largestDifference(moved, expected)).toBeLessThan(1e-5);
    }));

  it("gives unit normals", () =>
    withAvatar((avatar) => {
      play(avatar, Motion.procedural("twist", avatar), 60, 1.5);
      const { normals } = avatar.skinned();
      for (let idx = 0; idx < normals.length; idx += 3) {
        const [x = 0, y = 0, z = 0] = normals.subarray(idx, idx + 3);
        expect(Math.abs(Math.hypot(x, y, z) - 1)).toBeLessThan(1e-3);
      }
    }));

  it("gives the same motion at other display rates", () => {
    const at = (rateHz: number): Float32Array => {
      const avatar = model.createAvatar();
      play(avatar, Motion.procedural("hop", avatar), rateHz, 2);
      const offsets = avatar.offsets.slice();
      avatar.dispose();
      return offsets;
    };
    const reference = at(60);
    for (const rateHz of [30, 120, 240]) {
      expect(largestDifference(at(rateHz), reference), `${rateHz} Hz`).toBeLessThan(0.003);
    }
  });
});

describe("controls", () => {
  const hopped = (set: (avatar: Avatar) => void): { largest: number; offsets: Float32Array } => {
    const avatar = model.createAvatar();
    set(avatar);
    const largest = play(avatar, Motion.procedural("hop", avatar), 60, 1.6);
    const offsets = avatar.offsets.slice();
    avatar.dispose();
    return { largest, offsets };
  };

  it("switches to plain skinning and back", () =>
    withAvatar((avatar) => {
      const motion = Motion.procedural("hop", avatar);
      avatar.dynamics = false;
      expect(avatar.dynamics).toBe(false);
      expect(play(avatar, motion)).toBe(0);
      avatar.dynamics = true;
      expect(play(avatar, motion)).toBeGreaterThan(0.01);
    }));

  it("scales offsets with the strength", () => {
    const full = hopped(() => {});
    const half = hopped((avatar) => {
      avatar.strength = 0.5;
    });
    const expected = full.offsets.map((value) => value / 2);
    expect(largestDifference(half.offsets, expected)).toBeLessThan(1e-4);
  });

  it("turns one region off and leaves the others", () => {
    const full = hopped(() => {});
    const calm = hopped((avatar) => avatar.setRegionGain("belly", 0));
    const belly = model.body.regionWeights("belly");
    const inside = [...belly.keys()].filter((vertex) => (belly[vertex] ?? 0) > 0.99);
    expect(inside.length).toBeGreaterThan(20);
    for (const vertex of inside) {
      for (const axis of [0, 1, 2]) {
        expect(Math.abs(calm.offsets[vertex * 3 + axis] ?? 1)).toBeLessThan(1e-3);
      }
    }
    expect(calm.largest).toBeGreaterThan(full.largest / 4);
  });

  it("changes the shape", () =>
    withAvatar((avatar) => {
      const average = avatar.positions.slice();
      avatar.setShape([2, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
      expect(avatar.shape[0]).toBe(2);
      avatar.step(restPose(), 0);
      const top = (positions: Float32Array) =>
        Math.max(...positions.filter((_value, idx) => idx % 3 === 1));
      expect(top(avatar.positions) - top(average)).toBeGreaterThan(0.05);
    }));

  it("settles on reset", () =>
    withAvatar((avatar) => {
      const motion = Motion.procedural("hop", avatar);
      play(avatar, motion, 60, 1.5);
      avatar.reset();
      avatar.step(motion.poseAt(1.5), 1 / 60);
      expect(avatar.timings.settled).toBe(true);
      expect(largestOffset(avatar.offsets)).toBeLessThan(0.005);
    }));
});

describe("bad input leaves the avatar as it was", () => {
  const cases: [string, string, (avatar: Avatar) => void][] = [
    ["a pose that is too short", "argument", (avatar) => avatar.step(new Float64Array(72), TICK)],
    ["a pose with NaN", "pose", (avatar) => avatar.step(restPose().fill(Number.NaN, 20, 21), TICK)],
    [
      "a pose without rotations",
      "pose",
      (avatar) => avatar.step(new Float64Array(POSE_LENGTH), TICK),
    ],
    ["a shape of wrong length", "argument", (avatar) => avatar.setShape([1, 2, 3])],
    ["a shape with NaN", "shape", (avatar) => avatar.setShape(new Array(10).fill(Number.NaN))],
    [
      "an unknown region",
      "argument",
      (avatar) => avatar.setRegionGain("nose" as unknown as "belly", 1),
    ],
  ];
  it.each(cases)("%s", async (_name, code, spoil) => {
    const avatar = model.createAvatar();
    const motion = Motion.procedural("hop", avatar);
    play(avatar, motion, 60, 1.4);
    const before = avatar.offsets.slice();
    await expectError(code, () => spoil(avatar));
    expect(largestDifference(avatar.offsets, before)).toBe(0);
    avatar.step(motion.poseAt(1.4 + TICK), TICK);
    expect(largestOffset(avatar.offsets)).toBeGreaterThan(0.001);
    avatar.dispose();
  });

  it("a wrong shape when an avatar is made", () =>
    expectError("argument", () => model.createAvatar({ shape: [1] })));
});

describe("memory", () => {
  it("does not grow while an avatar is stepped, and views stay good", () =>
    withAvatar((avatar) => {
      const motion = Motion.procedural("run-in-place", avatar);
      play(avatar, motion, 60, 1);
      const { buffer } = avatar.offsets;
      for (let frame = 0; frame < 3000; frame += 1) {
        avatar.step(motion.poseAt((frame / 60) % 8), TICK);
        if (frame % 100 === 0) avatar.skinned();
      }
      expect(avatar.offsets.buffer).toBe(buffer);
    }));

  it("is given back by dispose", () => {
    const cycle = () => {
      const avatar = model.createAvatar();
      const motion = Motion.procedural("hop", avatar, { durationSeconds: 4 });
      avatar.step(restPose(), TICK);
      const { byteLength } = avatar.positions.buffer;
      motion.dispose();
      avatar.dispose();
      return byteLength;
    };
    for (let idx = 0; idx < 20; idx += 1) cycle();
    const settled = cycle();
    for (let idx = 0; idx < 200; idx += 1) cycle();
    expect(cycle()).toBe(settled);
  });

  it("gives a view that is good after the memory has grown", async () => {
    const avatar = model.createAvatar();
    const before = avatar.positions.slice();
    const others = [];
    const { buffer } = avatar.positions;
    while (avatar.positions.buffer === buffer) others.push(model.createAvatar());
    expect(largestDifference(avatar.positions, before)).toBe(0);
    for (const other of [avatar, ...others]) other.dispose();
  });

  it("refuses use after dispose, and dispose may be repeated", async () => {
    const avatar = model.createAvatar();
    avatar.dispose();
    avatar.dispose();
    await expectError("disposed", () => avatar.step(restPose(), TICK));
    await expectError("disposed", () => avatar.reset());
    await expectError("disposed", () => avatar.positions);
  });
});
