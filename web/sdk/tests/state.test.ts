import { type Avatar, type Model, Motion, restPose } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { expectError, loadModel } from "./support.js";

const TICK = 1 / 60;
let model: Model;
let motion: Motion;

beforeAll(async () => {
  model = await loadModel();
  const avatar = model.createAvatar();
  motion = Motion.procedural("run-in-place", avatar);
  avatar.dispose();
});
afterAll(() => {
  motion.dispose();
  model.dispose();
});

/** Steps through frames of uneven length; gives the bits of the last surface. */
function run(avatar: Avatar, first: number, count: number): Uint32Array {
  for (let frame = first; frame < first + count; frame += 1) {
    const stepSeconds = [0.004, TICK, 0.03][frame % 3] ?? TICK;
    avatar.step(motion.poseAt((frame / 60) % 8), stepSeconds);
  }
  const copy = avatar.positions.slice();
  return new Uint32Array(copy.buffer);
}

describe("a saved state", () => {
  it("goes on bit by bit, on another avatar too", () => {
    const saved = model.createAvatar({ shape: [0, 1, 0, 0, 0, 0, 0, 0, 0, 0] });
    saved.setControls("calm-clothes");
    run(saved, 0, 70);
    const state = saved.save();
    expect(state.length).toBeLessThan(400_000);
    const restored = model.createAvatar();
    run(restored, 30, 10);
    restored.restore(state);
    expect(restored.shape[1]).toBe(1);
    expect(restored.controls).toEqual(saved.controls);
    expect(run(restored, 70, 60)).toEqual(run(saved, 70, 60));
    saved.dispose();
    restored.dispose();
  });

  it("replays the same bits from the same inputs", () => {
    const [one, other] = [model.createAvatar(), model.createAvatar()];
    expect(run(one, 0, 120)).toEqual(run(other, 0, 120));
    one.dispose();
    other.dispose();
  });

  const spoilt: [string, string, (state: Uint8Array) => unknown][] = [
    ["cut", "state", (state) => state.slice(0, 1000)],
    ["empty", "state", () => new Uint8Array(0)],
    [
      "changed in one bit",
      "state",
      (state) => state.map((byte, at) => (at === 500 ? byte ^ 1 : byte)),
    ],
    ["not bytes", "argument", (state) => [...state]],
    ["missing", "argument", () => null],
  ];
  it.each(spoilt)("that is %s is refused, and the avatar runs on", async (_what, code, spoil) => {
    const [avatar, calm] = [model.createAvatar(), model.createAvatar()];
    run(avatar, 0, 60);
    run(calm, 0, 60);
    const state = avatar.save();
    await expectError(code, () => avatar.restore(spoil(state) as Uint8Array));
    expect(run(avatar, 60, 30)).toEqual(run(calm, 60, 30));
    avatar.dispose();
    calm.dispose();
  });

  it("of another model is refused", async () => {
    const other = await loadModel("male");
    const [avatar, stranger] = [model.createAvatar(), other.createAvatar()];
    avatar.step(restPose(), 0);
    const error = await expectError("state", () => stranger.restore(avatar.save()));
    expect(error.message).toContain("another model");
    avatar.dispose();
    await expectError("disposed", () => avatar.save());
    stranger.dispose();
    other.dispose();
  });
});

describe("memory", () => {
  it("does not grow over 100,000 steps", { timeout: 600_000 }, () => {
    const avatar = model.createAvatar();
    const poses = Array.from({ length: 480 }, (_, frame) => motion.poseAt(frame / 60));
    const step = (frame: number) => avatar.step(poses[frame % 480] ?? restPose(), 1 / 240);
    for (let frame = 0; frame < 1000; frame += 1) step(frame);
    const { byteLength } = avatar.positions.buffer;
    for (let frame = 0; frame < 100_000; frame += 1) step(frame);
    expect(avatar.positions.buffer.byteLength).toBe(byteLength);
    avatar.dispose();
  });
});
