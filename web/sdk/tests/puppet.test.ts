import { type Avatar, GRIPS, type Grip, type Model, POSE_LENGTH, Puppet } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { expectError, largestOffset, loadModel } from "./support.js";

let model: Model;
let avatar: Avatar;

beforeAll(async () => {
  model = await loadModel();
  avatar = model.createAvatar();
});
afterAll(() => {
  avatar.dispose();
  model.dispose();
});

/** Moves on by some seconds at 60 Hz. */
function pass(puppet: Puppet, seconds: number): Float64Array {
  const pose = new Float64Array(POSE_LENGTH);
  for (let tick = 0; tick < 60 * seconds; tick += 1) puppet.step(1 / 60, pose);
  return pose;
}

describe("a puppet", () => {
  it.each(GRIPS)("follows the hand that holds its %s, and comes back", (grip) => {
    const puppet = new Puppet(avatar);
    const start = puppet.placeOf(grip);
    expect(puppet.held).toBeNull();
    puppet.hold(grip, [0.1, 0, 0]);
    expect(puppet.held).toBe(grip);
    pass(puppet, 2);
    expect(puppet.placeOf(grip)[0] - start[0]).toBeGreaterThan(0.06);
    puppet.release();
    expect(puppet.held).toBeNull();
    pass(puppet, 5);
    puppet.placeOf(grip).forEach((value, axis) => {
      expect(value).toBeCloseTo(start[axis] ?? Number.NaN, 3);
    });
    puppet.dispose();
  });

  it("moves the tissue of its avatar without a cut", () => {
    const puppet = new Puppet(avatar);
    const pose = puppet.step(0);
    avatar.reset();
    for (let tick = 0; tick < 60; tick += 1) avatar.step(puppet.step(1 / 60, pose), 1 / 60);
    const still = largestOffset(avatar.offsets);
    puppet.hold("pelvis", [0, -0.5, 0]);
    let largest = 0;
    for (let tick = 0; tick < 90; tick += 1) {
      if (tick === 30) puppet.release();
      avatar.step(puppet.step(1 / 60, pose), 1 / 60);
      expect(avatar.timings.settled).toBe(false);
      largest = Math.max(largest, largestOffset(avatar.offsets));
    }
    expect(largest - still).toBeGreaterThan(0.01);
    puppet.dispose();
  });

  it("knows the parts that the core knows", async () => {
    const puppet = new Puppet(avatar);
    for (const grip of GRIPS) expect(puppet.placeOf(grip)).toHaveLength(3);
    const foot = "foot" as Grip;
    await expectError("argument", () => puppet.hold(foot, [0, 0, 0]));
    await expectError("argument", () => puppet.placeOf(foot));
    puppet.dispose();
  });

  it("refuses what it cannot use, and use after dispose", async () => {
    await expectError("argument", () => new Puppet(null as unknown as Avatar));
    const puppet = new Puppet(avatar);
    await expectError("argument", () => puppet.hold("chest", [0, 0]));
    await expectError("argument", () => puppet.hold("chest", null as unknown as number[]));
    await expectError("motion", () => puppet.hold("chest", [0, Number.NaN, 0]));
    await expectError("argument", () => puppet.step(Number.NaN));
    await expectError("argument", () => puppet.step("1" as unknown as number));
    await expectError("argument", () => puppet.step(0.1, new Float64Array(98)));
    const single = new Float32Array(POSE_LENGTH) as unknown as Float64Array;
    await expectError("argument", () => puppet.step(0.1, single));
    puppet.dispose();
    puppet.dispose();
    for (const use of [
      () => puppet.hold("chest", [0, 0, 0]),
      () => puppet.release(),
      () => puppet.step(0.1),
      () => puppet.placeOf("chest"),
      () => puppet.held,
    ]) {
      await expectError("disposed", use);
    }
  });
});
