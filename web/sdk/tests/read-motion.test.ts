// Long files are read beside the page: with progress, until they are stopped.
import { type Avatar, type Model, Motion } from "dynaskin";
import { type ReadMotionOptions, readMotion } from "dynaskin/worker";
import { afterAll, afterEach, beforeAll, describe, expect, it, vi } from "vitest";
import { hopFile } from "../../../tests/hop-bvh.js";
import { hopGlb, hopNpz } from "../../../tests/hop-files.js";
import { nodeWorker } from "./node-worker.js";
import { longFile } from "./small-files.js";
import { expectError, loadModel } from "./support.js";

let model: Model;
let avatar: Avatar;
beforeAll(async () => {
  model = await loadModel();
  avatar = model.createAvatar({ shape: [0.5, 1, 0, 0, 0, 0, 0, 0, 0, 0] });
});
afterAll(() => model.dispose());
afterEach(() => vi.unstubAllGlobals());

const read = (file: Blob | ArrayBuffer | Uint8Array, options: ReadMotionOptions = {}) =>
  readMotion(file, avatar, { createWorker: nodeWorker, ...options });

const hopBvh = () => new TextEncoder().encode(hopFile());

describe("a motion that is read in a worker", () => {
  it("is the one that the page reads, bit by bit, of every kind of file", async () => {
    for (const bytes of [hopBvh(), await hopGlb("vrma"), hopNpz()]) {
      const here = Motion.fromFile(bytes, avatar);
      const there = await read(bytes);
      expect(there.name).toBe(here.name);
      expect(there.durationSeconds).toBe(here.durationSeconds);
      expect(there.jointReport).toEqual(here.jointReport);
      expect(there.notes).toEqual(here.notes);
      for (let time = 0; time < here.durationSeconds; time += 0.013) {
        expect(there.poseAt(time)).toEqual(here.poseAt(time));
      }
      for (const motion of [here, there]) motion.dispose();
    }
    const file = new Blob([hopBvh()]);
    expect((await read(file)).durationSeconds).toBeGreaterThan(1);
  });

  it("says how far it is, from the beginning to the end", async () => {
    const fractions: number[] = [];
    const motion = await read(longFile(), { onProgress: (fraction) => fractions.push(fraction) });
    motion.dispose();
    expect(fractions.length).toBeGreaterThan(10);
    expect(fractions).toEqual(fractions.toSorted((a, b) => a - b));
    expect([fractions[0], fractions.at(-1)]).toEqual([0, 1]);
  });

  it("is stopped by its signal, and its worker with it", async () => {
    const stop = new AbortController();
    const thread = nodeWorker();
    const ended = vi.spyOn(thread, "terminate");
    const reading = read(longFile(), {
      createWorker: () => thread,
      signal: stop.signal,
      onProgress: (fraction) => {
        if (fraction > 0.3) stop.abort(new Error("another file was dropped"));
      },
    });
    await expect(reading).rejects.toThrow("another file was dropped");
    expect(ended).toHaveBeenCalled();
    const late = read(hopBvh(), { signal: AbortSignal.abort(new Error("left")) });
    await expect(late).rejects.toThrow("left");
    const nothing = new AbortController();
    const silent = read(longFile(), { signal: nothing.signal });
    nothing.abort(null);
    await expect(silent).rejects.toBeDefined();
  });

  it("is refused as in the page, and by a worker that was terminated", async () => {
    const text = new TextEncoder().encode("no motion");
    const { message } = await expectError("motion", () => read(text));
    expect(message).toBe(
      (await expectError("motion", () => Motion.fromFile(text, avatar))).message,
    );
    await expectError("motion", () => read(new Uint8Array(257 * 2 ** 20)));
    await expectError("motion", () => read(hopBvh(), { joints: { left_hip: "nobody" } }));
    await expectError("argument", () => read(hopBvh(), { joints: 5 as never }));
    await expectError("argument", () => read("file.bvh" as never));
    await expectError("argument", () => read(hopBvh(), { raetHz: 30 } as never));
    await expectError("argument", () => readMotion(hopBvh(), {} as never));
    const thread = nodeWorker();
    const reading = read(longFile(), { createWorker: () => thread, timeoutMs: 800 });
    thread.terminate();
    await expectError("worker", () => reading);
  });
});

describe("a page with Trusted Types", () => {
  it("hands over the script that its policy trusts, and is told to where it did not", async () => {
    const trusted = { toString: () => "https://page.test/thread.js" };
    const scripts: unknown[] = [];
    vi.stubGlobal(
      "Worker",
      class {
        constructor(script: unknown) {
          if (script !== trusted) {
            throw new TypeError("This document requires 'TrustedScriptURL' assignment.");
          }
          scripts.push(script);
          Object.assign(this, nodeWorker());
        }
        postMessage(): void {}
        terminate(): void {}
      },
    );
    const without = await expectError("worker", () => readMotion(hopBvh(), avatar));
    expect(without.message).toContain("workerScript");
    const lost = () => readMotion(hopBvh(), avatar, { workerScript: trusted, timeoutMs: 200 });
    await lost().catch(() => {});
    expect(scripts).toEqual([trusted]);
    const both = { workerScript: trusted, createWorker: nodeWorker };
    await expectError("argument", () => readMotion(hopBvh(), avatar, both));
  });
});
