// The static build from a folder of a plain web server, and what its first view downloads.
import { createReadStream, existsSync, statSync } from "node:fs";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { join, normalize } from "node:path";
import { expect, test } from "@playwright/test";
import { overBudget, PARTS, partOf } from "../../scripts/lib/sizes.mjs";
import type {} from "../../web/demo/src/hook.js";
import { ROOT } from "./places.js";
import { picture, variation } from "./support.js";

const DIST = join(ROOT, "web", "demo", "dist");
const FOLDER = "/some/path/to/dynaskin/";
/** Nothing but what every server knows: no type for WebAssembly, no isolation. */
const TYPES: Record<string, string> = { css: "text/css", html: "text/html", js: "text/javascript" };

/** Serves the build below {@link FOLDER}, and nothing anywhere else. */
async function servePlainly(): Promise<{ server: Server; url: string; paths: string[] }> {
  const paths: string[] = [];
  const server = createServer((request, response) => {
    const { pathname } = new URL(request.url ?? "/", "http://localhost");
    const path = pathname === FOLDER ? `${FOLDER}index.html` : decodeURIComponent(pathname);
    const file = join(DIST, normalize(path.slice(FOLDER.length)));
    const known = path.startsWith(FOLDER) && existsSync(file) && statSync(file).isFile();
    paths.push(known ? path.slice(FOLDER.length) : `404 ${path}`);
    if (!known) {
      response.writeHead(404, { "Content-Type": "text/plain" }).end("not here");
      return;
    }
    const type = TYPES[file.split(".").at(-1) ?? ""] ?? "application/octet-stream";
    response.writeHead(200, { "Content-Type": type });
    createReadStream(file).pipe(response);
  });
  await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
  const { port } = server.address() as AddressInfo;
  return { server, url: `http://127.0.0.1:${port}${FOLDER}`, paths };
}

test("the build works from a sub-path of a plain server", { tag: "@published" }, async ({
  page,
}) => {
  const { server, url, paths } = await servePlainly();
  try {
    const problems: string[] = [];
    page.on("pageerror", (error) => problems.push(error.message));
    await page.goto(url);
    await expect
      .poll(() => page.evaluate(() => window.dynaskinDemo?.ready ?? false), { timeout: 120_000 })
      .toBe(true);
    expect(await page.evaluate(() => crossOriginIsolated)).toBe(false);
    expect(variation(await picture(page, "static-sub-path"))).toBeGreaterThan(12);

    await test.step("its first view loads what the budget counts as that, and no more", () => {
      expect(paths.filter((path) => path.startsWith("404"))).toEqual([]);
      const first = PARTS.filter(({ firstView }) => firstView).map(({ name }) => name);
      expect([...new Set(paths.map(partOf))].toSorted()).toEqual(first.toSorted());
      const files = paths.filter((path) => partOf(path) === "female model").toSorted();
      expect(files).toEqual(
        ["body.glb", "bundle.json", "decoder.lowered", "predictor.lowered"].map(
          (n) => `female/${n}`,
        ),
      );
    });

    await test.step("everything else is found there, too", async () => {
      await page.goto(`${url}?lab=1&paused=1`);
      await page.getByLabel("Second", { exact: true }).selectOption({ label: "Spring bones" });
      await expect(page.locator("#names")).toContainText("Spring bones");
      await page
        .getByRole("combobox", { name: "Motion" })
        .selectOption({ label: "One leg hop, simulated" });
      await expect(page.locator("#now-playing")).toContainText("One leg hop, simulated");
      expect(paths.some((path) => partOf(path) === "compared methods")).toBe(true);
      expect(paths.some((path) => partOf(path) === "clips")).toBe(true);
      expect(paths.filter((path) => path.startsWith("404"))).toEqual([]);
    });

    await test.step("a preview of its link has a picture", async () => {
      const image = page.locator('meta[property="og:image"]');
      const address = new URL((await image.getAttribute("content")) ?? "", page.url()).href;
      const sizePx = await page.evaluate(async (src) => {
        const poster = new Image();
        poster.src = src;
        await poster.decode();
        return [poster.naturalWidth, poster.naturalHeight];
      }, address);
      // What previews ask for.
      expect(Math.min(...sizePx)).toBeGreaterThanOrEqual(600);
    });
    expect(problems).toEqual([]);
  } finally {
    server.closeAllConnections();
    server.close();
  }
});

test("a part that grew, and a budget that fits no part, are told", () => {
  const sizes = { js: { raw: 300_000, brotli: 90_000 }, css: { raw: 9_000, brotli: 2_000 } };
  expect(overBudget(sizes, { js: 90, css: 2 })).toEqual([]);
  expect(overBudget(sizes, { js: 89, css: 2 })).toEqual(["js has 90 kB, the budget is 89 kB"]);
  expect(overBudget(sizes, { js: 90 })).toEqual(["css has no budget"]);
  expect(overBudget(sizes, { js: 90, css: 2, icons: 1 })).toEqual([
    "the budget names icons, which is no part of the build",
  ]);
});
