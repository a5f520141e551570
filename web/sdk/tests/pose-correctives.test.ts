// The WebAssembly corrects the skin as the equations say.
import { readFileSync } from "node:fs";
import { load, loadBody } from "dynaskin";
import { loadBody as loadBodySlim } from "dynaskin/slim";
import { describe, expect, it } from "vitest";
import { expectError, largestDifference, loadModel, modelFiles } from "./support.js";

/** What `crates/runtime/tests/pose_correctives.rs` writes beside the body. */
interface Golden {
  shape: number[];
  /** Of 99 numbers each. */
  poses: number[][];
  /** `[pose][vertex][axis]` flattened, metres. */
  skinnedM: number[][];
}

const read = (name: string) =>
  new Uint8Array(readFileSync(new URL(`../../../tests/golden/${name}`, import.meta.url)));

const golden: Golden = JSON.parse(new TextDecoder().decode(read("pose-correctives.json")));
const glb = read("pose-correctives.glb");

describe("pose correctives", () => {
  it.each([
    ["the whole core", loadBody],
    ["the slim core", loadBodySlim],
  ])("are the native reference's with %s", async (_name, loads) => {
    const body = await loads({ body: glb });
    const avatar = body.createAvatar({ shape: golden.shape });
    const plain = body.createAvatar({ shape: golden.shape, poseCorrectives: false });
    expect([avatar.poseCorrectives, plain.poseCorrectives]).toEqual([true, false]);
    for (const [idx, numbers] of golden.poses.entries()) {
      const pose = Float64Array.from(numbers);
      avatar.step(pose, 1 / 60);
      plain.step(pose, 1 / 60);
      const skinned = avatar.skinned().positions.slice();
      expect(largestDifference(skinned, golden.skinnedM[idx] ?? [])).toBeLessThanOrEqual(1e-5);
      expect(largestDifference(skinned, plain.skinned().positions)).toBeGreaterThan(1e-3);
    }
    avatar.poseCorrectives = false;
    expect(largestDifference(avatar.positions, plain.positions)).toBe(0);
    plain.poseCorrectives = true;
    expect(largestDifference(plain.skinned().positions, golden.skinnedM.at(-1) ?? [])).toBeLessThan(
      1e-5,
    );
    for (const made of [avatar, plain, body]) made.dispose();
  });

  it("are none on a body without them", async () => {
    const model = await loadModel();
    const avatar = model.createAvatar({ poseCorrectives: true });
    expect(avatar.poseCorrectives).toBe(false);
    avatar.poseCorrectives = true;
    expect(avatar.poseCorrectives).toBe(false);
    avatar.dispose();
    model.dispose();
  });

  it("come with a body that needs no bundle, and other files are refused", async () => {
    const body = await loadBody({ body: glb });
    expect(body.vertexCount).toBe(96);
    expect(body.sha256).toMatch(/^[0-9a-f]{64}$/);
    body.dispose();
    await expectError("body", () => loadBody({ body: new Uint8Array(64) }));
    await expectError("argument", () => loadBody(null as unknown as { body: Uint8Array }));
    // The same body by its bundle.
    const files = modelFiles({ body: glb });
    let corrects = false;
    const onBody = (loaded: typeof body) => {
      const avatar = loaded.createAvatar();
      corrects = avatar.poseCorrectives;
      avatar.dispose();
    };
    // The bundle's networks are another body's.
    await expectError("bundle", () => load({ model: files, onBody }));
    expect(corrects).toBe(true);
  });
});
