import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import { openModules } from "./modules.js";
import { PICTURES } from "./places.js";

/** What `compareMToon` in avatar/mtoon.js gives. */
interface MToon {
  looks: Record<string, { moved: number; wrong?: number; left: number }>;
  pictures: Record<string, string>;
  refused?: string;
  isGivenBack: boolean;
  meshes: number;
  kinds: { type: string; name: string; isOutline: boolean }[];
}

/** Surfaces and outlines of MToon take the tissue, in every way of writing that the renderer has. */
export async function expectMToon(page: Page, webgpu: boolean): Promise<void> {
  const problems = await openModules(page, "mtoon", {
    "three/tsl": "/tests/browser/avatar/tsl-of-mtoon.js",
  });
  const found = (await page.evaluate(
    async (gpu) =>
      (await import(`${location.origin}/tests/browser/avatar/mtoon.js`)).compareMToon(gpu),
    webgpu,
  )) as MToon;
  const { looks, pictures, ...rest } = found;
  mkdirSync(PICTURES, { recursive: true });
  for (const [name, url] of Object.entries(pictures)) {
    const png = Buffer.from(url.replace(/^data:image\/png;base64,/, ""), "base64");
    writeFileSync(join(PICTURES, `mtoon-${webgpu ? "webgpu" : "webgl"}-${name}.png`), png);
  }
  console.log(JSON.stringify({ looks, ...rest }));
  expect(problems).toEqual([]);
  expect(rest.kinds.map(({ isOutline }) => isOutline)).toEqual([false, true]);
  for (const [look, { moved, wrong = 0, left }] of Object.entries(looks)) {
    // An outline is a few pixels wide.
    expect(moved, look).toBeGreaterThan(look.startsWith("outline") ? 0.0005 : 0.002);
    expect(wrong, look).toBeLessThan(0.0002);
    expect(left, look).toBe(0);
  }
  expect(rest.isGivenBack).toBe(true);
  if (webgpu) expect(rest.refused).toMatch(/^argument: .*Leave write out/);
}
