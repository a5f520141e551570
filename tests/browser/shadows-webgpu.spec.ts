// The same with WebGPU; needs a display, see scripts/test.mjs.
import { test } from "@playwright/test";
import { expectShadows } from "./shadows.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("three.js with WebGPURenderer throws the tissue's shadow", ({ page }) =>
  expectShadows(page, "three", true));

test("Babylon.js with WebGPU throws the tissue's shadow", ({ page }) =>
  expectShadows(page, "babylon", true));
