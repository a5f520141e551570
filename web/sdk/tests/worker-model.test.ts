// A worker that holds a model: avatars and crowds of it, and what becomes of them when it falls silent.
import { type Avatar, type Crowd, type Model, Motion, restPose } from "dynaskin";
import {
  createWorkerAvatar,
  createWorkerModel,
  type WorkerAvatar,
  type WorkerCrowd,
  type WorkerModel,
} from "dynaskin/worker";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, it } from "vitest";
import { nodeWorker } from "./node-worker.js";
import {
  expectError,
  largestDifference,
  largestOffset,
  loadModel,
  modelFolder,
  poseAt,
} from "./support.js";

const TICK = 1 / 60;
const SHAPES = [
  [0.5, 1.5, 0, 0, 0, 0, 0, 0, 0, 0],
  [-1, 0.5, 1, 0, 0, 0, 0, 0, 0, 0],
];

let model: Model;
let remote: WorkerModel;
beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => model.dispose());
beforeEach(async () => {
  remote = await createWorkerModel({ model: modelFolder(), createWorker: nodeWorker });
});
afterEach(() => remote.dispose());

async function pairs(): Promise<{ here: Avatar[]; there: WorkerAvatar[] }> {
  const here = SHAPES.map((shape) => model.createAvatar({ shape }));
  const there = await Promise.all(SHAPES.map((shape) => remote.createAvatar({ shape })));
  return { here, there };
}

function expectSame(here: Avatar[], there: WorkerAvatar[]): void {
  for (const [idx, avatar] of here.entries()) {
    for (const array of ["offsets", "positions", "normals", "skinMatrices"] as const) {
      expect(largestDifference(there[idx]?.[array] ?? [], avatar[array]), array).toBe(0);
    }
  }
}

describe("a model in a worker", () => {
  it("makes avatars that move apart from each other", async () => {
    const { here, there } = await pairs();
    expect(remote.name).toBe("female");
    expect(remote.bundle).toEqual(model.bundle);
    const [one, other] = there as [WorkerAvatar, WorkerAvatar];
    const motion = Motion.procedural("hop", here[0] as Avatar);
    for (const avatar of [here[1] as Avatar, other]) avatar.setControls("calm-clothes");
    for (let tick = 0; tick < 90; tick += 1) {
      for (const avatar of [...here, ...there]) avatar.step(motion.poseAt(tick / 60), TICK);
      await Promise.all(there.map((avatar) => avatar.whenAnswered()));
    }
    expectSame(here, there);
    expect(largestOffset(one.offsets)).toBeGreaterThan(1e-3);
    one.dispose();
    await expectError("disposed", () => one.offsets);
    other.step(restPose(), TICK);
    await other.whenAnswered();
    const third = await remote.createAvatar();
    expect(third.positions.length).toBe(other.positions.length);
    for (const avatar of [...here, motion]) avatar.dispose();
  });

  it("conditions held poses as the page does, by the avatar's option and by its property", async () => {
    const here = SHAPES.map((shape) => model.createAvatar({ shape, poseSource: "network" }));
    const [one, other] = [
      await remote.createAvatar({ shape: SHAPES[0] as number[], poseSource: "network" }),
      await remote.createAvatar({ shape: SHAPES[1] as number[] }),
    ];
    other.poseSource = "network";
    const plain = model.createAvatar({ shape: SHAPES[0] as number[], poseSource: "as-given" });
    const motion = Motion.procedural("hop", here[0] as Avatar);
    for (let tick = 0; tick < 90; tick += 1) {
      // 30 poses a second, each held over two frames.
      const pose = motion.poseAt(Math.floor(tick / 2) / 30);
      for (const avatar of [...here, plain, one, other]) avatar.step(pose, TICK);
      await Promise.all([one, other].map((avatar) => avatar.whenAnswered()));
    }
    expectSame(here, [one, other]);
    expect(largestDifference(one.offsets, plain.offsets)).toBeGreaterThan(1e-3);
    for (const avatar of [...here, plain, motion]) avatar.dispose();
  });

  it("steps two avatars as a crowd, with the bits of a crowd in the page", async () => {
    const { here, there } = await pairs();
    const [crowdHere, crowdThere] = [model.createCrowd(), await remote.createCrowd()];
    expect(crowdThere.report).toBe(null);
    for (const avatar of here) crowdHere.add(avatar);
    for (const avatar of there) crowdThere.add(avatar);
    expect(crowdThere.avatars).toEqual(there);
    const motion = Motion.procedural("hop", here[0] as Avatar);
    const step = async (tick: number, crowds = [crowdHere, crowdThere]) => {
      const poses = here.map((_, idx) => motion.poseAt(tick / 60 + idx / 4));
      for (const crowd of crowds) crowd.stepAll(poses, TICK);
      await crowdThere.whenAnswered();
    };
    let largest = 0;
    for (let tick = 0; tick < 60; tick += 1) {
      await step(tick);
      largest = Math.max(largest, ...there.map(({ offsets }) => largestOffset(offsets)));
    }
    expect(largest).toBeGreaterThan(1e-3);
    expectSame(here, there);
    for (const [last, crowd] of [
      [here[1], crowdHere],
      [there[1], crowdThere],
    ] as [Avatar, Crowd][]) {
      crowd.levelOfDetail = { halfBeyondM: 5 };
      last.distanceM = 60;
    }
    expect(there[1]?.distanceM).toBe(60);
    for (let tick = 60; tick < 90; tick += 1) await step(tick);
    expectSame(here, there);
    expect(there.map(({ detail }) => detail)).toEqual(["full", "asleep"]);
    expect(crowdThere.levelOfDetail).toEqual(crowdHere.levelOfDetail);
    expect(crowdThere.report).toMatchObject({ full: 1, half: 0, asleep: 1 });
    crowdThere.levelOfDetail = null;
    (there[1] as WorkerAvatar).detail = "full";
    await crowdThere.whenAnswered();
    expect([crowdThere.levelOfDetail, there[1]?.detail]).toEqual([null, "full"]);
    crowdThere.dispose();
    await expectError("disposed", () => crowdThere.stepAll([], TICK));
    there[0]?.step(restPose(), TICK);
    await there[0]?.whenAnswered();
    for (const made of [...here, motion, crowdHere]) made.dispose();
  });

  it("sends poses that wait before what must come after them", async () => {
    const crowd = await remote.createCrowd();
    const [one, other] = (await pairs()).there as [WorkerAvatar, WorkerAvatar];
    const shownX = (avatar: WorkerAvatar) => avatar.skinMatrices[12];
    crowd.add(one);
    crowd.stepAll([poseAt(1, 0, 0)], TICK);
    crowd.stepAll([poseAt(1.01, 0, 0)], TICK); // waits
    crowd.add(other);
    crowd.stepAll([poseAt(1.02, 0, 0), poseAt(5, 0, 0)], TICK); // waits
    other.scale = 2;
    crowd.stepAll([poseAt(1.03, 0, 0), poseAt(7, 0, 0)], TICK);
    expect(crowd.remove(one)).toBe(true);
    expect(crowd.remove(one)).toBe(false);
    crowd.stepAll([poseAt(8, 0, 0)], TICK);
    await crowd.whenAnswered();
    expect(shownX(one)).toBeCloseTo(1.03, 6);
    expect(shownX(other)).toBeCloseTo(8, 6);
    crowd.stepAll([poseAt(9, 0, 0)], TICK);
    crowd.stepAll([poseAt(10, 0, 0)], TICK); // waits
    const state = await other.save();
    await other.restore(state);
    expect(shownX(other)).toBeCloseTo(10, 6);
  });

  it("refuses in a crowd what a crowd of the page refuses", async () => {
    const crowd = await remote.createCrowd();
    const [one, other] = (await pairs()).there as [WorkerAvatar, WorkerAvatar];
    const foreign = await createWorkerAvatar({ model: modelFolder(), createWorker: nodeWorker });
    const here = model.createAvatar();
    crowd.add(one);
    crowd.add(other);
    for (const call of [
      () => crowd.add(one),
      () => crowd.add(foreign),
      () => crowd.add(here as never),
      () => crowd.stepAll([restPose()], TICK),
      () => crowd.stepAll(restPose() as never, TICK),
      () => crowd.stepAll([restPose(), restPose().slice(1)], TICK),
      () => crowd.stepAll([restPose(), restPose()], -1),
    ]) {
      await expectError("argument", call);
    }
    const poses = [restPose(), restPose()];
    crowd.levelOfDetail = { halfBeyondM: 9, asleepBeyondM: 1 };
    await expectError("argument", () => crowd.whenAnswered());
    expect(crowd.levelOfDetail).toBe(null);
    one.strength = 9;
    while (one.pending) await new Promise((done) => setTimeout(done));
    await expectError("argument", () => crowd.stepAll(poses, TICK));
    crowd.stepAll([restPose(), restPose().fill(Number.NaN)], TICK);
    await expectError("pose", () => crowd.whenAnswered());
    crowd.stepAll(poses, TICK);
    await crowd.whenAnswered();
    other.dispose();
    await expectError("disposed", () => crowd.stepAll(poses, TICK));
    crowd.remove(other);
    crowd.stepAll([restPose()], TICK);
    await crowd.whenAnswered();
    foreign.dispose();
    here.dispose();
  });

  it("ends with all that was made from it", async () => {
    const crowd = await remote.createCrowd();
    const avatar = await remote.createAvatar();
    const waiting = [avatar.save(), remote.createAvatar(), remote.createCrowd()];
    remote.dispose();
    remote.dispose();
    for (const promise of waiting) await expectError("disposed", () => promise);
    for (const use of [
      () => avatar.positions,
      () => avatar.step(restPose(), TICK),
      () => crowd.stepAll([], TICK),
      () => remote.createAvatar(),
      () => remote.createCrowd(),
    ]) {
      await expectError("disposed", use);
    }
    await expectError("argument", () => remote.createAvatar({ shape: [1] }));
  });
});

/** A worker that nobody is in; `answer` may say something in its name. */
function emptyWorker() {
  const seen = { ended: 0, asked: [] as { id: number; call: string }[] };
  const worker = {
    onmessage: null as ((event: { data: unknown }) => void) | null,
    postMessage: (request: { id: number; call: string }) => void seen.asked.push(request),
    terminate: () => {
      seen.ended += 1;
    },
  };
  const answer = (data: object) => worker.onmessage?.({ data });
  return { seen, answer, createWorker: () => worker as unknown as Worker };
}

const pause = (ms: number) => new Promise((done) => setTimeout(done, ms));

describe("a worker that does not answer", () => {
  it("is an error after the time that was given, and is ended", async () => {
    const { seen, createWorker } = emptyWorker();
    const started = performance.now();
    for (const create of [createWorkerModel, createWorkerAvatar]) {
      const options = { model: modelFolder(), createWorker, timeoutMs: 200 };
      const { message } = await expectError("worker", () => create(options));
      expect(message).toContain("200 ms");
    }
    const seconds = (performance.now() - started) / 1000;
    expect(seconds).toBeGreaterThan(0.4);
    expect(seconds).toBeLessThan(3);
    expect(seen.ended).toBeGreaterThanOrEqual(2);
  });

  it("may take its time as long as it says that it is alive", async () => {
    const { seen, answer, createWorker } = emptyWorker();
    const loading = createWorkerModel({ model: modelFolder(), createWorker, timeoutMs: 200 });
    for (let turn = 0; turn < 10; turn += 1) {
      await pause(60);
      answer({ type: "alive" });
    }
    answer({ type: "answer", id: seen.asked[0]?.id, back: { name: "slow" } });
    const slow = await loading;
    expect(slow.name).toBe("slow");
    // Silence while nothing is due is no fault.
    await pause(400);
    const making = slow.createCrowd();
    answer({ type: "answer", id: seen.asked.at(-1)?.id, back: { settings: {} } });
    const crowd: WorkerCrowd = await making;
    expect(crowd.levelOfDetail).toBe(null);
    slow.dispose();
  });

  it("rejects all that waits when it was terminated meanwhile", async () => {
    let thread = nodeWorker();
    const lost = await createWorkerModel({
      model: modelFolder(),
      createWorker: () => {
        thread = nodeWorker();
        return thread;
      },
      timeoutMs: 1500,
    });
    const avatar = await lost.createAvatar();
    avatar.step(restPose(), TICK);
    thread.terminate();
    avatar.step(restPose(), TICK);
    const waiting = [avatar.whenAnswered(), avatar.save(), lost.createAvatar()];
    for (const promise of waiting) {
      const { message } = await expectError("worker", () => promise);
      expect(message).toContain("1500 ms");
    }
    for (const use of [
      () => avatar.step(restPose(), TICK),
      () => avatar.setControls("calm-clothes"),
      () => avatar.save(),
      () => lost.createCrowd(),
    ]) {
      await expectError("worker", use);
    }
    lost.dispose();
    await expectError("disposed", () => avatar.step(restPose(), TICK));
  });

  it("is not blamed for a page that stands still", async () => {
    const patient = await createWorkerAvatar({
      model: modelFolder(),
      createWorker: nodeWorker,
      timeoutMs: 1500,
    });
    patient.step(restPose(), TICK);
    const until = performance.now() + 2500;
    while (performance.now() < until);
    await patient.whenAnswered();
    patient.dispose();
  });

  it("has a time that can be waited", async () => {
    const { seen, createWorker } = emptyWorker();
    for (const timeoutMs of [0, -1, Number.NaN, "5"] as number[]) {
      const options = { model: modelFolder(), createWorker, timeoutMs };
      await expectError("argument", () => createWorkerModel(options));
    }
    expect(seen.asked).toEqual([]);
  });

  it("rejects with what onProgress throws", async () => {
    const options = { model: modelFolder(), createWorker: nodeWorker };
    const onProgress = () => {
      throw new Error("enough");
    };
    await expect(createWorkerModel({ ...options, onProgress })).rejects.toThrow("enough");
  });
});
