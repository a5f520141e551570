// Many avatars: one call for all, level of detail, pauses off the screen, creation and disposal.
import { type Avatar, type Crowd, type Model, Motion, restPose } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { expectError, largestDifference, largestOffset, loadModel } from "./support.js";

const TICK = 1 / 60;
/** Of the second avatar of {@link crowdOf}. */
const SHAPE_1 = [0, -1, 0, 0, 0, 0, 0, 0, 0, 0];
let model: Model;
let motion: Motion;

beforeAll(async () => {
  model = await loadModel();
  const avatar = model.createAvatar();
  motion = Motion.procedural("hop", avatar);
  avatar.dispose();
});
afterAll(() => {
  motion.dispose();
  model.dispose();
});

/** A crowd of avatars of different shapes. */
function crowdOf(count: number): { crowd: Crowd; avatars: Avatar[] } {
  const crowd = model.createCrowd();
  const avatars = Array.from({ length: count }, (_, idx) =>
    model.createAvatar({ shape: [0, (idx % 5) - 2, 0, 0, 0, 0, 0, 0, 0, 0] }),
  );
  for (const avatar of avatars) crowd.add(avatar);
  return { crowd, avatars };
}

/** Poses of a frame, each in its own place of the motion. */
function poses(count: number, frame: number): Float64Array[] {
  return Array.from({ length: count }, (_, idx) => motion.poseAt((frame * TICK + 0.2 * idx) % 7));
}

function disposeAll(...things: { dispose(): void }[]): void {
  for (const thing of things) thing.dispose();
}

describe("stepAll", () => {
  it("shows what every avatar shows alone, to rounding", () => {
    const { crowd, avatars } = crowdOf(11);
    const { crowd: other, avatars: alone } = crowdOf(11);
    let [worst, moved] = [0, 0];
    for (let frame = 30; frame < 120; frame += 1) {
      const frames = poses(11, frame);
      crowd.stepAll(frames, TICK);
      for (const [idx, avatar] of alone.entries()) {
        avatar.step(frames[idx] ?? restPose(), TICK);
        const shown = avatars[idx]?.offsets ?? [];
        worst = Math.max(worst, largestDifference(avatar.offsets, shown));
        moved = Math.max(moved, largestOffset(avatar.offsets));
      }
    }
    console.log(`11 avatars: offsets to ${moved} m, at most ${worst} m off`);
    expect(moved).toBeGreaterThan(0.01);
    expect(worst).toBeLessThan(2e-6);
    disposeAll(crowd, other, ...avatars, ...alone);
  });

  it("replays the same bits from the same inputs", () => {
    const play = () => {
      const { crowd, avatars } = crowdOf(9);
      for (let frame = 0; frame < 60; frame += 1) crowd.stepAll(poses(9, frame), TICK);
      const bits = avatars.map((avatar) => new Uint32Array(avatar.positions.slice().buffer));
      disposeAll(crowd, ...avatars);
      return bits;
    };
    expect(play()).toEqual(play());
  });

  it("refuses what it cannot use, names the avatar, and all stay as they were", async () => {
    const { crowd, avatars } = crowdOf(3);
    const frames = poses(3, 40);
    crowd.stepAll(frames, TICK);
    const before = avatars.map((avatar) => avatar.positions.slice());
    const bad = poses(3, 41);
    bad[1]?.fill(Number.NaN);
    const error = await expectError("pose", () => crowd.stepAll(bad, TICK));
    expect(error.message).toContain("avatar 1");
    await expectError("argument", () => crowd.stepAll(frames.slice(1), TICK));
    await expectError("argument", () =>
      crowd.stepAll([...frames.slice(1), restPose().slice(1)], TICK),
    );
    await expectError("argument", () => crowd.stepAll(frames, -1));
    await expectError("argument", () => crowd.stepAll(null as never, TICK));
    await expectError("argument", () => crowd.add(avatars[0] as Avatar));
    await expectError("argument", () => crowd.add({} as Avatar));
    expect(avatars.map((avatar) => avatar.positions.slice())).toEqual(before);
    avatars[2]?.dispose();
    await expectError("disposed", () => crowd.stepAll(frames, TICK));
    expect(crowd.remove(avatars[2] as Avatar)).toBe(true);
    expect(crowd.remove(avatars[2] as Avatar)).toBe(false);
    crowd.stepAll(frames.slice(0, 2), TICK);
    disposeAll(crowd, crowd, ...avatars);
    await expectError("disposed", () => crowd.stepAll([], TICK));
  });

  it("refuses an avatar of another model", async () => {
    const other = await loadModel("male");
    const stranger = other.createAvatar();
    const crowd = model.createCrowd();
    crowd.add(stranger);
    const error = await expectError("argument", () => crowd.stepAll([restPose()], TICK));
    expect(error.message).toContain("another model");
    disposeAll(crowd, stranger, other);
  });
});

describe("odd orders of calls", () => {
  it("avatars may be taken out while somebody goes through them", () => {
    const { crowd, avatars } = crowdOf(6);
    const seen = crowd.avatars;
    for (const avatar of crowd.avatars) {
      crowd.remove(avatar);
      avatar.dispose();
    }
    expect(crowd.avatars).toEqual([]);
    expect(seen).toEqual(avatars);
    expect(() => (seen as Avatar[]).pop()).toThrow(TypeError);
    crowd.stepAll([], TICK);
    disposeAll(crowd);
    expect(crowd.avatars).toEqual([]);
  });

  it("an avatar in two crowds, and stepped alone, is one avatar", () => {
    const { crowd, avatars } = crowdOf(2);
    const other = model.createCrowd();
    const [shared, twin] = [avatars[1] as Avatar, model.createAvatar({ shape: SHAPE_1 })];
    other.add(shared);
    for (let frame = 40; frame < 100; frame += 3) {
      const now = (ahead: number) => motion.poseAt((frame + ahead) * TICK);
      crowd.stepAll([restPose(), now(0)], TICK);
      other.stepAll([now(1)], TICK);
      shared.step(now(2), TICK);
      for (const ahead of [0, 1, 2]) twin.step(now(ahead), TICK);
    }
    expect(largestOffset(twin.offsets)).toBeGreaterThan(1e-3);
    expect(largestDifference(shared.offsets, twin.offsets)).toBeLessThan(2e-6);
    crowd.dispose();
    other.stepAll([motion.poseAt(2)], TICK);
    disposeAll(other, twin, ...avatars);
  });

  it("a crowd outlives its model, and memory that grew under it", () => {
    const own = model.createCrowd();
    const avatars = Array.from({ length: 3 }, () => model.createAvatar());
    for (const avatar of avatars) own.add(avatar);
    const frames = poses(3, 50);
    own.stepAll(frames, TICK);
    const { buffer } = (avatars[0] as Avatar).positions;
    const filler: Avatar[] = [];
    while ((avatars[0] as Avatar).positions.buffer === buffer && filler.length < 500) {
      filler.push(model.createAvatar({ shape: [0, filler.length / 200, 0, 0, 0, 0, 0, 0, 0, 0] }));
    }
    expect((avatars[0] as Avatar).positions.buffer).not.toBe(buffer);
    for (const avatar of avatars) avatar.reset();
    own.stepAll(frames, TICK);
    const alone = model.createAvatar();
    alone.step(frames[1] as Float64Array, TICK);
    expect(largestDifference(avatars[1]?.positions ?? [], alone.positions)).toBeLessThan(2e-6);
    disposeAll(own, alone, ...avatars, ...filler);
  });
});

describe("level of detail", () => {
  it("follows the distance", () => {
    const { crowd, avatars } = crowdOf(4);
    crowd.levelOfDetail = { halfBeyondM: 5, asleepBeyondM: 20 };
    for (const [idx, avatar] of avatars.entries()) avatar.distanceM = [1, 6, 30, 1][idx] ?? 0;
    (avatars[3] as Avatar).visible = false;
    for (let frame = 0; frame < 40; frame += 1) crowd.stepAll(poses(4, frame), TICK);
    expect(avatars.map((avatar) => avatar.detail)).toEqual(["full", "half", "asleep", "full"]);
    const { full, half, asleep } = crowd.report;
    expect([full, half, asleep]).toEqual([1, 1, 2]);
    const sizes = avatars.map((avatar) => largestOffset(avatar.offsets) > 0);
    expect(sizes).toEqual([true, true, false, false]);
    crowd.levelOfDetail = null;
    (avatars[2] as Avatar).detail = "full";
    crowd.stepAll(poses(4, 41), TICK);
    expect(avatars[2]?.detail).toBe("full");
    disposeAll(crowd, ...avatars);
  });

  it("lets one distance move the other's default", () => {
    const crowd = model.createCrowd();
    crowd.levelOfDetail = { halfBeyondM: 60 };
    expect(crowd.levelOfDetail).toEqual({ halfBeyondM: 60, asleepBeyondM: 60 });
    crowd.levelOfDetail = { asleepBeyondM: 5 };
    expect(crowd.levelOfDetail).toEqual({ halfBeyondM: 5, asleepBeyondM: 5 });
    crowd.levelOfDetail = {};
    expect(crowd.levelOfDetail).toEqual({ halfBeyondM: 12, asleepBeyondM: 40 });
    crowd.dispose();
  });

  it("refuses what contradicts itself", async () => {
    const { crowd, avatars } = crowdOf(1);
    const set = (levelOfDetail: object) => () => {
      crowd.levelOfDetail = levelOfDetail;
    };
    await expectError("argument", set({ halfBeyondM: -1 }));
    await expectError("argument", set({ halfBeyondM: 30, asleepBeyondM: 20 }));
    await expectError("argument", set({ halfBeyondM: "near" }));
    for (const budgetMs of [0, -1, Number.NaN, Number.POSITIVE_INFINITY, 5n]) {
      await expectError("argument", set({ budgetMs }));
    }
    expect(crowd.levelOfDetail).toBeNull();
    const [avatar] = avatars as [Avatar];
    await expectError("argument", () => {
      avatar.distanceM = -2;
    });
    await expectError("argument", () => {
      avatar.detail = "quarter" as "half";
    });
    expect([avatar.distanceM, avatar.detail]).toEqual([0, "full"]);
    disposeAll(crowd, avatar);
  });

  it("pauses off the screen, and comes back settled", () => {
    const avatar = model.createAvatar();
    for (let frame = 0; frame < 75; frame += 1) avatar.step(motion.poseAt(frame * TICK), TICK);
    const before = avatar.positions.slice();
    avatar.visible = false;
    for (let frame = 75; frame < 200; frame += 1) {
      avatar.step(motion.poseAt(frame * TICK), TICK);
      expect(avatar.timings.ticks).toBe(0);
    }
    expect(avatar.positions.slice()).toEqual(before);
    avatar.visible = true;
    avatar.step(motion.poseAt(201 * TICK), TICK);
    expect(avatar.timings.settledBecause).toBe("woken");
    const fresh = model.createAvatar();
    fresh.step(motion.poseAt(201 * TICK), 0);
    expect(largestDifference(avatar.offsets, fresh.offsets)).toBeLessThan(1e-6);
    disposeAll(avatar, fresh);
  });
});

describe("lifetime", () => {
  it("10,000 avatars made and disposed leave memory flat", { timeout: 600_000 }, () => {
    const pose = restPose();
    const cycle = (idx: number) => {
      const avatar = model.createAvatar({ shape: [0, (idx % 3) - 1, 0, 0, 0, 0, 0, 0, 0, 0] });
      const crowd = model.createCrowd();
      crowd.add(avatar);
      if (idx % 100 === 0) crowd.stepAll([pose], TICK);
      if (idx % 100 === 50) avatar.step(pose, TICK);
      disposeAll(crowd, avatar);
    };
    const keeper = model.createAvatar();
    for (let idx = 0; idx < 300; idx += 1) cycle(idx);
    const { byteLength } = keeper.positions.buffer;
    const start = performance.now();
    for (let idx = 0; idx < 10_000; idx += 1) cycle(idx);
    const each = (performance.now() - start) / 10_000;
    console.log(`${(byteLength / 1e6).toFixed(1)} MB throughout; ${each.toFixed(2)} ms a cycle`);
    expect(keeper.positions.buffer.byteLength).toBe(byteLength);
    keeper.dispose();
  });
});
