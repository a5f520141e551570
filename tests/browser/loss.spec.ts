// The browser takes the WebGL2 context away and gives it back.
import { expect, test } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { differing, openDemo, picture, variation } from "./support.js";

test("a lost WebGL2 context is told, and the picture comes back as it was", async ({ page }) => {
  await openDemo(page, "?backend=webgl2&paused=1");
  await page.evaluate(() => window.dynaskinDemo?.seek(1.3));
  const before = await picture(page, "loss-before");
  expect(variation(before)).toBeGreaterThan(12);

  for (let round = 0; round < 2; round += 1) {
    const extension = await page.evaluateHandle(() => {
      const canvas = document.querySelector<HTMLCanvasElement>("#view");
      const found = canvas?.getContext("webgl2")?.getExtension("WEBGL_lose_context");
      if (!found) throw new Error("no WEBGL_lose_context");
      found.loseContext();
      return found;
    });
    await expect(page.locator("#loss")).toContainText("graphics card was lost");
    // What is set meanwhile is not forgotten.
    await page.evaluate(() => window.dynaskinDemo?.seek(1.3));
    await extension.evaluate((found) => found.restoreContext());
    await expect(page.locator("#loss")).toHaveCount(0);
    const after = await picture(page, `loss-after-${round}`);
    expect(variation(after)).toBeGreaterThan(12);
    expect(differing(before, after)).toBeLessThan(0.002);
  }
  await expect(page.locator(".toast")).toHaveCount(0);
});
