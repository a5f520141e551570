// The body dragged by pelvis or chest: with the mouse, the keys, and a finger on a phone.
import { expect, type Locator, type Page } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { differing, openDemo, picture, test } from "./support.js";

/** Small, because a page drawn in software moves on by a quarter of a second in each of its slow pictures; tall enough for the panel. */
test.use({ viewport: { width: 820, height: 600 } });
const PATIENT = { timeout: 120_000 };

const ring = (page: Page, name: "Chest" | "Pelvis") =>
  page.getByRole("button", { name, exact: true });

async function middle(locator: Locator): Promise<{ x: number; y: number }> {
  const box = await locator.boundingBox();
  if (!box) throw new Error("the ring is not shown");
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

/** Largest offset of the right actor's skin, in millimetres. */
const largestMm = (page: Page) =>
  page.evaluate(() => {
    const offsets = window.dynaskinDemo?.avatar?.offsets ?? [];
    let largest = 0;
    for (let at = 0; at < offsets.length; at += 3) {
      const length = Math.hypot(offsets[at] ?? 0, offsets[at + 1] ?? 0, offsets[at + 2] ?? 0);
      largest = Math.max(largest, length);
    }
    return 1000 * largest;
  });

/** Waits until a ring is where it was, within some pixels. */
async function expectBack(locator: Locator, start: { x: number; y: number }): Promise<void> {
  await expect
    .poll(async () => {
      const now = await middle(locator);
      return Math.hypot(now.x - start.x, now.y - start.y);
    }, PATIENT)
    .toBeLessThan(3);
}

test("the mouse drags pelvis and chest, and the tissue answers", async ({ reused: page }) => {
  await openDemo(page, "?clothes=unsupported&paused=1");
  await page.getByRole("button", { name: "Grab the body" }).click();
  await expect(page.getByRole("combobox", { name: "Motion" })).toHaveValue("by-hand");
  await expect(page.locator("#hand-hint")).toBeVisible();
  await expect(page.getByLabel("Time in the motion")).toBeDisabled();
  expect(page.url()).toContain("motion=by-hand");
  const standing = await picture(page, "by-hand-standing");
  for (const name of ["Pelvis", "Chest"] as const) {
    const start = await middle(ring(page, name));
    await page.mouse.move(start.x, start.y);
    await page.mouse.down();
    await page.mouse.move(start.x + 40, start.y + 30, { steps: 3 });
    await page.mouse.move(start.x + 60, start.y + 40);
    await expect
      .poll(async () => (await middle(ring(page, name))).x, PATIENT)
      .toBeGreaterThan(start.x + 20);
    expect(await largestMm(page)).toBeGreaterThan(2);
    const pulled = await picture(page, `by-hand-${name.toLowerCase()}`);
    expect(differing(standing, pulled)).toBeGreaterThan(0.03);
    await page.mouse.up();
    await expectBack(ring(page, name), start);
  }
  expect(await page.evaluate(() => window.dynaskinDemo?.view.camera.floorM.x)).toBe(0);
});

test("the arrow keys pull for as long as they are held", async ({ reused: page }) => {
  await openDemo(page, "?paused=1");
  await page.keyboard.press("h");
  await expect(ring(page, "Pelvis")).toBeFocused();
  const start = await middle(ring(page, "Pelvis"));
  await page.keyboard.down("ArrowDown");
  await expect
    .poll(async () => (await middle(ring(page, "Pelvis"))).y, PATIENT)
    .toBeGreaterThan(start.y + 10);
  await page.keyboard.up("ArrowDown");
  await expectBack(ring(page, "Pelvis"), start);
  await page.getByRole("combobox", { name: "Motion" }).selectOption("hop");
  await expect(ring(page, "Pelvis")).toBeHidden();
  await expect(page.getByLabel("Time in the motion")).toBeEnabled();
});

test("a finger drags the body on a phone, and the page does not scroll", async ({ browser }) => {
  const context = await browser.newContext({
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  const page = await context.newPage();
  await openDemo(page, "?motion=by-hand");
  const start = await middle(ring(page, "Pelvis"));
  const devtools = await context.newCDPSession(page);
  const touch = (type: "touchStart" | "touchMove" | "touchEnd", x = 0, y = 0) =>
    devtools.send("Input.dispatchTouchEvent", {
      type,
      touchPoints: type === "touchEnd" ? [] : [{ x, y }],
    });
  await touch("touchStart", start.x, start.y);
  for (const step of [10, 30, 60, 90]) await touch("touchMove", start.x, start.y - step);
  await expect
    .poll(async () => (await middle(ring(page, "Pelvis"))).y, PATIENT)
    .toBeLessThan(start.y - 20);
  await picture(page, "by-hand-phone");
  await touch("touchEnd");
  await expectBack(ring(page, "Pelvis"), start);
  const scrolled = await page.evaluate(() => [scrollX, scrollY, visualViewport?.offsetTop ?? 0]);
  expect(scrolled).toEqual([0, 0, 0]);
  await context.close();
});

test("the program moves a body by hand, too", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&motion=by-hand");
  await page.keyboard.press("u");
  const code = page.locator("#code-text");
  await expect(code).toHaveValue(/import \{ load, Puppet \} from "dynaskin";/);
  await expect(code).toHaveValue(/puppet\.step\(dtSeconds, pose\);/);
});
