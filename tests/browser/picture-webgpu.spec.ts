// WebGPU draws what WebGL2 draws, and comes back after its device is lost.
import { expect, type Page, test } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { differing, openDemo, type Picture, picture, STAGE, variation, within } from "./support.js";

test.skip(!process.env.DISPLAY, "WebGPU canvases need a display (xvfb-run)");

async function still(
  page: Page,
  backend: "webgpu" | "webgl2",
  what = "body",
  query = "",
): Promise<Picture> {
  await openDemo(page, `?backend=${backend}&paused=1&${query}`);
  expect(await page.evaluate(() => window.dynaskinDemo?.backend)).toBe(backend);
  await page.evaluate(() => window.dynaskinDemo?.seek(1.3));
  return steady(page, `same-${what}-${backend}`);
}

/** A picture once two in a row are the same: what fades in and out over it is gone then. */
async function steady(page: Page, name: string): Promise<Picture> {
  let last = await picture(page, name);
  await expect(async () => {
    const next = await picture(page, name);
    const share = differing(last, next);
    last = next;
    expect(share).toBe(0);
  }).toPass({ intervals: [300], timeout: 15_000 });
  return last;
}

/** The part of the page without controls. */
const FREE = { x: 0, y: 0.2, width: 0.64, height: 0.62 };
const ROW = "view=side&clip=one-leg-hop&third=spring-bones&fourth=truth";
const VIEWS: [what: string, query: string, part: typeof STAGE][] = [
  ["body", "", STAGE],
  ["heat", "heat=1&motion=jump&clothes=unsupported", STAGE],
  ["four", ROW, FREE],
  ["four-error", `${ROW}&heat=error`, { ...FREE, x: 0.28, width: 0.36 }],
];

for (const [what, query, part] of VIEWS) {
  test(`WebGPU and WebGL2 draw the same picture: ${what}`, async ({ page }) => {
    const webgl2 = await still(page, "webgl2", what, query);
    const webgpu = await still(page, "webgpu", what, query);
    expectSame(webgl2, webgpu, what, part);
  });
}

function expectSame(webgl2: Picture, webgpu: Picture, what: string, part: typeof STAGE): void {
  expect([webgpu.width, webgpu.height]).toEqual([webgl2.width, webgl2.height]);
  let [count, sum, largest] = [0, 0, 0];
  for (const at of within(webgl2, part)) {
    for (const channel of [at, at + 1, at + 2]) {
      const difference = Math.abs((webgl2.data[channel] ?? 0) - (webgpu.data[channel] ?? 0));
      count += 1;
      sum += difference;
      largest = Math.max(largest, difference);
    }
  }
  const mean = sum / count;
  console.log(`${what}: mean difference ${mean.toFixed(3)} of 255, largest ${largest}`);
  expect(variation(webgpu, part)).toBeGreaterThan(12);
  expect(mean).toBeLessThan(0.6);
}

test("a destroyed WebGPU device is told, and the picture comes back", async ({ page }) => {
  await page.addInitScript(() => {
    const devices: GPUDevice[] = [];
    const ask = GPUAdapter.prototype.requestDevice;
    GPUAdapter.prototype.requestDevice = async function (...what) {
      const device = await ask.apply(this, what);
      devices.push(device);
      return device;
    };
    Object.assign(window, { devices });
  });
  const before = await still(page, "webgpu");
  // The message may be gone again before it can be looked for.
  await page.evaluate(() => {
    const seen = new MutationObserver(() => {
      if (document.getElementById("loss")) document.body.dataset.loss = "seen";
    });
    seen.observe(document.body, { childList: true });
    (window as unknown as { devices: GPUDevice[] }).devices.at(-1)?.destroy();
  });
  await expect(page.locator("body")).toHaveAttribute("data-loss", "seen");
  await expect(page.locator("#loss")).toHaveCount(0);
  const after = await steady(page, "loss-after-webgpu");
  expect(variation(after)).toBeGreaterThan(12);
  expect(differing(before, after)).toBeLessThan(0.002);
});
