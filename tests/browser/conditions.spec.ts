// What happens to a page beside its use: it is hidden, resized, cut off, its canvas taken away.
import { expect, type Page, test } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { openAddress, openDemo, picture, variation } from "./support.js";

const time = (page: Page) => page.evaluate(() => window.dynaskinDemo?.timeSeconds ?? Number.NaN);
const BODY = { x: 0.1, y: 0.1, width: 0.5, height: 0.7 };

/** Pixels and CSS pixels of the canvas. */
const sizes = (page: Page) =>
  page.evaluate(() => {
    const canvas = document.getElementById("view") as HTMLCanvasElement;
    return [canvas.width, canvas.height, canvas.clientWidth, canvas.clientHeight];
  });

/** Makes the page believe that its tab is hidden, or shown again. */
const setHidden = (page: Page, hidden: boolean) =>
  page.evaluate((now) => {
    Object.defineProperty(document, "hidden", { value: now, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  }, hidden);

test("a hidden tab stands still, and goes on where it stood", async ({ page }) => {
  const problems = await openDemo(page);
  await setHidden(page, true);
  await page.waitForTimeout(300);
  const before = await time(page);
  await page.waitForTimeout(2500);
  expect(await time(page)).toBe(before);
  await setHidden(page, false);
  await expect.poll(() => time(page)).not.toBe(before);
  // Two and a half seconds were not caught up.
  expect((await time(page)) - before).toBeLessThan(2);
  expect(problems).toEqual([]);
});

test("the picture follows the window and the screen's pixels", async ({ page }) => {
  const problems = await openDemo(page);
  for (const [width, height] of [
    [1280, 800],
    [500, 900],
    [900, 420],
  ] as const) {
    await page.setViewportSize({ width, height });
    await expect.poll(() => sizes(page)).toEqual([width, height, width, height]);
  }
  const session = await page.context().newCDPSession(page);
  const metrics = { width: 800, height: 600, mobile: false };
  for (const [deviceScaleFactor, ratio] of [
    [1.5, 1.5],
    // At most two pixels a CSS pixel: a phone has four, at four times the cost.
    [4, 2],
    [1, 1],
  ] as const) {
    await session.send("Emulation.setDeviceMetricsOverride", { ...metrics, deviceScaleFactor });
    await expect.poll(() => sizes(page)).toEqual([800 * ratio, 600 * ratio, 800, 600]);
  }
  expect(variation(await picture(page, "resized"), BODY)).toBeGreaterThan(5);
  expect(problems).toEqual([]);
});

test("a canvas that is taken away and put back breaks nothing", async ({ page }) => {
  const problems = await openDemo(page);
  await page.evaluate(() => {
    const canvas = document.getElementById("view");
    const place = document.createComment("canvas");
    canvas?.replaceWith(place);
    setTimeout(() => {
      if (canvas) place.replaceWith(canvas);
    }, 1500);
  });
  const before = await time(page);
  await expect.poll(() => time(page)).not.toBe(before);
  await expect(page.locator("#view")).toBeVisible();
  await page.waitForTimeout(500);
  expect(variation(await picture(page, "canvas-back"), BODY)).toBeGreaterThan(5);
  await expect(page.getByRole("alert")).toBeEmpty();
  expect(problems).toEqual([]);
});

test("slow pictures lose pixels, which the timings say; full resolution keeps them", async ({
  page,
}) => {
  // 25 pictures a second, whatever the machine.
  await page.addInitScript(() => {
    const soon = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (callback) => {
      setTimeout(() => soon(callback), 40);
      return 0;
    };
  });
  await openAddress(page, "/?view=one&motion=hop&hud=1");
  await expect.poll(async () => (await sizes(page))[0], { intervals: [50] }).toBeLessThan(900);
  await expect(page.locator("#hud-rows")).toContainText(/\d+ × \d+ \(\d\d %\)/);
  await openAddress(page, "/?view=one&motion=hop&hud=1&resolution=full");
  await page.waitForTimeout(3000);
  expect((await sizes(page)).slice(0, 2)).toEqual((await sizes(page)).slice(2));
  await expect(page.locator("#hud-rows")).toContainText("6,890");
  await expect(page.locator("#hud-rows")).toContainText(/[\d,]+ KB/);
});

test("networks out of reach are asked for again", async ({ page }) => {
  const unreachable = (url: URL) => url.pathname.endsWith(".lowered");
  await page.route(unreachable, (route) => route.abort());
  await page.goto("/?view=one&motion=hop&resolution=full");
  const alert = page.getByRole("alert");
  await expect(alert).toContainText("could not be loaded");
  // The body moves with plain skinning meanwhile.
  await expect(page.locator("#now-playing")).toContainText("Hop");
  expect(await page.evaluate(() => window.dynaskinDemo?.ready)).toBe(false);
  await page.unroute(unreachable);
  await alert.getByRole("button", { name: "Try again" }).click();
  await expect.poll(() => page.evaluate(() => window.dynaskinDemo?.ready)).toBe(true);
  await expect(alert.getByRole("button", { name: "Try again" })).toHaveCount(0);
});
