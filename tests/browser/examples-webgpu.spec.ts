// The examples that can draw with WebGPU; needs a display, see scripts/test.mjs.
import { expect, test } from "@playwright/test";
import { expectTissue } from "./examples.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("three.js with WebGPURenderer on WebGPU", async ({ page }) => {
  await expectTissue(page, "three/?renderer=webgpu", "three-webgpu");
  expect(await page.evaluate(async () => Boolean(await navigator.gpu?.requestAdapter()))).toBe(
    true,
  );
});

test("Babylon.js with WebGPUEngine", ({ page }) =>
  expectTissue(page, "babylon/?engine=webgpu", "babylon-webgpu"));

test("dynaskin's own renderer on WebGPU", async ({ page }) => {
  await expectTissue(page, "renderer/", "renderer-webgpu");
  await expect(page.locator("#note")).toContainText("dynaskin/renderer with webgpu");
});
