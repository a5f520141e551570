// Avatars with meshes and bones of their own, with the WebGPU renderer of three.js.
import { test } from "@playwright/test";
import { expectTissue } from "./avatars.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("an avatar is bound and moves in three.js with WebGPURenderer", ({ page }) =>
  expectTissue(page, "three", true));
