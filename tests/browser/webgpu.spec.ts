// What only WebGPU can show; needs a display, see scripts/test.mjs.
import { expect, test } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { differing, openDemo, picture, variation } from "./support.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

test("draws the body with WebGPU, and dynamics change the picture", async ({ page }) => {
  await openDemo(page, "?backend=webgpu&motion=hop&paused=1");
  expect(await page.evaluate(() => window.dynaskinDemo?.backend)).toBe("webgpu");
  const at = async (dynamics: boolean) => {
    await page.evaluate((on) => {
      const demo = window.dynaskinDemo;
      if (demo?.avatar) demo.avatar.strength = on ? 1 : 0;
      demo?.seek(2);
    }, dynamics);
    await page.waitForTimeout(500);
    return picture(page, `webgpu-${dynamics ? "on" : "off"}`);
  };
  const off = await at(false);
  const on = await at(true);
  expect(variation(on)).toBeGreaterThan(12);
  expect(differing(off, on, 10)).toBeGreaterThan(0.001);
});

test("skins as the CPU does, to a tenth of a millimetre", async ({ page }) => {
  await openDemo(page, "?backend=webgpu&motion=jumping-jacks&paused=1");
  const largest = await page.evaluate(async () => {
    const demo = window.dynaskinDemo;
    if (!demo?.avatar) throw new Error("the demo is not ready");
    // Clothes that span what lies under them are in the picture alone.
    demo.view.bodies[0]?.setLook({ sculpture: false, draped: false });
    let difference = 0;
    for (const time of [0.3, 1.1, 2.4]) {
      demo.seek(time);
      const onCpu = demo.avatar.skinned().positions.slice();
      const onGpu = await demo.view.bodies[0]?.readSkinnedPositions();
      if (onGpu?.length !== onCpu.length) throw new Error("no read-back");
      if (Math.max(...onGpu) < 1) throw new Error("the read-back holds no standing body");
      onGpu.forEach((value, idx) => {
        difference = Math.max(difference, Math.abs(value - (onCpu[idx] ?? 0)));
      });
    }
    return difference;
  });
  console.log(`largest difference of skinned positions, WebGPU against CPU: ${largest} m`);
  expect(largest).toBeLessThanOrEqual(1e-4);
});

test("chooses WebGPU by itself where there is an adapter", async ({ page }) => {
  await openDemo(page, "?paused=1");
  expect(await page.evaluate(() => window.dynaskinDemo?.backend)).toBe("webgpu");
});
