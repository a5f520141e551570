// Recorded motions and offsets: what is shown is what was given.
import { type Avatar, type Model, Motion, POSE_LENGTH } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { expectError, largestDifference, largestOffset, loadModel, poseAt } from "./support.js";

let model: Model;
let moving: Avatar;
let plain: Avatar;

beforeAll(async () => {
  model = await loadModel();
  moving = model.createAvatar();
  plain = model.body.createAvatar();
});
afterAll(() => {
  moving.dispose();
  plain.dispose();
  model.dispose();
});

describe("offsets that are shown", () => {
  it("give the surface of the avatar they come from, normals included", () => {
    const motion = Motion.procedural("hop", moving);
    for (let tick = 0; tick <= 200; tick += 1) {
      const pose = motion.poseAt(tick / 60);
      for (const avatar of [moving, plain]) avatar.step(pose, 1 / 60);
    }
    expect(largestOffset(plain.offsets)).toBe(0);
    plain.showOffsets(moving.offsets.slice());
    expect(largestOffset(plain.offsets)).toBeGreaterThan(1e-3);
    expect(largestDifference(plain.positions, moving.positions)).toBeLessThan(1e-7);
    expect(largestDifference(plain.normals, moving.normals)).toBeLessThan(1e-5);
    plain.step(motion.poseAt(1), 1 / 60);
    expect(largestDifference(plain.offsets, moving.offsets)).toBe(0);
    motion.dispose();
  });

  it("are refused in another number, not finite, or where networks run", async () => {
    const good = new Float32Array(6890 * 3);
    const before = plain.positions.slice();
    await expectError("argument", () => plain.showOffsets(good.subarray(3)));
    await expectError("argument", () => plain.showOffsets(good.slice().fill(Number.NaN, 7, 8)));
    await expectError("argument", () => plain.showOffsets([0] as unknown as Float32Array));
    const error = await expectError("argument", () => moving.showOffsets(good));
    expect(error.message).toContain("networks");
    expect(plain.positions).toEqual(before);
  });
});

describe("motions of poses", () => {
  it("play the poses at their rate", () => {
    const frames = Array.from({ length: 31 }, (_, idx) => poseAt(idx, 1, -idx));
    const poses = Float64Array.from(frames.flatMap((pose) => [...pose]));
    const motion = Motion.fromPoses(poses, 30, plain, "slide");
    expect(motion.name).toBe("slide");
    expect(motion.durationSeconds).toBeCloseTo(1, 6);
    expect(motion.poseAt(0.5)[0]).toBeCloseTo(15, 6);
    expect(motion.poseAt(0.25)[2]).toBeCloseTo(-7.5, 6);
    motion.dispose();
  });

  it("refuse parts of poses, poses that are none, and rates out of range", async () => {
    const pose = poseAt(0, 0, 0);
    const wrong = pose.slice();
    wrong[6] = 0.2;
    const make = (poses: Float64Array, rateHz: number) => () =>
      Motion.fromPoses(poses, rateHz, plain);
    await expectError("argument", make(pose.subarray(0, POSE_LENGTH - 1), 60));
    await expectError("argument", make([...pose] as unknown as Float64Array, 60));
    await expectError("pose", make(wrong, 60));
    await expectError("motion", make(pose, 0));
    await expectError("motion", make(new Float64Array(0), 60));
  });
});
