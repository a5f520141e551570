// The same with WebGPU; needs a display, see scripts/test.mjs.
import { test } from "@playwright/test";
import { expectDecoding } from "./decoding.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("WebGPU decodes as the CPU does, and leaves to it what it cannot do", ({ page }) =>
  expectDecoding(page, "webgpu"));
