// The renderer blends dual quaternions with WebGPU; three.js says that it cannot.
import { expect, test } from "@playwright/test";
import { expectSkinnings, inSkinning } from "./skinnings.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("the renderer with WebGPU skins as the CPU does", ({ page }) =>
  expectSkinnings(page, "renderer", "compareInRenderer", "webgpu"));

test("three.js with WebGPURenderer refuses dual quaternions and draws without them", async ({
  page,
}) => {
  const said = await inSkinning(page, "three", "refuseInThree");
  expect(said).toEqual([
    expect.stringMatching(/^argument: Skinning "dual-quaternion" is for WebGLRenderer/),
    "nothing",
  ]);
});
