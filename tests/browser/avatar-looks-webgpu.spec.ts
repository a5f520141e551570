// The same with WebGPU; needs a display, see scripts/test.mjs.
import { test } from "@playwright/test";
import {
  expectClones,
  expectFlatMemory,
  expectLooks,
  expectRefusals,
  expectRefusedWrites,
} from "./avatar-looks.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

for (const engine of ["three", "babylon"] as const) {
  const stage = { engine, webgpu: true };
  test(`${engine}, WebGPU: outline, shadow, morph targets and rays take the tissue`, ({ page }) =>
    expectLooks(page, stage));
  test(`${engine}, WebGPU: clones of an avatar move by themselves`, ({ page }) =>
    expectClones(page, stage));
  test(`${engine}, WebGPU: refusals change nothing`, ({ page }) => expectRefusals(page, stage));
  test(`${engine}, WebGPU: a vertex stage of WebGL is refused`, ({ page }) =>
    expectRefusedWrites(page, stage));
  test(`${engine}, WebGPU: 200 avatars leave no memory behind`, ({ page }) =>
    expectFlatMemory(page, stage, false));
}
