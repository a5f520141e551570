// The same with WebGPU; needs a display, see scripts/test.mjs.
import { test } from "@playwright/test";
import { expectCard } from "./card.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("three.js with WebGPURenderer draws what its card decodes", ({ page }) =>
  expectCard(page, "three", "playInThree", true));

test("Babylon.js with WebGPUEngine draws what its card decodes", ({ page }) =>
  expectCard(page, "babylon", "playInBabylon", true));
