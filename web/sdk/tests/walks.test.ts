// The same random calls show the same in WebAssembly as natively.
import { readFileSync } from "node:fs";
import { expect, it } from "vitest";
import { type Shown, walk } from "../../../tests/golden/walk.js";
import { loadModel } from "./support.js";

it("shows after random calls what the native runtime shows", async () => {
  const file = new URL("../../../tests/golden/walks.json", import.meta.url);
  const golden: { vertices: number[]; walks: Shown[] } = JSON.parse(readFileSync(file, "utf8"));
  const model = await loadModel();
  let [worstUm, largestUm] = [0, 0];
  for (const expected of golden.walks) {
    const avatar = model.createAvatar();
    const shown = walk(avatar, expected.seed, golden.vertices);
    avatar.dispose();
    expect(shown.matrices).toBe(expected.matrices);
    expect(shown.offsets_um.length).toBe(expected.offsets_um.length);
    for (const [look, offsetsUm] of expected.offsets_um.entries()) {
      for (const [idx, um] of offsetsUm.entries()) {
        worstUm = Math.max(worstUm, Math.abs((shown.offsets_um[look]?.[idx] ?? Number.NaN) - um));
        largestUm = Math.max(largestUm, Math.abs(um));
      }
    }
  }
  model.dispose();
  console.log(`walks: offsets to ${largestUm.toFixed(0)} µm, off by ${worstUm.toFixed(2)} µm`);
  expect(golden.walks.length).toBeGreaterThan(0);
  expect(largestUm).toBeGreaterThan(2000);
  expect(worstUm).toBeLessThanOrEqual(10);
});
