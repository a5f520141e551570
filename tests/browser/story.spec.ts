// What the page begins with: a body close by that lands, and the chapters after it.
import { mkdirSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { PICTURES } from "./places.js";
import { differing, openAddress, openDemo, picture, test, variation } from "./support.js";

/** One picture of the story's own clock, so that a slow machine measures the same. */
const PICTURE_SECONDS = 1 / 60;

/** Starts the story's loop again and plays it with a clock of the test's own; what it was at each picture. */
function play(page: Page, seconds: number) {
  return page.evaluate(
    ([pictures, step]) => {
      const demo = window.dynaskinDemo;
      if (!demo) throw new Error("the page has no demo");
      const seen = [];
      demo.restartStory();
      for (let idx = 0; idx < (pictures ?? 0); idx += 1) {
        demo.advanceStory(step ?? 0);
        const heightM = demo.avatar?.skinMatrices[13] ?? Number.NaN;
        const offsets = demo.avatar?.offsets ?? new Float32Array();
        seen.push({
          ...{ seconds: (idx + 1) * (step ?? 0), motionSeconds: demo.timeSeconds },
          ...{ gapPx: demo.gapPx, heightM, round: demo.rounds },
          offsetM: Math.hypot(...offsets),
        });
      }
      return seen;
    },
    [Math.round(seconds / PICTURE_SECONDS), PICTURE_SECONDS],
  );
}

test("the first landing comes within a second, and shows 15 pixels of tissue", async ({ page }) => {
  await page.setViewportSize({ width: 1280, height: 720 });
  const problems = await openAddress(page, "/");
  await expect(page.locator("#panel")).toBeHidden();
  await expect(page.getByRole("heading", { name: "Bodies are soft." })).toBeVisible();
  const seen = await play(page, 4);
  const top = seen.findIndex(({ heightM }, idx) => heightM > (seen[idx + 1]?.heightM ?? heightM));
  const bottom = seen.findIndex(
    ({ heightM }, idx) => idx > top && heightM < (seen[idx + 1]?.heightM ?? heightM),
  );
  // From the top of the first flight to the deepest point after it, and a little on.
  const landing = seen.slice(top, bottom + 15);
  const most = landing.reduce((best, each) => (each.gapPx > best.gapPx ? each : best));
  console.log(
    `first landing: deepest after ${seen[bottom]?.seconds.toFixed(2)} s, ${most.gapPx.toFixed(1)} px ` +
      `after ${most.seconds.toFixed(2)} s`,
  );
  expect(seen[bottom]?.seconds).toBeLessThan(1);
  expect(most.gapPx).toBeGreaterThan(15);
  expect(most.seconds).toBeLessThan(4);
  expect(
    variation(await picture(page, "story-look"), { x: 0.35, y: 0.15, width: 0.3, height: 0.6 }),
  ).toBeGreaterThan(12);
  expect(problems).toEqual([]);
});

test("the loop has no seam, and its later landings are slow", async ({ page }) => {
  await openAddress(page, "/");
  const seen = await play(page, 9);
  const starts = seen.filter(({ round }, idx) => round > (seen[idx - 1]?.round ?? 0));
  const [second, third] = starts.map(({ seconds }) => seconds);
  expect((third ?? 0) - (second ?? 0)).toBeGreaterThan(2.6);
  expect((third ?? 0) - (second ?? 0)).toBeLessThan(3.4);
  // From picture to picture nothing moves farther at the seam than it does elsewhere.
  const steps = seen.slice(1).map(({ offsetM, heightM, round }, idx) => ({
    isSeam: round !== seen[idx]?.round,
    risenM: Math.abs(heightM - (seen[idx]?.heightM ?? 0)),
    changeM: Math.abs(offsetM - (seen[idx]?.offsetM ?? 0)),
  }));
  for (const of of ["risenM", "changeM"] as const) {
    const largest = Math.max(...steps.filter(({ isSeam }) => !isSeam).map((step) => step[of]));
    for (const seam of steps.filter(({ isSeam }) => isSeam)) expect(seam[of]).toBeLessThan(largest);
  }
});

test("the divider moves by itself until it is touched", async ({ page }) => {
  await openAddress(page, "/?resolution=full");
  const divider = page.getByRole("slider", { name: "Divider between the two actors" });
  const place = async () => Number(await divider.getAttribute("aria-valuenow"));
  await expect.poll(place, { timeout: 120_000 }).not.toBe(50);
  await divider.focus();
  await page.keyboard.press("Home");
  expect(await place()).toBe(0);
  await page.waitForTimeout(3000);
  expect(await place()).toBe(0);
});

for (const [width, height] of [
  [1280, 720],
  [390, 844],
] as const) {
  test(`the names of bodies that jump leave their faces free, ${width}×${height}`, async ({
    page,
  }) => {
    await page.setViewportSize({ width, height });
    await openAddress(page, "/?chapter=bodies");
    const gapsPx = await page.evaluate(() => {
      const demo = window.dynaskinDemo;
      if (!demo) throw new Error("the page has no demo");
      demo.restartStory();
      // A round of the jump, with its flight.
      return Array.from({ length: 18 }, () => {
        for (let tick = 0; tick < 6; tick += 1) demo.advanceStory(1 / 60);
        demo.draw();
        const names = [...document.querySelectorAll("#names .name")];
        return demo.bodiesPx.map(
          ({ top }, idx) => top - (names[idx]?.getBoundingClientRect().bottom ?? Number.NaN),
        );
      }).flat();
    });
    expect(gapsPx.length).toBe(18 * (width > 1000 ? 5 : 3));
    console.log(`names are ${Math.min(...gapsPx).toFixed(0)} px over heads at least`);
    expect(Math.min(...gapsPx)).toBeGreaterThan(0);
  });
}

test("the whole story by keyboard", async ({ page }) => {
  await page.emulateMedia({ reducedMotion: "reduce" });
  await openAddress(page, "/?resolution=full");
  const chapter = (name: string) => page.getByRole("button", { name, exact: true });
  await chapter("Measure").press("Enter");
  await expect(page).toHaveURL(/\?.*chapter=ghost/);
  await expect(page.locator("#ghost-text")).toContainText(/chest \d+ mm, belly \d+ mm/);
  await chapter("Five bodies").press("Enter");
  await expect(page.locator("#names .name")).toHaveCount(5);
  await expect(page.locator("#names .name span").first()).toHaveText("48 kg");
  await chapter("Grab it").press("Enter");
  await expect(page.locator("#names .name")).toHaveCount(1);
  const ring = page.getByRole("button", { name: "Pelvis" });
  const before = await page.evaluate(() => window.dynaskinDemo?.avatar?.skinMatrices[13] ?? 0);
  await ring.focus();
  await page.keyboard.down("ArrowUp");
  await expect
    .poll(() => page.evaluate(() => window.dynaskinDemo?.avatar?.skinMatrices[13] ?? 0))
    .toBeGreaterThan(before + 0.02);
  await page.keyboard.up("ArrowUp");
  await page.keyboard.press("Escape");
  await chapter("Share").press("Enter");
  await expect(page.getByRole("dialog", { name: "Share" })).toBeVisible();
  await page.keyboard.press("Escape");
  await chapter("Lab").press("Enter");
  await expect(page.locator("#panel")).toBeVisible();
  await page.locator("#lab-share").press("Enter");
  await expect(page.getByRole("dialog", { name: "Share" })).toBeVisible();
  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "Back to the story" }).press("Enter");
  await expect(page.locator("#panel")).toBeHidden();
  await expect(page).not.toHaveURL(/lab|chapter|motion/);
});

test("a visitor who asked for less motion sees a pair that stands still at the landing", async ({
  page,
}) => {
  await page.emulateMedia({ reducedMotion: "reduce" });
  await page.setViewportSize({ width: 1280, height: 720 });
  await openAddress(page, "/");
  await expect(page.getByText("your system asks for less motion").first()).toBeVisible();
  expect(await page.evaluate(() => window.dynaskinDemo?.gapPx ?? 0)).toBeGreaterThan(15);
  const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds ?? 0);
  const before = await time();
  await page.waitForTimeout(1000);
  expect(await time()).toBe(before);
  await picture(page, "story-less-motion");
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await expect.poll(time).not.toBe(before);
});

test("on a phone the names stand over the text, however long it is", async ({ page }) => {
  await page.setViewportSize({ width: 390, height: 844 });
  for (const reducedMotion of ["reduce", "no-preference"] as const) {
    await page.emulateMedia({ reducedMotion });
    await openAddress(page, "/");
    await expect(page.locator("#story-still")).toBeVisible({ visible: reducedMotion === "reduce" });
    const textTopPx = (await page.locator(".story-text").boundingBox())?.y ?? 0;
    const names = await page.locator(".wipe .name").all();
    expect(names).toHaveLength(2);
    for (const name of names) {
      const box = await name.boundingBox();
      expect((box?.y ?? 0) + (box?.height ?? Number.NaN)).toBeLessThanOrEqual(textTopPx);
      expect(box?.y).toBeGreaterThan(400);
    }
  }
});

test("on a phone no name is cut by the edge while the divider moves", async ({ page }) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await openAddress(page, "/");
  const seen = await page.evaluate(() => {
    const demo = window.dynaskinDemo;
    if (!demo) throw new Error("the page has no demo");
    demo.restartStory();
    return Array.from({ length: 50 }, () => {
      for (let picture = 0; picture < 5; picture += 1) demo.advanceStory(1 / 60);
      demo.draw();
      const { scrollWidth } = document.documentElement;
      if (scrollWidth > innerWidth) throw new Error(`the page is ${scrollWidth} px wide`);
      const names = [...document.querySelectorAll(".wipe .name")].map((name) => {
        const { left, right } = name.getBoundingClientRect();
        return {
          isShown: !name.classList.contains("cut"),
          isWhole: left >= 0 && right <= innerWidth,
        };
      });
      return names;
    });
  });
  expect(seen.flat().filter(({ isShown, isWhole }) => isShown && !isWhole)).toEqual([]);
  // One of the two is always there, and each goes away once.
  expect(seen.every((names) => names.some(({ isShown }) => isShown))).toBe(true);
  for (const side of [0, 1]) expect(seen.some((names) => !names[side]?.isShown)).toBe(true);
});

test("below the picture: papers, results, licence and how to cite", async ({ page }) => {
  await page.emulateMedia({ reducedMotion: "reduce" });
  await openAddress(page, "/?resolution=full");
  await page.getByRole("link", { name: "How to cite" }).click();
  await expect(page.getByText("@software{dynaskin")).toBeInViewport();
  await page.locator("#below-code").click();
  await expect(page.locator("#code-text")).toBeVisible();
  await page.keyboard.press("Escape");
  const table = page.getByRole("table");
  await expect(table.getByRole("row")).toHaveCount(8);
  await expect(table.getByRole("rowheader", { name: /^dynaskin/ })).toBeVisible();
  const card = await page.request.get(
    (await page.getByRole("link", { name: "female" }).getAttribute("href")) ?? "",
  );
  expect(card.ok()).toBe(true);
});

test("share: a picture, a link and a program", async ({ page }) => {
  await page.emulateMedia({ reducedMotion: "reduce" });
  await page.setViewportSize({ width: 420, height: 360 });
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await openAddress(page, "/?chapter=grab");
  const share = page.getByRole("dialog", { name: "Share" });
  const open = () => page.getByRole("button", { name: "Share", exact: true }).click();
  await open();
  await share.getByRole("button", { name: "Close" }).click();
  await expect(share).toBeHidden();
  await open();
  await page.locator("#share-link").click();
  const link = await page.evaluate(() => navigator.clipboard.readText());
  expect(link).toMatch(/\/\?chapter=grab$/);
  await open();
  await page.locator("#share-code").click();
  await expect(page.locator("#code-text")).toBeVisible();
  await page.keyboard.press("Escape");
  await open();
  const png = page.waitForEvent("download");
  await page.locator("#share-picture").click();
  expect((await png).suggestedFilename()).toBe("dynaskin.png");
});

/** How much of the film's pictures differ, and how much the middle of each fifth of the first varies. */
interface Film {
  name: string;
  bytes: number;
  sizePx: number[];
  seconds: number;
  moved: number;
  fifths: number[];
}

/** Saves the film that the dialog offers, which is open. */
async function saveFilm(page: Page): Promise<Film> {
  const film = page.waitForEvent("download", { timeout: 800_000 });
  await page.locator("#share-clip").click();
  const saved = await film;
  const name = saved.suggestedFilename();
  const path = join(PICTURES, `film-${Date.now()}-${name}`);
  mkdirSync(PICTURES, { recursive: true });
  await saved.saveAs(path);
  const bytes = await readFile(path);
  const seen = await page.evaluate(
    async ([base64, type]) => {
      const video = document.createElement("video");
      video.src = `data:${type};base64,${base64}`;
      await new Promise((done, fail) => {
        video.onloadeddata = done;
        video.onerror = () => fail(new Error("the film cannot be played"));
      });
      const canvas = new OffscreenCanvas(video.videoWidth, video.videoHeight);
      const context = canvas.getContext("2d", { willReadFrequently: true });
      if (!context) throw new Error("no 2D canvas");
      const greens = async (seconds: number, x: number, width: number) => {
        if (video.currentTime !== seconds) {
          const sought = new Promise((done) => {
            video.onseeked = done;
          });
          video.currentTime = seconds;
          await sought;
        }
        context.drawImage(video, 0, 0);
        const { data } = context.getImageData(x, 0.4 * canvas.height, width, 0.2 * canvas.height);
        return data.filter((_, at) => at % 4 === 1);
      };
      const fifths: number[] = [];
      for (let idx = 0; idx < 5; idx += 1) {
        const strip = await greens(0.1, (idx * canvas.width) / 5, canvas.width / 5);
        fifths.push(Math.max(...strip) - Math.min(...strip));
      }
      const before = await greens(0.1, 0, canvas.width);
      const after = await greens(0.5, 0, canvas.width);
      const moved = before.filter((value, at) => Math.abs(value - (after[at] ?? 0)) > 12).length;
      return {
        sizePx: [video.videoWidth, video.videoHeight],
        seconds: video.duration,
        ...{ moved: moved / before.length, fifths },
      };
    },
    [bytes.toString("base64"), name.replace(/.*\./, "video/")],
  );
  return { name, bytes: bytes.length, ...seen };
}

test("a film has all five bodies and moves, also where the page stands still", async ({ page }) => {
  // 120 pictures, drawn and encoded in software.
  test.slow();
  await page.emulateMedia({ reducedMotion: "reduce" });
  await page.setViewportSize({ width: 1000, height: 400 });
  await openAddress(page, "/?chapter=bodies");
  const before = await page.evaluate(() => window.dynaskinDemo?.timeSeconds);
  await page.getByRole("button", { name: "Share", exact: true }).click();
  const { name, bytes, sizePx, seconds, fifths, moved } = await saveFilm(page);
  console.log(`film: ${name}, ${bytes} bytes, ${sizePx.join(" × ")}, ${seconds} s`);
  console.log(`fifths vary by ${fifths.join(", ")}; ${(100 * moved).toFixed(1)} % moved`);
  if (name.endsWith(".mp4")) {
    expect(sizePx).toEqual([720, 720]);
    expect(seconds).toBeCloseTo(4, 1);
  }
  for (const fifth of fifths) expect(fifth).toBeGreaterThan(40);
  expect(moved).toBeGreaterThan(0.02);
  // And the page is as it was.
  await expect(page.getByRole("button", { name: "Play", exact: true })).toBeVisible();
  await expect.poll(() => page.evaluate(() => window.dynaskinDemo?.timeSeconds)).toBe(before);
  const { width } = (await page.locator("#view").boundingBox()) ?? {};
  expect(width).toBe(1000);
});

test("the body is plaster, or skin and cloth", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&motion=jump");
  await page.evaluate(() => window.dynaskinDemo?.seek(0.2));
  const plaster = await picture(page, "look-plaster");
  await page.getByText("Skin and cloth").click();
  await expect(page).toHaveURL(/look=skin/);
  const skin = await picture(page, "look-skin");
  expect(differing(plaster, skin)).toBeGreaterThan(0.1);
  await page.getByText("Sculpture").click();
  await expect(page).not.toHaveURL(/look=/);
  expect(differing(plaster, await picture(page, "look-plaster-again"))).toBeLessThan(0.01);
});

const SIZES = [
  ["laptop", 1440, 900],
  ["tablet", 768, 1024],
  ["phone", 390, 844],
  ["phone-across", 844, 390],
] as const;

for (const colorScheme of ["light", "dark"] as const) {
  test(`the story fits laptop, tablet and phone, ${colorScheme}`, async ({ page }) => {
    await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
    await openAddress(page, "/");
    for (const [size, width, height] of SIZES) {
      await page.setViewportSize({ width, height });
      for (const chapter of ["Five bodies", "Measure", "Compare"]) {
        await page.getByRole("button", { name: chapter, exact: true }).click();
        const isNarrow = size === "tablet" || size === "phone";
        const count = chapter !== "Five bodies" ? 0 : isNarrow ? 3 : 5;
        await expect(page.locator("#names .name")).toHaveCount(count);
        await page.waitForTimeout(500);
        await picture(
          page,
          `story-${size}-${colorScheme}-${chapter.toLowerCase().replace(" ", "-")}`,
        );
        const wide = await page.evaluate(() => document.documentElement.scrollWidth);
        expect(wide).toBeLessThanOrEqual(width);
        for (const id of ["story-play", "chapter-look", "chapter-grab", "story-lab"]) {
          const box = await page.locator(`#${id}`).boundingBox();
          expect(box?.x).toBeGreaterThanOrEqual(0);
          expect((box?.x ?? 0) + (box?.width ?? 0)).toBeLessThanOrEqual(width);
          expect((box?.y ?? 0) + (box?.height ?? 0)).toBeLessThanOrEqual(height);
        }
      }
    }
  });
}
