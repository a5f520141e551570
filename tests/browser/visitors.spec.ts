// What a visitor meets first, takes along, and measures.
import { readdirSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import AxeBuilder from "@axe-core/playwright";
import { expect } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { ROOT } from "./places.js";
import { openAddress, openDemo, picture, test, variation } from "./support.js";

const METHODS = readdirSync(join(ROOT, "models", "female", "methods"));

test("the benchmark lists every method that there is, with time, size and error", async ({
  page,
}) => {
  await openDemo(page, "?paused=1");
  await page.getByRole("button", { name: "Run the benchmark on my machine" }).click();
  const dialog = page.getByRole("dialog", { name: "Methods on this machine" });
  await expect(dialog.getByRole("row")).toHaveCount(METHODS.length + 3, { timeout: 120_000 });
  await picture(page, "benchmark");
  const rows = (await dialog.locator("tbody tr").allTextContents()).join("\n");
  console.log(rows);
  for (const row of await dialog.locator("tbody tr").all()) {
    const cells = await row.locator("th, td").allTextContents();
    expect(Number(cells[1])).toBeGreaterThan(0);
    expect(cells[2]).toMatch(/^(none|[\d,]+ KB)$/);
    expect(cells[3]).toMatch(/^(none|[\d,]+)$/);
    expect(cells[4]).toMatch(/^(none|[\d,]+)$/);
    expect(cells[5]).toMatch(/^(\d+\.\d\d mm|not measured)$/);
  }
  await expect(dialog.getByRole("row", { name: /^Spring bones/ })).toContainText("18");
  for (const name of ["DSNet (narrow)", "Casas & Otaduy (narrow)"]) {
    await expect(dialog.getByRole("rowheader", { name, exact: true })).toBeVisible();
  }
  await expect(dialog).toContainText("no measure of what the published method can do");
  const text = await readFile(join(ROOT, "models", "female", "bundle.json"), "utf8");
  const { sets } = JSON.parse(text).measured;
  const unseen = sets.filter(({ set }: { set: string }) => set !== "unseen-shape");
  const sum = (of: (set: { frames: number; soft: { error_mm: number } }) => number) =>
    unseen.reduce((total: number, set: Parameters<typeof of>[0]) => total + of(set), 0);
  const errorMm = sum((set) => set.frames * set.soft.error_mm) / sum((set) => set.frames);
  const own = dialog.getByRole("row", { name: /^dynaskin/ });
  await expect(own).toContainText(`${errorMm.toFixed(2)} mm`);
  const { violations } = await new AxeBuilder({ page }).include("#benchmark-dialog").analyze();
  expect(violations.filter(({ impact }) => impact === "serious")).toEqual([]);

  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await dialog.getByRole("button", { name: "Copy as text" }).click();
  const copied = await page.evaluate(() => navigator.clipboard.readText());
  expect(copied.split("\n")[0]).toMatch(
    /^Method +ms a frame +Files +Parameters +Frames learned from +Held-out error +Error over plain/,
  );
  expect(copied).toContain("Spring bones");
  await expect(dialog).toBeHidden();
});

test("a benchmark that is closed stops, and the page goes on", async ({ reused: page }) => {
  await openDemo(page);
  await page.keyboard.press("k");
  await expect(page.locator("#benchmark-note")).toContainText("…");
  await page.keyboard.press("Escape");
  const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds);
  const before = await time();
  await expect.poll(time).not.toBe(before);
  await expect(page.getByRole("alert")).toBeEmpty();
});

test("strength, regions and the moment are in the link", async ({ page }) => {
  await openDemo(page, "?paused=1");
  await page.getByLabel("Strength").fill("1.5");
  await page.getByText("Regions", { exact: true }).click();
  await page.getByLabel("Belly").fill("0.5");
  await page.getByLabel("Time in the motion").fill("2.5");
  await expect(page).toHaveURL(/time=2\.5/);
  const address = new URL(page.url());
  expect(address.searchParams.get("strength")).toBe("1.5");
  expect(address.searchParams.get("gains")).toBe("belly:0.5");
  expect(Number(address.searchParams.get("time"))).toBeCloseTo(2.5, 1);
  const seen = () =>
    page.evaluate(() => {
      const { avatar, timeSeconds } = window.dynaskinDemo ?? {};
      const { regions, strength } = avatar?.controls ?? {};
      return [timeSeconds, strength, regions?.belly.gain, regions?.thighs.gain];
    });
  const before = await seen();
  await openAddress(page, address.pathname + address.search);
  expect(await seen()).toEqual(before);
  await expect(page.getByLabel("Strength")).toHaveValue("1.5");
  const wrong = "/?view=one&motion=hop&strength=9&gains=belly:-3,nose:2,thighs&time=x";
  await openAddress(page, wrong);
  expect((await seen()).slice(1, 3)).toEqual([4, 0]);
});

test("a visitor of the Lab who asked for less motion sees a landing that stands still", async ({
  page,
}) => {
  await page.emulateMedia({ reducedMotion: "reduce" });
  await openAddress(page, "/?lab=1");
  await expect(page.locator("#still-note")).toBeVisible();
  const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds ?? 0);
  expect(await time()).toBeCloseTo(1.85, 2);
  const floor = () => page.evaluate(() => ({ ...window.dynaskinDemo?.view.camera.floorM }));
  const before = await floor();
  await page.keyboard.press(" ");
  await expect(page.locator("#still-note")).toBeHidden();
  await expect.poll(time).toBeGreaterThan(1.9);
  // The camera stays where it is while the body moves a little.
  expect(await floor()).toEqual(before);
});

test("a recording survives a window that changes its size", async ({ page }) => {
  await openDemo(page);
  await page.getByRole("button", { name: "Record" }).click();
  await page.waitForTimeout(1000);
  await page.setViewportSize({ width: 700, height: 900 });
  await page.waitForTimeout(1500);
  const download = page.waitForEvent("download");
  await page.keyboard.press("v");
  const bytes = await readFile(await (await download).path());
  const video = await page.evaluate(async (base64) => {
    const element = document.createElement("video");
    element.src = `data:video/webm;base64,${base64}`;
    await new Promise((done, fail) => {
      element.onloadeddata = done;
      element.onerror = () => fail(new Error("the recording cannot be played"));
    });
    return { width: element.videoWidth, height: element.videoHeight };
  }, bytes.toString("base64"));
  expect(video).toEqual({ width: 1000, height: 640 });
});

test("the Lab begins with linear skinning beside dynaskin in a jump, by name", async ({ page }) => {
  const problems = await openAddress(page, "/?lab=1");
  await expect(page.locator("#now-playing")).toHaveText("Jump · female body");
  await expect(page.locator("#names .name span")).toHaveText(["Linear skinning", "dynaskin"]);
  await page.evaluate(() => window.dynaskinDemo?.seek(1.85));
  const largestMm = (side: "avatar" | "leftAvatar") =>
    page.evaluate((name) => {
      const offsets = window.dynaskinDemo?.[name]?.offsets ?? [];
      return 1000 * Math.max(...[...offsets].map(Math.abs));
    }, side);
  expect(await largestMm("leftAvatar")).toBe(0);
  expect(await largestMm("avatar")).toBeGreaterThan(5);
  const image = await picture(page, "lab");
  for (const x of [0.1, 0.36]) {
    expect(variation(image, { x, y: 0.3, width: 0.2, height: 0.4 })).toBeGreaterThan(15);
  }
  expect(problems).toEqual([]);
});

test("up to four actors stand beside each other, two on a phone", async ({ page }) => {
  const row = "left=linear&right=dynaskin&third=spring-bones&fourth=truth";
  await openAddress(page, `/?paused=1&clip=one-leg-hop&plots=1&time=2&${row}`);
  const names = page.locator("#names .name span");
  await expect(names).toHaveText(["Linear skinning", "dynaskin", "Spring bones", "Ground truth"]);
  // The row stands between the plots on the left and the controls on the right, each below its name.
  await expect(page.locator("#loading")).toHaveClass(/done/);
  const boxes = await Promise.all((await names.all()).map((name) => name.boundingBox()));
  const lefts = boxes.map((box) => box?.x ?? Number.NaN);
  expect(lefts.toSorted((a, b) => a - b)).toEqual(lefts);
  expect(lefts[0]).toBeGreaterThan(290);
  for (const [idx, box] of boxes.slice(1).entries()) {
    const before = boxes[idx];
    expect(box?.x).toBeGreaterThanOrEqual((before?.x ?? 0) + (before?.width ?? 0));
  }
  expect((boxes[3]?.x ?? 0) + (boxes[3]?.width ?? 0)).toBeLessThan(652);
  // Where they stand close together the names go without their keys, and are whole, in wide fonts too.
  await page.addStyleTag({ content: ".name { letter-spacing: 0.12em }" });
  const fourth = page.getByLabel("Fourth", { exact: true });
  await fourth.selectOption({ label: "Nobody" });
  await expect(names).toHaveCount(3);
  await fourth.selectOption({ label: "Ground truth" });
  await expect(names).toHaveCount(4);
  // They are laid out with the next picture.
  const cut = () =>
    names.evaluateAll((all) =>
      all.filter((name) => name.scrollWidth > name.clientWidth).map((name) => name.textContent),
    );
  await expect.poll(cut).toEqual([]);
  await picture(page, "four-actors");
  const sample = await page.evaluate(() => window.dynaskinDemo?.samples.at(-1));
  const [linear = 0, own = 0, springs = 0, truth = 0] = sample?.heightMm ?? [];
  expect(linear).toBe(0);
  expect(new Set([own, springs, truth]).size).toBe(3);
  expect(sample?.errorMm[3]).toBe(0);
  await fourth.selectOption({ label: "Nobody" });
  await expect(names).toHaveCount(3);
  await page.setViewportSize({ width: 390, height: 844 });
  await expect(names).toHaveText(["Linear skinning", "dynaskin"]);
  await picture(page, "two-on-a-phone");
});

test("a finger moves the divider", async ({ browser }) => {
  const context = await browser.newContext({
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  const page = await context.newPage();
  await openDemo(page, "?paused=1&view=wipe");
  const divider = page.getByRole("slider", { name: "Divider between the two actors" });
  const devtools = await context.newCDPSession(page);
  await devtools.send("Input.dispatchTouchEvent", {
    type: "touchStart",
    touchPoints: [{ x: 195, y: 300 }],
  });
  for (const x of [220, 260, 292.5]) {
    await devtools.send("Input.dispatchTouchEvent", {
      type: "touchMove",
      touchPoints: [{ x, y: 310 }],
    });
  }
  await devtools.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await expect(divider).toHaveAttribute("aria-valuenow", "75");
  await divider.press("ArrowLeft");
  await expect(divider).toHaveAttribute("aria-valuenow", "73");
  expect(await page.evaluate(() => [scrollX, scrollY])).toEqual([0, 0]);
  await context.close();
});
