// The demo page in Firefox, driven over WebDriver BiDi. Playwright drives only its own build of
// Firefox, and newer ones than Debian's: puppeteer-core takes the installed one.
import { join } from "node:path";
import puppeteer, { type Browser, type Page } from "puppeteer-core";
import { type PreviewServer, preview } from "vite";
import { afterAll, beforeAll, beforeEach, describe, expect, it } from "vitest";
import type {} from "../../web/demo/src/hook.js";
import { DEMO_URL, ROOT } from "../browser/places.js";
import { hopGlb } from "../hop-files.js";

/** scripts/test.mjs sets it. */
const executablePath = process.env.FIREFOX ?? "/usr/bin/firefox-esr";
/** Without a graphics card Firefox draws WebGL2 in software only when it is told to. */
const SOFTWARE = { "webgl.force-enabled": true, "gfx.webrender.software": true };

let server: PreviewServer;
let browser: Browser;
let page: Page;
let problems: string[] = [];

beforeAll(async () => {
  server = await preview({
    root: join(ROOT, "web", "demo"),
    preview: { port: Number(new URL(DEMO_URL).port), strictPort: true },
  });
  browser = await puppeteer.launch({
    browser: "firefox",
    executablePath,
    headless: false,
    extraPrefsFirefox: SOFTWARE,
  });
});
afterAll(async () => {
  await browser?.close();
  await server?.close();
});
beforeEach(async () => {
  await page?.close();
  page = await browser.newPage();
  problems = [];
  page.on("pageerror", (error) =>
    problems.push(error instanceof Error ? error.message : `${error}`),
  );
  await page.setViewport({ width: 1000, height: 640 });
});

const ready = () => page.waitForFunction(() => window.dynaskinDemo?.ready, { timeout: 90_000 });
const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds ?? Number.NaN);

async function open(query: string): Promise<void> {
  await page.goto(`${DEMO_URL}?view=one&motion=hop&resolution=full&${query}`);
  await ready();
}

/** Mean brightness and its standard deviation over the middle of the body, 0 to 255. */
async function brightness(): Promise<{ mean: number; deviation: number }> {
  const base64 = await page.screenshot({ encoding: "base64" });
  return page.evaluate(async (png) => {
    const blob = await (await fetch(`data:image/png;base64,${png}`)).blob();
    const bitmap = await createImageBitmap(blob);
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d");
    if (!context) throw new Error("no 2D canvas");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(220, 100, 220, 420);
    const values = Array.from({ length: data.length / 4 }, (_, idx) => {
      const [r = 0, g = 0, b = 0] = data.subarray(idx * 4, idx * 4 + 3);
      return (r + g + b) / 3;
    });
    const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
    const square = values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / values.length;
    return { mean, deviation: Math.sqrt(square) };
  }, base64);
}

describe("the demo in Firefox", () => {
  it("draws a body whose tissue moves", async () => {
    await open("");
    expect(await page.evaluate(() => window.dynaskinDemo?.backend)).toMatch(/^web(gl2|gpu)$/);
    const before = await time();
    await page.waitForFunction((t) => window.dynaskinDemo?.timeSeconds !== t, {}, before);
    const largestM = await page.evaluate(() => {
      const demo = window.dynaskinDemo;
      let size = 0;
      demo?.seek(2);
      for (let tick = 0; tick < 30; tick += 1) {
        demo?.step();
        for (const value of demo?.avatar?.offsets ?? []) size = Math.max(size, Math.abs(value));
      }
      return size;
    });
    expect(largestM).toBeGreaterThan(0.003);
    const { deviation } = await brightness();
    console.log(
      `Firefox: offsets of up to ${(largestM * 1000).toFixed(1)} mm, variation ${deviation}`,
    );
    expect(deviation).toBeGreaterThan(15);
    expect(problems).toEqual([]);
  });

  it("paints the heat map, and obeys keys and sliders", async () => {
    await open("paused=1");
    await page.evaluate(() => window.dynaskinDemo?.seek(2.6));
    const painted = await brightness();
    await page.keyboard.press("m");
    await page.waitForSelector("#legend:not([hidden])");
    await new Promise((resolve) => setTimeout(resolve, 500));
    const heat = await brightness();
    expect(Math.abs(heat.mean - painted.mean)).toBeGreaterThan(3);
    await page.keyboard.press("t");
    await page.waitForSelector("#hud:not([hidden])");
    await page.$eval("#trait-weight", (input) => {
      (input as HTMLInputElement).value = "75";
      input.dispatchEvent(new Event("input", { bubbles: true }));
    });
    expect(await page.evaluate(() => window.dynaskinDemo?.avatar?.shape[1])).toBeGreaterThan(1);
    await page.keyboard.press("d");
    expect(await page.evaluate(() => window.dynaskinDemo?.avatar?.strength)).toBe(0);
    await page.waitForFunction(() =>
      document.getElementById("names")?.textContent?.includes("off: plain skinning"),
    );
    // A radio that was clicked keeps the shortcuts.
    await page.$eval("input[name=clothes][value=unsupported]", (input) => {
      (input as HTMLInputElement).click();
      (input as HTMLInputElement).focus();
    });
    await page.keyboard.press("d");
    expect(await page.evaluate(() => window.dynaskinDemo?.avatar?.strength)).toBe(1);
    expect(problems).toEqual([]);
  });

  it("plays a GLB dropped on the page, and says why a letter is none", async () => {
    await open("");
    const drop = (name: string, bytes: Uint8Array) =>
      page.evaluate(
        (fileName, base64) => {
          const dataTransfer = new DataTransfer();
          const content = Uint8Array.from(atob(base64), (char) => char.charCodeAt(0));
          dataTransfer.items.add(new File([content], fileName));
          for (const type of ["dragenter", "dragover", "drop"]) {
            const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
            document.body.dispatchEvent(event);
          }
        },
        name,
        Buffer.from(bytes).toString("base64"),
      );
    await drop("hop.glb", await hopGlb());
    await page.waitForFunction(() =>
      document.getElementById("now-playing")?.textContent?.includes("hop.glb"),
    );
    await drop("letter.bvh", new TextEncoder().encode("Dear reader"));
    await page.waitForFunction(() =>
      document.querySelector("[role=alert]")?.textContent?.includes("Neither BVH"),
    );
    expect(problems).toEqual([]);
  });

  it("shows four actors and comes back after the graphics context is lost", async () => {
    await page.goto(
      `${DEMO_URL}?resolution=full&third=spring-bones&fourth=casas-otaduy&backend=webgl2`,
    );
    await ready();
    await page.waitForFunction(() => window.dynaskinDemo?.view.bodies.length === 4, {
      timeout: 90_000,
    });
    const extension = await page.evaluateHandle(() => {
      const canvas = document.getElementById("view") as HTMLCanvasElement;
      const found = canvas.getContext("webgl2")?.getExtension("WEBGL_lose_context");
      if (!found) throw new Error("no WEBGL_lose_context");
      found.loseContext();
      return found;
    });
    await page.waitForSelector("#loss");
    await extension.evaluate((found) => found.restoreContext());
    await page.waitForFunction(() => !document.getElementById("loss"), { timeout: 90_000 });
    const before = await time();
    await page.waitForFunction((t) => window.dynaskinDemo?.timeSeconds !== t, {}, before);
    expect((await brightness()).deviation).toBeGreaterThan(5);
    expect(problems).toEqual([]);
  });
});
