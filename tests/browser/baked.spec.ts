// The baked loop that the page plays before its renderer, body and networks are there.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import { mix, readBaked } from "../../web/demo/src/baked/file.js";
import type {} from "../../web/demo/src/hook.js";
import { ROOT } from "./places.js";
import { differing, openAddress, picture, test, variation } from "./support.js";

const FOLDER = join(ROOT, "web", "demo", "src", "baked");
const SIZES = [
  ["laptop", 1280, 720],
  ["tablet", 820, 1180],
  ["phone", 390, 844],
] as const;
/** What the page shows in a picture of the display. */
interface Moment {
  nowMs: number;
  bakedSeconds: number | null;
  liveSeconds: number | null;
}

/** Where the trunk is, in shares of the picture. */
const TRUNK = { x: 0.36, y: 0.12, width: 0.28, height: 0.6 };
/** Where only the backdrop is. */
const CORNER = { x: 0.94, y: 0.02, width: 0.06, height: 0.1 };
/** Everything that only the live picture has is hidden. */
const ALONE = "body > *:not(.stage), .wipe, .names { visibility: hidden !important }";

/** Keeps files away until it is called; by default WebAssembly. */
async function hold(page: Page, files = /\.wasm$/): Promise<() => void> {
  let release = () => {};
  const held = new Promise<void>((done) => {
    release = done;
  });
  await page.route(files, async (route) => {
    await held;
    await route.continue();
  });
  return release;
}

const marks = (page: Page) =>
  page.evaluate(() => performance.getEntriesByName("dynaskin: the body moves").length);
const isReady = (page: Page) => page.evaluate(() => window.dynaskinDemo?.ready ?? false);
const isOn = (page: Page) =>
  page.evaluate(() => document.documentElement.classList.contains("baked-on"));

for (const colorScheme of ["light", "dark"] as const) {
  for (const [size, width, height] of SIZES) {
    test(`it stands where the live body stands, in the same light, ${size}, ${colorScheme}`, async ({
      page,
    }) => {
      // Both stand still at the landing then.
      await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
      await page.setViewportSize({ width, height });
      const release = await hold(page);
      await page.goto("/");
      await expect.poll(() => isOn(page), { timeout: 60_000 }).toBe(true);
      expect(await isReady(page)).toBe(false);
      await picture(page, `baked-${size}-${colorScheme}`);
      await page.addStyleTag({ content: ALONE });
      const baked = await picture(page, `baked-${size}-${colorScheme}-alone`);
      await page.waitForTimeout(400);
      const later = await picture(page, `baked-${size}-${colorScheme}-later`);
      expect(differing(baked, later, 0, TRUNK)).toBe(0);
      release();
      await expect.poll(() => isOn(page), { timeout: 120_000 }).toBe(false);
      // A picture that stands gets all its pixels a moment later.
      await page.waitForTimeout(2500);
      const live = await picture(page, `baked-${size}-${colorScheme}-live`);
      const far = differing(baked, live, 24, TRUNK);
      console.log(`${size}, ${colorScheme}: ${(100 * far).toFixed(2)} % of the trunk differ`);
      expect(variation(baked, TRUNK)).toBeGreaterThan(12);
      expect(far).toBeLessThan(0.04);
      expect(differing(baked, live, 8, CORNER)).toBeLessThan(0.02);
      expect(await marks(page)).toBe(0);
    });
  }
}

test("it moves, and the live body goes on at the same moment", async ({ page }) => {
  const release = await hold(page);
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  await page.goto("/");
  await expect.poll(() => isOn(page), { timeout: 60_000 }).toBe(true);
  const early = await picture(page, "baked-early");
  await page.waitForTimeout(700);
  const late = await picture(page, "baked-late");
  expect(differing(early, late, 12, TRUNK)).toBeGreaterThan(0.05);
  await expect(page.getByText("rigid skin", { exact: true })).toBeVisible();
  expect(await marks(page)).toBe(1);
  // What the visitor sees at each picture of the display, until the loop is gone.
  const watched = page.evaluate(
    () =>
      new Promise<Moment[]>((done) => {
        const seen: Moment[] = [];
        const look = (nowMs: number) => {
          const demo = window.dynaskinDemo;
          const bakedSeconds = demo?.bakedSeconds ?? null;
          const liveSeconds = demo?.ready ? demo.timeSeconds : null;
          if (demo) seen.push({ nowMs, bakedSeconds, liveSeconds });
          if (demo?.ready && bakedSeconds === null) done(seen);
          else requestAnimationFrame(look);
        };
        requestAnimationFrame(look);
      }),
  );
  release();
  await expect.poll(() => isOn(page), { timeout: 120_000 }).toBe(false);
  const seen = await watched;
  const first = seen.findIndex(({ liveSeconds }) => liveSeconds !== null);
  const [last, next] = [seen[first - 1], seen[first]];
  expect(last?.bakedSeconds).not.toBeNull();
  const period = await page.evaluate(() => window.dynaskinDemo?.jump.periodSeconds ?? 0);
  const ahead = (next?.liveSeconds ?? 0) - (last?.bakedSeconds ?? 0);
  const passed = ((next?.nowMs ?? 0) - (last?.nowMs ?? 0)) / 1000;
  console.log(`the live body is ${ahead.toFixed(3)} s ahead, ${passed.toFixed(3)} s later`);
  expect((ahead + period) % period).toBeLessThan(Math.min(passed, 0.25) + 0.03);
  expect(await page.evaluate(() => document.querySelector("#baked"))).toBeNull();
  expect(problems).toEqual([]);
});

const LOOP = /loop-(wide|tall)/;
for (const [name, answer] of [
  ["without its file", { status: 404 }],
  ["with a page in the place of its file", { contentType: "text/html", body: "<!doctype html>" }],
] as const) {
  test(`${name} the poster stays until the body is there`, async ({ page }) => {
    await page.route(LOOP, (route) => route.fulfill(answer));
    const release = await hold(page);
    const problems: string[] = [];
    page.on("pageerror", (error) => problems.push(error.message));
    await page.goto("/");
    await expect(page.locator("#baked")).toHaveCount(0);
    await expect(page.locator(".poster img")).toBeVisible();
    release();
    await expect.poll(() => isReady(page), { timeout: 120_000 }).toBe(true);
    await expect(page.locator(".poster img")).toBeHidden();
    expect(problems).toEqual([]);
  });
}

test("a file that comes after the body is not played", async ({ page }) => {
  const release = await hold(page, LOOP);
  const problems = await openAddress(page, "/");
  await expect(page.locator("#baked")).toHaveCount(0);
  release();
  await page.waitForTimeout(500);
  expect(await isOn(page)).toBe(false);
  expect(await marks(page)).toBe(0);
  expect(problems).toEqual([]);
});

test("it ends where the networks cannot be loaded", async ({ page }) => {
  await page.route(/\.lowered$/, (route) => route.fulfill({ status: 404 }));
  const release = await hold(page);
  await page.goto("/");
  await expect.poll(() => isOn(page), { timeout: 60_000 }).toBe(true);
  release();
  await expect(page.getByText(/networks of the female body could not be loaded/)).toBeVisible({
    timeout: 120_000,
  });
  await expect(page.locator("#baked")).toHaveCount(0);
});

test("a tab that is hidden while it loads has the live body when it is seen again", async ({
  page,
}) => {
  // Browsers do not call back hidden tabs.
  await page.addInitScript(() => {
    const now = window.requestAnimationFrame.bind(window);
    const waiting: FrameRequestCallback[] = [];
    let isHidden = false;
    Object.defineProperty(document, "hidden", { get: () => isHidden });
    window.requestAnimationFrame = (call) => (isHidden ? waiting.push(call) : now(call));
    window.addEventListener("test:hidden", () => {
      isHidden = !isHidden;
      for (const call of isHidden ? [] : waiting.splice(0)) now(call);
      document.dispatchEvent(new Event("visibilitychange"));
    });
  });
  const turn = () => page.evaluate(() => window.dispatchEvent(new Event("test:hidden")));
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  const release = await hold(page);
  await page.goto("/");
  await expect.poll(() => isOn(page), { timeout: 60_000 }).toBe(true);
  await turn();
  release();
  await expect.poll(() => isReady(page), { timeout: 120_000 }).toBe(true);
  expect(await isOn(page)).toBe(true);
  await turn();
  await expect(page.locator("#baked")).toHaveCount(0);
  const before = await page.evaluate(() => window.dynaskinDemo?.timeSeconds ?? 0);
  await expect
    .poll(() => page.evaluate(() => window.dynaskinDemo?.timeSeconds ?? 0))
    .not.toBe(before);
  expect(problems).toEqual([]);
});

test("it plays in the story's first view alone", async ({ page }) => {
  const asked: string[] = [];
  page.on("request", (request) => asked.push(request.url()));
  await openAddress(page, "/?lab=1&paused=1");
  expect(asked.filter((url) => /loop-/.test(url))).toEqual([]);
});

test("whoever touches the picture has the live body", async ({ page }) => {
  const release = await hold(page);
  await page.goto("/");
  await expect.poll(() => isOn(page), { timeout: 60_000 }).toBe(true);
  await page.getByRole("button", { name: "Five bodies" }).click({ trial: true });
  await page.locator("#view").focus();
  await page.keyboard.press("ArrowLeft");
  expect(await isOn(page)).toBe(false);
  release();
  await expect.poll(() => isReady(page), { timeout: 120_000 }).toBe(true);
});

for (const name of ["wide", "tall"]) {
  test(`the ${name} file holds a jump whose end is its beginning`, () => {
    const bytes = new Uint8Array(readFileSync(join(FOLDER, `loop-${name}.bin`)));
    const { frames, vertices, triangles, tracks } = readBaked(bytes);
    expect(Math.max(...triangles)).toBe(vertices - 1);
    const heights = (moment: number) => {
      const out = new Float32Array(3 * vertices);
      mix(tracks.places, frames, moment, out);
      return out.subarray(vertices, 2 * vertices);
    };
    const farthest = (a: Float32Array, b: Float32Array) =>
      a.reduce((most, value, idx) => Math.max(most, Math.abs(value - (b[idx] ?? 0))), 0);
    expect(farthest(heights(0), heights(1))).toBe(0);
    // From frame to frame its speed changes no more at the seam than elsewhere.
    const at = (frame: number) => heights(frame / frames);
    const turns = Array.from({ length: frames }, (_, frame) => {
      const [before, now, after] = [at(frame - 1), at(frame), at(frame + 1)];
      return farthest(
        after.map((value, idx) => value - (now[idx] ?? 0)),
        now.map((value, idx) => value - (before[idx] ?? 0)),
      );
    });
    const [first, ...others] = turns;
    expect(Math.max(first ?? 1, others.at(-1) ?? 1)).toBeLessThan(Math.max(...others.slice(0, -1)));
    const tissue = new Float32Array(3 * vertices);
    // At the landing chest and belly are centimetres from where the bones would have them.
    mix(tracks.tissue, frames, 0.4, tissue);
    expect(Math.max(...tissue.map(Math.abs))).toBeGreaterThan(0.015);
    expect(Math.max(...tissue.map(Math.abs))).toBeLessThan(0.1);
  });
}
