// The same with WebGPU; needs a display, see scripts/test.mjs.
import { test } from "@playwright/test";
import { expectVelocity } from "./velocity.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

for (const [engine, way] of [
  ["three", "DynaSkin"],
  ["three", "DynaSkin on the card"],
  ["three", "attributes"],
  ["babylon", "DynaSkin on the card"],
  ["babylon", "attributes"],
] as const) {
  test(`${engine}, WebGPU, ${way}: motion vectors follow the tissue`, ({ page }) =>
    expectVelocity(page, engine, way, true));
}
