// The same with WebGPURenderer and MToonNodeMaterial; needs a display, see scripts/test.mjs.
import { test } from "@playwright/test";
import { expectMToon } from "./mtoon.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("MToon's node material and its outlines take the tissue", ({ page }) =>
  expectMToon(page, true));
