// After a trap the core's memory may be anything: nothing made from it goes on, all of it says so, and
// load() starts a new core.
import { type Avatar, Motion, Puppet, restPose } from "dynaskin";
import { describe, expect, it } from "vitest";
import { startCore } from "../dist/core.js";
import { expectError, largestOffset, loadModel } from "./support.js";

const TICK = 1 / 60;

/** Lets the core run out of memory, as a page with many bodies on a small phone does. */
async function exhaust(avatar: Avatar): Promise<void> {
  const { memory } = await startCore(undefined);
  const MOST_PAGES = 65_536;
  memory.grow(MOST_PAGES - memory.buffer.byteLength / 2 ** 16);
  const poses = new Float64Array(99 * 100_000);
  const rest = restPose();
  for (let start = 0; start < poses.length; start += 99) poses.set(rest, start);
  const error = await expectError("crashed", () => Motion.fromPoses(poses, 60, avatar));
  expect(error.message).toContain("Load the model again");
  expect(error.cause).toBeInstanceOf(WebAssembly.RuntimeError);
}

describe("a core that ran out of memory", () => {
  it("leaves no object that says something else than crashed, and a load that works", async () => {
    const model = await loadModel();
    expect(model.restartedAfter).toBe(null);
    const avatar = model.createAvatar();
    const other = model.createAvatar();
    const motion = Motion.procedural("hop", avatar);
    const puppet = new Puppet(avatar);
    const crowd = model.createCrowd();
    crowd.add(other);
    await exhaust(avatar);
    const calls: Record<string, () => unknown> = {
      "avatar.step": () => avatar.step(restPose(), TICK),
      "avatar.positions": () => avatar.positions,
      "avatar.shape": () => avatar.shape,
      "avatar.strength": () => {
        avatar.strength = 2;
      },
      "avatar.save": () => avatar.save(),
      "avatar.timings": () => avatar.timings,
      "other.step": () => other.step(restPose(), TICK),
      "crowd.stepAll": () => crowd.stepAll([restPose()], TICK),
      "crowd.add": () => crowd.add(avatar),
      "motion.poseAt": () => motion.poseAt(0),
      "Motion.procedural": () => Motion.procedural("hop", avatar),
      "puppet.step": () => puppet.step(TICK),
      "new Puppet": () => new Puppet(avatar),
      "model.createAvatar": () => model.createAvatar(),
      "model.createCrowd": () => model.createCrowd(),
      "body.createAvatar": () => model.body.createAvatar(),
      "body.regionWeights": () => model.body.regionWeights("belly"),
    };
    const expectCrashed = async () => {
      for (const call of Object.values(calls)) await expectError("crashed", call);
    };
    await expectCrashed();

    // Two at once: both get the same new core.
    const [fresh, second] = await Promise.all([loadModel(), loadModel()]);
    expect(fresh.restartedAfter?.code).toBe("crashed");
    expect(second.restartedAfter?.code).toBe("crashed");
    const moved = fresh.createAvatar();
    const crowdNow = second.createCrowd();
    crowdNow.add(second.createAvatar());
    crowdNow.stepAll([restPose()], TICK);
    await expectError("crashed", () => crowdNow.add(other));
    const hop = Motion.procedural("hop", moved);
    let largest = 0;
    for (let tick = 0; tick < 60; tick += 1) {
      moved.step(hop.poseAt(tick / 60), TICK);
      largest = Math.max(largest, largestOffset(moved.offsets));
    }
    expect(largest).toBeGreaterThan(1e-3);

    // What was there before still says what it is, and can be put away.
    await expectCrashed();
    for (const gone of [motion, puppet, crowd, other, avatar, model]) gone.dispose();
    await expectError("disposed", () => avatar.positions);
    moved.step(hop.poseAt(1), TICK);
    for (const made of [hop, moved, crowdNow, fresh, second]) made.dispose();
  });
});
