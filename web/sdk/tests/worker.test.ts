// The worker's own script in a thread of Node; tests/browser/entries.spec.ts has it in a browser.
import { type Avatar, type Model, Motion, restPose } from "dynaskin";
import { createWorkerAvatar, type WorkerAvatar } from "dynaskin/worker";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, it } from "vitest";
import { createThreadAvatar, nodeWorker } from "./node-worker.js";
import {
  expectError,
  largestDifference,
  largestOffset,
  loadModel,
  modelFolder,
  poseAt,
} from "./support.js";

const TICK = 1 / 60;
const SHAPE = [0.5, 1.5, 0, 0, 0, 0, 0, 0, 0, 0];

let model: Model;
let here: Avatar;
let there: WorkerAvatar;
let motion: Motion;

beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => model.dispose());
beforeEach(async () => {
  here = model.createAvatar({ shape: SHAPE });
  there = await createThreadAvatar(SHAPE);
  motion = Motion.procedural("hop", here);
});
afterEach(() => {
  there.dispose();
  here.dispose();
  motion.dispose();
});

/** Steps both through the hop, each pose answered; gives the largest offset, in metres. */
async function hop(seconds: number, fromSeconds = 0): Promise<number> {
  let largest = 0;
  for (let time = fromSeconds; time < fromSeconds + seconds; time += TICK) {
    const pose = motion.poseAt(time);
    here.step(pose, TICK);
    there.step(pose, TICK);
    await there.whenAnswered();
    largest = Math.max(largest, largestOffset(there.offsets));
  }
  return largest;
}

function expectSame(): void {
  for (const array of ["offsets", "positions", "normals", "skinMatrices"] as const) {
    expect(largestDifference(there[array], here[array]), array).toBe(0);
  }
}

describe("an avatar in a worker", () => {
  it("gives the bits of one in the page, with the same settings", async () => {
    for (const avatar of [here, there]) {
      avatar.setControls("calm-clothes");
      avatar.setControls({ rootInertia: 0.5, regions: { thighs: { stiffness: 2, limitCm: 3 } } });
      avatar.setRegionGain("belly", 1.5);
      avatar.strength = 1.2;
    }
    expect(await hop(1.6)).toBeGreaterThan(1e-3);
    expectSame();
    expect(there.controls).toEqual(here.controls);
    expect(there.timings).toMatchObject({ ticks: 1, settledBecause: null });
  });

  it("follows changes of shape, size, dynamics and a reset in mid-motion", async () => {
    await hop(0.5);
    for (const avatar of [here, there]) {
      avatar.setShape([-1, 0.5, 1, 0, 0, 0, 0, 0, 0, 0]);
      avatar.scale = 2;
    }
    expect([there.scale, there.pending]).toEqual([2, true]);
    await hop(0.5, 0.5);
    expectSame();
    expect(there.shape).toEqual(here.shape);
    for (const avatar of [here, there]) avatar.reset();
    await hop(0.1, 1);
    expectSame();
    for (const avatar of [here, there]) avatar.dynamics = false;
    expect(await hop(0.1, 1.1)).toBe(0);
    expect(there.dynamics).toBe(false);
  });

  it("saves and restores, also what an avatar in the page saved", async () => {
    await hop(0.6);
    there.step(motion.poseAt(0.6), TICK);
    there.step(motion.poseAt(0.6 + TICK), TICK); // waits for the one before
    const state = await there.save();
    await there.whenAnswered();
    here.restore(state);
    expectSame();
    await hop(0.5, 0.6 + 2 * TICK);
    expectSame();
    await there.restore(state);
    here.restore(state);
    await hop(0.3, 0.6 + 2 * TICK);
    expectSame();
    await there.restore(here.save());
    expectSame();
  });

  it("gets less detail, sleeps and is out of sight by hand", async () => {
    for (const avatar of [here, there]) avatar.detail = "half";
    expect(there.detail).toBe("half");
    await hop(0.5);
    expectSame();
    for (const avatar of [here, there]) avatar.detail = "asleep";
    await hop(0.4, 0.5);
    expect(largestOffset(there.offsets)).toBe(0);
    expect(there.timings?.ticks).toBe(0);
    for (const avatar of [here, there]) avatar.detail = "full";
    await hop(0.3, 0.9);
    expectSame();
    for (const avatar of [here, there]) avatar.visible = false;
    await hop(0.1, 1.2);
    expect([there.visible, there.timings?.ticks]).toEqual([false, 0]);
    for (const avatar of [here, there]) avatar.visible = true;
    here.step(motion.poseAt(1.3), TICK);
    there.step(motion.poseAt(1.3), TICK);
    await there.whenAnswered();
    expect(there.timings?.settledBecause).toBe("woken");
    expectSame();
    expect(there.distanceM).toBe(0);
    there.distanceM = 7;
    expect([there.distanceM, there.pending]).toEqual([7, false]);
  });

  it("refuses at once what it need not ask the worker about", async () => {
    await hop(0.3);
    const odd = (change: object) => () => void Object.assign(there, change);
    there.step(motion.poseAt(0.3), TICK);
    there.step(motion.poseAt(0.3 + TICK), TICK); // waits for the one before
    for (const call of [
      odd({ scale: 0 }),
      odd({ scale: Number.NaN }),
      odd({ scale: "2" }),
      odd({ detail: "quarter" }),
      odd({ distanceM: -1 }),
      odd({ distanceM: "far" }),
      () => there.setControls(null as never),
      () => there.setControls({ regions: { belly: null as never } }),
      () => there.setControls({ strength: (() => 1) as never }),
      () => there.step(restPose(), Number.NaN),
      () => there.step(restPose(), -TICK),
      () => there.step(restPose(), Date.now()),
      () => there.step(restPose(), "0.016" as never),
    ]) {
      await expectError("argument", call);
    }
    expect([there.scale, there.detail, there.distanceM]).toEqual([1, "full", 0]);
    await there.whenAnswered();
    here.step(motion.poseAt(0.3), TICK);
    here.step(motion.poseAt(0.3 + TICK), TICK);
    expectSame();
  });

  it("takes back what the worker refuses, and goes on", async () => {
    await hop(0.3);
    there.setControls({ regions: { belly: { stiffness: -1 } } });
    expect(there.controls.regions.belly.stiffness).toBe(-1);
    await expectError("argument", () => there.whenAnswered());
    expect(there.controls).toEqual(here.controls);
    there.strength = 9;
    while (there.pending) await new Promise((done) => setTimeout(done));
    expect(there.strength).toBe(1);
    await expectError("argument", () => there.step(restPose(), TICK));
    there.step(restPose().fill(Number.NaN), TICK);
    await expectError("pose", () => there.whenAnswered());
    await expectError("argument", () => there.setRegionGain("nose" as "belly", 1));
    await expectError("argument", () => there.setShape([1]));
    await expectError("state", () => there.restore(new Uint8Array(9)));
    await expectError("argument", () => there.restore("state" as never));
    await hop(0.3, 0.3);
    expectSame();
  });

  it("is one answer behind, never more, and shows only the newest pose", async () => {
    const shownX = () => there.skinMatrices[12];
    there.step(poseAt(1, 0, 0), TICK);
    await there.whenAnswered();
    expect(shownX()).toBeCloseTo(1, 6);
    for (const x of [1.01, 1.02, 1.03, 1.04]) {
      there.step(poseAt(x, 0, 0), TICK);
      expect(shownX()).toBeCloseTo(1, 6);
    }
    // The first was sent at once; of the others the newest waited.
    const seen: (number | undefined)[] = [];
    while (there.pending) {
      await new Promise((done) => setTimeout(done));
      if (shownX() !== seen.at(-1)) seen.push(shownX());
    }
    expect(seen.at(-1)).toBeCloseTo(1.04, 6);
    expect(seen.length).toBeLessThanOrEqual(3);
    expect(there.timings?.ticks).toBe(3);
  });

  it("tells who waits that it was disposed of", async () => {
    there.step(restPose(), TICK);
    const waiting = [there.whenAnswered(), there.save(), there.restore(here.save())];
    there.dispose();
    for (const promise of waiting) await expectError("disposed", () => promise);
    for (const use of [
      () => there.offsets,
      () => there.distanceM,
      () => there.reset(),
      () => there.save(),
      () => there.whenAnswered(),
    ]) {
      await expectError("disposed", use);
    }
  });

  it("says that the worker has stopped, at every step", async () => {
    let stop = () => {};
    const doomed = await createWorkerAvatar({
      model: modelFolder(),
      createWorker: () => {
        const worker = nodeWorker();
        stop = () => worker.onerror?.({ message: "out of memory" } as ErrorEvent);
        return worker;
      },
    });
    const waiting = doomed.save();
    stop();
    await expectError("worker", () => waiting);
    for (const use of [() => doomed.step(restPose(), TICK), () => doomed.whenAnswered()]) {
      const error = await expectError("worker", use);
      expect(error.message).toContain("out of memory");
    }
    doomed.dispose();
  });

  it("refuses to start with what cannot work, and starts no worker for it", async () => {
    let started = 0;
    const createWorker = () => {
      started += 1;
      return nodeWorker();
    };
    const model = modelFolder();
    for (const options of [
      undefined,
      {},
      { model: { bundle: new Uint8Array(1) } },
      { model: "models/female/" },
      { model, shape: [1] },
      { model, shape: null },
      { model, signal: "stop" },
      { model, onProgress: 1 },
      { model, createWorker: "thread.js" },
    ]) {
      await expectError("argument", () =>
        createWorkerAvatar((options && { createWorker, ...options }) as never),
      );
    }
    const stopped = AbortSignal.abort(new Error("left the page"));
    await expect(createWorkerAvatar({ model, createWorker, signal: stopped })).rejects.toThrow(
      "left the page",
    );
    expect(started).toBe(0);
  });

  it("reports the bytes of its model as they arrive", async () => {
    const seen: number[] = [];
    const avatar = await createWorkerAvatar({
      model: modelFolder(),
      createWorker: nodeWorker,
      onProgress: ({ loadedBytes }) => seen.push(loadedBytes),
    });
    expect(seen.at(-1)).toBeGreaterThan(1e6);
    avatar.dispose();
  });
});
