// The example pages run, and what they draw has soft tissue in it.
import { expect, test } from "@playwright/test";
import { expectTissue } from "./examples.js";
import { EXAMPLES_URL } from "./places.js";

test("three.js with WebGLRenderer", ({ page }) => expectTissue(page, "three/", "three"));

test("three.js with WebGPURenderer where there is no WebGPU", ({ page }) =>
  expectTissue(page, "three/?renderer=webgpu", "three-webgpu-fallback"));

test("Babylon.js", ({ page }) => expectTissue(page, "babylon/", "babylon"));

test("plain WebGL2", ({ page }) => expectTissue(page, "webgl2/", "webgl2"));

test("React with react-three-fiber", ({ page }) => expectTissue(page, "react/", "react"));

test("Babylon.js says so where there is no WebGPU", async ({ page }) => {
  await page.goto(`${EXAMPLES_URL}babylon/?engine=webgpu`);
  await expect(page.locator("#note")).toContainText("no WebGPU");
});
