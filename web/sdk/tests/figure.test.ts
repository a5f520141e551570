// Shapes in words, of avatars in the page and in a worker.
import { readFileSync } from "node:fs";
import { type Avatar, type Figure, load, type Model, restPose } from "dynaskin";
import { createWorkerModel } from "dynaskin/worker";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { nodeWorker } from "./node-worker.js";
import { expectError, loadModel, modelFiles, modelFolder } from "./support.js";

const WISH = { weightKg: 74, statureM: 1.66, chestCm: 96, muscle: 0.4, age: 35 };

let model: Model;
beforeAll(async () => {
  model = await loadModel();
});
afterAll(() => model.dispose());

/** What an avatar of that shape reaches. */
function reached(shape: Figure): Required<Figure> {
  const avatar = model.createAvatar({ shape });
  const { figure } = avatar;
  avatar.dispose();
  if (!figure) throw new Error("The committed model tells its measures.");
  return figure;
}

describe("a shape in words", () => {
  it("has the measures that were asked for", () => {
    const figure = reached(WISH);
    expect(figure.weightKg).toBeCloseTo(74, 1);
    expect(figure.statureM).toBeCloseTo(1.66, 3);
    expect(figure.chestCm).toBeCloseTo(96, 0);
    expect(figure.muscle).toBeCloseTo(0.4, 2);
    expect(figure.age).toBeCloseTo(35, 1);
  });

  it("says what was reached where the wish is unlikely", () => {
    const { weightKg, statureM } = reached({ weightKg: 200, statureM: 1.66 });
    expect(weightKg).toBeGreaterThan(80);
    expect(weightKg).toBeLessThan(95);
    expect(statureM).toBeCloseTo(1.66, 3);
  });

  it("is taken at once by an avatar that moves, which then stands as tall", () => {
    const avatar = model.createAvatar();
    avatar.step(restPose(), 1 / 60);
    const { revision } = avatar;
    avatar.setShape({ statureM: 1.75 });
    expect(avatar.revision).not.toBe(revision);
    expect(heightOf(avatar)).toBeCloseTo(1.75, 2);
    avatar.setShape(new Float32Array(10));
    expect(avatar.figure?.statureM).toBeCloseTo(1.633, 3);
    avatar.dispose();
  });

  it("is the average body where nothing is asked for", () => {
    const avatar = model.createAvatar({ shape: {} });
    expect(Array.from(avatar.shape)).toEqual(new Array(10).fill(0));
    avatar.dispose();
  });

  it("is that of adults", async () => {
    const error = await expectError("shape", () =>
      model.createAvatar({ shape: { statureM: 1.2 } }),
    );
    expect(error.message).toMatch(/1\.45 m.*adults/);
    await expectError("shape", () => model.createAvatar({ shape: { age: 12 } }));
  });

  it.each<[string, object]>([
    ["shape", { weightKg: 74_000 }],
    ["shape", { statureM: 166 }],
    ["shape", { muscle: Number.NaN }],
    ["shape", { muscle: 40 }],
    ["argument", { weightKG: 74 }],
    ["argument", { weightKg: "74" }],
    ["argument", { weightKg: null }],
  ])("is refused with %s for %j, and the avatar stays as it was", async (code, odd) => {
    const avatar = model.createAvatar({ shape: WISH });
    const before = Array.from(avatar.shape);
    await expectError(code, () => avatar.setShape(odd as Figure));
    expect(Array.from(avatar.shape)).toEqual(before);
    await expectError(code, () => model.createAvatar({ shape: odd as Figure }));
    avatar.dispose();
  });

  it("needs a bundle that tells what its shapes are", async () => {
    const untold = await load({
      model: modelFiles({}, (bundle) => {
        bundle.traits = [];
      }),
    });
    const avatar = untold.createAvatar();
    expect(avatar.figure).toBeNull();
    const error = await expectError("shape", () => avatar.setShape(WISH));
    expect(error.message).toContain("traits");
    avatar.dispose();
    untold.dispose();
  });

  it("is the same for the body before its networks are there, and in a worker", async () => {
    const alone = model.body.createAvatar({ shape: WISH });
    const remote = await createWorkerModel({ model: modelFolder(), createWorker: nodeWorker });
    const there = await remote.createAvatar({ shape: WISH });
    expect(there.shape).toEqual(alone.shape);
    expect(there.figure).toEqual(alone.figure);
    there.setShape({ weightKg: 60 });
    await there.whenAnswered();
    there.step(restPose(), 1 / 60);
    await there.whenAnswered();
    expect(there.figure?.weightKg).toBeCloseTo(60, 1);
    await expectError("argument", () => there.setShape({ height: 1.7 } as Figure));
    await expectError("shape", () => remote.createAvatar({ shape: { statureM: 1 } }));
    remote.dispose();
    alone.dispose();
  });
});

it.each(["female", "male"])("the %s bundle tells the traits that its builder wrote", (name) => {
  const read = (file: string) => JSON.parse(readFileSync(new URL(file, modelFolder(name)), "utf8"));
  expect(read("bundle.json").traits).toEqual(read("traits.json"));
});

function heightOf(avatar: Avatar): number {
  const heights = avatar.positions.filter((_, idx) => idx % 3 === 1);
  return heights.reduce((a, b) => Math.max(a, b)) - heights.reduce((a, b) => Math.min(a, b));
}
