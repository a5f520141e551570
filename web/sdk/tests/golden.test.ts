// The WebAssembly gives the native runtime's offsets.
import { readFileSync } from "node:fs";
import * as sdk from "dynaskin";
import { expect, it } from "vitest";
import { type Golden, replay } from "../../../tests/golden/replay.js";
import { loadModel, MODEL_NAMES } from "./support.js";

it.each(MODEL_NAMES)("%s hops as the native runtime makes it hop", async (name) => {
  const file = new URL(`../../../tests/golden/${name}-hop.json`, import.meta.url);
  const golden: Golden = JSON.parse(readFileSync(file, "utf8"));
  const model = await loadModel(name);
  const { largestUm, worstUm, frames } = replay(sdk, model, golden);
  console.log(`${name}: offsets to ${largestUm.toFixed(0)} µm, off by ${worstUm.toFixed(2)} µm`);
  expect(frames).toBe(300);
  expect(largestUm).toBeGreaterThan(2000);
  expect(worstUm).toBeLessThanOrEqual(10);
  model.dispose();
});
