// The page with dynaskin's own renderer, and the program in docs/renderer.md.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { expectTissue, openExample } from "./examples.js";
import { REPOSITORY_URL, ROOT } from "./places.js";
import { differing, type Picture, picture, variation, within } from "./support.js";

const ALL = { x: 0, y: 0, width: 1, height: 1 };
const GUIDE = readFileSync(join(ROOT, "docs", "renderer.md"), "utf8");
const EXAMPLE = readFileSync(join(ROOT, "web", "examples", "renderer", "main.ts"), "utf8");

/** The program of the guide in a language that contains a piece of code. */
function programIn(language: string, piece: string): string {
  const programs = GUIDE.matchAll(new RegExp(`\`\`\`${language}\n(.*?)\`\`\``, "gs"));
  for (const [, code = ""] of programs) if (code.includes(piece)) return code;
  throw new Error(`docs/renderer.md has no program in ${language} with ${piece}.`);
}

/** Where in the picture there is skin, the only warm colour: its share, and the box around it. */
function bodyIn(image: Picture): { share: number; box: [number, number, number, number] } {
  const box: [number, number, number, number] = [image.width, image.height, 0, 0];
  let [count, all] = [0, 0];
  for (const at of within(image, ALL)) {
    all += 1;
    const [red = 0, , blue = 0] = image.data.subarray(at, at + 3);
    if (red - blue < 24) continue;
    count += 1;
    const [x, y] = [(at / 4) % image.width, Math.floor(at / 4 / image.width)];
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x);
    box[3] = Math.max(box[3], y);
  }
  return { share: count / all, box };
}

/** From hands to toes a person is inside the picture and fills a good part of it. */
function expectBody(image: Picture): void {
  const { share, box } = bodyIn(image);
  console.log(`body: ${(share * 100).toFixed(1)} % of the picture, in ${box}`);
  expect(share).toBeGreaterThan(0.02);
  expect(share).toBeLessThan(0.3);
  expect(box[0]).toBeGreaterThan(4);
  expect(box[1]).toBeGreaterThan(4);
  expect(box[2]).toBeLessThan(image.width - 4);
  expect(box[3]).toBeLessThan(image.height - 4);
  expect((box[3] - box[1]) / (box[2] - box[0])).toBeGreaterThan(1.1);
}

const canvasSize = (page: Page) =>
  page.evaluate(() => {
    const { width, height } = document.querySelector("canvas") as HTMLCanvasElement;
    return [width, height];
  });

test("dynaskin's own renderer", async ({ page }) => {
  await expectTissue(page, "renderer/?backend=webgl2", "renderer");
  await page.locator("#note").evaluate((note) => note.remove());
  expectBody(await picture(page, "example-renderer-body"));

  await test.step("the picture follows the window", async () => {
    await page.setViewportSize({ width: 500, height: 700 });
    await expect.poll(() => canvasSize(page)).toEqual([500, 700]);
    expectBody(await picture(page, "example-renderer-narrow"));
  });

  await test.step("it comes back after a loss of the graphics card", async () => {
    const before = await picture(page, "example-renderer-before-loss");
    const extension = await page.evaluateHandle(() => {
      const canvas = document.querySelector("canvas") as HTMLCanvasElement;
      const found = canvas.getContext("webgl2")?.getExtension("WEBGL_lose_context");
      if (!found) throw new Error("no WEBGL_lose_context");
      found.loseContext();
      return found;
    });
    await expect(page.getByRole("alert")).toBeVisible();
    await extension.evaluate((found) => found.restoreContext());
    await expect(page.getByRole("alert")).toBeHidden();
    const after = await picture(page, "example-renderer-after-loss");
    expect(differing(before, after, 12, ALL)).toBeLessThan(0.002);
  });
});

test("a view that closes frees everything and stays silent", async ({ page }) => {
  await openExample(page, "renderer/?backend=webgl2");
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => {
    if (message.type() === "error") problems.push(message.text());
  });
  await page.evaluate(() => window.dynaskinExample?.dispose?.());
  const code = await page.evaluate(() => {
    try {
      return window.dynaskinExample?.avatar.offsets.length;
    } catch (error) {
      return (error as { code?: string }).code;
    }
  });
  expect(code).toBe("disposed");
  await page.setViewportSize({ width: 640, height: 480 });
  await page.waitForTimeout(500);
  expect(problems).toEqual([]);
});

test("the program of the guide runs as it stands", async ({ page }) => {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => {
    if (message.type() === "error") problems.push(message.text());
  });
  const imports = {
    dynaskin: "/web/sdk/dist/index.js",
    "dynaskin/renderer": "/web/sdk/dist/renderer.js",
  };
  const head = `<!doctype html><title>guide</title><link rel="icon" href="data:,"><style>body { margin: 0 }</style>
    <script type="importmap">${JSON.stringify({ imports })}</script>`;
  await page.route("**/guide", (route) =>
    route.fulfill({ contentType: "text/html", body: head + programIn("html", "createRenderer(") }),
  );
  await page.goto(`${REPOSITORY_URL}/guide`);
  await expect
    .poll(async () => variation(await picture(page, "guide-renderer"), ALL), { timeout: 120_000 })
    .toBeGreaterThan(20);
  expectBody(await picture(page, "guide-renderer"));
  expect(problems).toEqual([]);
});

test("what the guide says about a loss is the example's, which compiles", () => {
  const lines = programIn("ts", "renderer.recover()").trim();
  expect(EXAMPLE).toContain(lines);
});
