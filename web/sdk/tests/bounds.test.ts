// Small files that ask for much neither block a page nor take its memory: a file of a megabyte is read
// within 280 MB of the core's memory besides the loaded model, or refused.
import { type Avatar, load, type Model, Motion } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { type SmallFile, smallFiles } from "./small-files.js";
import { coreMemory, expectError, loadModel } from "./support.js";

const MOST_BYTES = 280e6;

let model: Model;
let avatar: Avatar;
/** With the model loaded. */
let loadedBytes: number;
beforeAll(async () => {
  model = await loadModel();
  avatar = model.createAvatar();
  loadedBytes = await memoryBytes();
});
afterAll(() => model.dispose());

async function memoryBytes(): Promise<number> {
  return (await coreMemory()).buffer.byteLength;
}

describe("a small motion file", () => {
  it.each(smallFiles().map((file): [string, SmallFile] => [file.name, file]))(
    "of great effect is read or refused within 280 MB: %s",
    async (_, { bytes: make, outcome }) => {
      const bytes = make();
      expect(bytes.length).toBeLessThan(1.3e6);
      const began = performance.now();
      if (outcome === "refused") {
        await expectError("motion", () => Motion.fromFile(bytes, avatar));
      } else {
        const motion = Motion.fromFile(bytes, avatar);
        expect(motion.durationSeconds).toBeGreaterThan(0);
        motion.dispose();
      }
      const seconds = (performance.now() - began) / 1000;
      // The memory never shrinks, so this is the most that any file before took, too.
      const takenBytes = (await memoryBytes()) - loadedBytes;
      console.log(`    ${seconds.toFixed(2)} s, ${(takenBytes / 1e6).toFixed(0)} MB`);
      expect(takenBytes).toBeLessThan(MOST_BYTES);
    },
  );
});

describe("what is too large", () => {
  it("is refused before it is copied into the core's memory", async () => {
    const before = await memoryBytes();
    const file = new Uint8Array(257 * 2 ** 20);
    for (const read of [Motion.fromFile, Motion.fromBvh, Motion.animations]) {
      await expectError("motion", () => read(file, avatar));
    }
    await expectError("motion", () => Motion.fromPoses(new Float64Array(99 * 162_001), 60, avatar));
    await expectError("state", () => avatar.restore(file));
    await expectError("argument", () => avatar.showOffsets(new Float32Array(2 ** 26)));
    const name = "x".repeat(2 ** 20);
    await expectError("argument", () =>
      Motion.fromFile(new Uint8Array(4), avatar, { joints: { left_hip: name } }),
    );
    await expectError("argument", () =>
      Motion.fromFile(new Uint8Array(4), avatar, { animation: name }),
    );
    await expectError("argument", () => Motion.fromPoses(new Float64Array(99), 60, avatar, name));
    expect(await memoryBytes()).toBe(before);
  });

  it("is refused by load at 64 MiB a file, packed answers as they unpack", async () => {
    const zeros = new Uint8Array(65 * 2 ** 20);
    const packed = new Blob([zeros]).stream().pipeThrough(new CompressionStream("gzip"));
    const unpacked = new Response(packed.pipeThrough(new DecompressionStream("gzip")));
    const { message } = await expectError("fetch", () =>
      load({ model: { bundle: unpacked, body: zeros, predictor: zeros, decoder: zeros } }),
    );
    expect(message).toMatch(/bundle\.json has \d+ MiB; at most 16 MiB/);
  });
});
