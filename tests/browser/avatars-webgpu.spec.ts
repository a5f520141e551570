// Avatars with meshes and bones of their own, with the WebGPU renderers of both engines.
import { test } from "@playwright/test";
import { expectTissue } from "./avatars.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("an avatar is bound and moves in three.js with WebGPURenderer", ({ page }) =>
  expectTissue(page, "three", true));

test("an avatar is bound and moves in Babylon.js with WebGPU", ({ page }) =>
  expectTissue(page, "babylon", true));
