import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { test as base, expect, type Page } from "@playwright/test";
import { PICTURES } from "./places.js";

/** What the pages of the tests have; the same as in the configuration. */
const VIEWPORT = { width: 1000, height: 640 };

/** Pages whose settings {@link openDemo} changes, instead of loading them anew. */
const reusedPages = new WeakSet<Page>();

/**
 * `test` with one more page: `reused` is the same for all tests of a lane, and {@link openDemo} changes
 * only its settings. For tests that are about the page as it runs: what happens while it loads, stays after
 * a test (scripts, media, the window's size) or needs the browser's focus (the clipboard) wants a page of
 * its own.
 */
export const test = base.extend<{ reused: Page }, { lane: { page: Page | null } }>({
  lane: [
    // biome-ignore lint/correctness/noEmptyPattern: Playwright reads names of fixtures from here.
    async ({}, use) => {
      const lane: { page: Page | null } = { page: null };
      await use(lane);
      await lane.page?.context().close();
    },
    { scope: "worker" },
  ],
  reused: async ({ lane, browser, baseURL }, use, info) => {
    // In a context of its own: axe opens further pages there.
    const options = { viewport: VIEWPORT, ...(baseURL && { baseURL }) };
    lane.page ??= await (await browser.newContext(options)).newPage();
    const { page } = lane;
    reusedPages.add(page);
    // Tests with pages of their own have pushed it into the background.
    await page.bringToFront();
    await use(page);
    page.removeAllListeners("pageerror");
    page.removeAllListeners("request");
    await page.unrouteAll({ behavior: "ignoreErrors" });
    if (info.status === info.expectedStatus) return;
    lane.page = null;
    await page.context().close();
  },
});

/**
 * Opens the demo and waits until the avatar plays with its networks: one actor that hops, unless the
 * query says otherwise. Gives the list to which the messages of uncaught errors are added from then on.
 */
export async function openDemo(page: Page, query = ""): Promise<string[]> {
  const settings = new URLSearchParams({
    ...{ view: "one", motion: "hop", caption: "0" },
    // The software renderer of a test machine is slow: pictures would lose their pixels.
    resolution: "full",
  });
  for (const [name, value] of new URLSearchParams(query)) settings.set(name, value);
  if (!reusedPages.has(page) || !(await isReady(page))) return openAddress(page, `/?${settings}`);
  return reopen(page, `?${settings}`);
}

const isReady = (page: Page) => page.evaluate(() => window.dynaskinDemo?.ready ?? false);

/** Goes on with other settings in a page that is there, and puts away what else a test may have left. */
async function reopen(page: Page, search: string): Promise<string[]> {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  await page.mouse.move(1, 1);
  await page.evaluate(async (wanted) => {
    for (const dialog of document.querySelectorAll("dialog")) dialog.close();
    for (const details of document.querySelectorAll("details")) details.open = false;
    for (const toast of document.querySelectorAll(".toast")) toast.remove();
    document.querySelector<HTMLInputElement>("input[name=tissue-property][value=gain]")?.click();
    (document.activeElement as HTMLElement | null)?.blur();
    document.getElementById("panel-body")?.scrollTo(0, 0);
    scrollTo(0, 0);
    await window.dynaskinDemo?.open(wanted);
  }, search);
  expect(problems).toEqual([]);
  return problems;
}

/** The same for any address, as a visitor opens it. */
export async function openAddress(page: Page, address: string): Promise<string[]> {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  await page.goto(address);
  await expect
    .poll(
      async () => {
        expect(problems).toEqual([]);
        return page.evaluate(() => window.dynaskinDemo?.ready ?? false);
      },
      { timeout: 120_000 },
    )
    .toBe(true);
  return problems;
}

/** Drops a file on the page as a person would. */
export function dropFile(page: Page, name: string, content: string | Uint8Array): Promise<void> {
  return dropFiles(page, [[name, content]]);
}

/** Drops files on the page together. */
export async function dropFiles(
  page: Page,
  files: readonly (readonly [name: string, content: string | Uint8Array])[],
): Promise<void> {
  await page.evaluate(
    (dropped) => {
      const dataTransfer = new DataTransfer();
      for (const [fileName, base64] of dropped) {
        const file = Uint8Array.from(atob(base64), (char) => char.charCodeAt(0));
        dataTransfer.items.add(new File([file], fileName));
      }
      for (const type of ["dragenter", "dragover", "drop"]) {
        const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
        document.body.dispatchEvent(event);
      }
    },
    files.map(([name, content]) => [name, Buffer.from(content).toString("base64")] as const),
  );
}

/** A picture of the page, kept for a person to look at; decoded to red, green, blue, opacity. */
export async function picture(page: Page, name: string): Promise<Picture> {
  mkdirSync(PICTURES, { recursive: true });
  const png = await page.screenshot({ path: join(PICTURES, `${name}.png`) });
  const pixels = await page.evaluate(async (base64) => {
    const blob = await (await fetch(`data:image/png;base64,${base64}`)).blob();
    const bitmap = await createImageBitmap(blob);
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d");
    if (!context) throw new Error("no 2D canvas");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    let binary = "";
    for (let at = 0; at < data.length; at += 8192) {
      binary += String.fromCharCode(...data.subarray(at, at + 8192));
    }
    return { width: bitmap.width, height: bitmap.height, base64: btoa(binary) };
  }, png.toString("base64"));
  return { ...pixels, data: Buffer.from(pixels.base64, "base64") };
}

/** A decoded picture. */
export interface Picture {
  width: number;
  height: number;
  data: Buffer;
}

/** The part of the page where the body stands on a desktop screen: left of the panel. */
export const STAGE = { x: 0.24, y: 0.05, width: 0.26, height: 0.82 };

/** Visits the pixels of a part of a picture, given as shares of its size. */
export function* within(
  { width, height, data }: Picture,
  part: typeof STAGE = STAGE,
): Generator<number> {
  const [x0, x1] = [part.x * width, (part.x + part.width) * width].map(Math.round);
  const [y0, y1] = [part.y * height, (part.y + part.height) * height].map(Math.round);
  for (let y = y0 ?? 0; y < (y1 ?? 0); y += 1) {
    for (let x = x0 ?? 0; x < (x1 ?? 0); x += 1) {
      const at = (y * width + x) * 4;
      if (at + 2 < data.length) yield at;
    }
  }
}

/** Standard deviation of the brightness, 0 to 255: near 0 for an empty picture. */
export function variation(image: Picture, part = STAGE): number {
  let [count, sum, squares] = [0, 0, 0];
  for (const at of within(image, part)) {
    const grey =
      ((image.data[at] ?? 0) + (image.data[at + 1] ?? 0) + (image.data[at + 2] ?? 0)) / 3;
    count += 1;
    sum += grey;
    squares += grey * grey;
  }
  return Math.sqrt(squares / count - (sum / count) ** 2);
}

/** Share of the pixels that differ by more than `threshold` of 255 in some colour. */
export function differing(a: Picture, b: Picture, threshold = 12, part = STAGE): number {
  expect([a.width, a.height]).toEqual([b.width, b.height]);
  let [count, differ] = [0, 0];
  for (const at of within(a, part)) {
    count += 1;
    const far = [0, 1, 2].some(
      (idx) => Math.abs((a.data[at + idx] ?? 0) - (b.data[at + idx] ?? 0)) > threshold,
    );
    if (far) differ += 1;
  }
  return differ / count;
}
