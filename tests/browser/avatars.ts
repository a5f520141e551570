import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import type { BindingReport } from "dynaskin/three";
import { openModules } from "./modules.js";
import { PICTURES } from "./places.js";

/** What `bindAndPlay` in avatar/stage.js gives. */
interface Played {
  report: BindingReport;
  told: number;
  bindMs: number;
  largestM: number;
  isGivenBack: boolean;
  moved: number;
  left: number;
  pictures: Record<string, string>;
}

/** An avatar with a mesh and bones of its own is bound in a worker, moves, and is given back. */
export async function expectTissue(
  page: Page,
  engine: "three" | "babylon",
  webgpu: boolean,
): Promise<void> {
  const problems = await openModules(page, "avatar");
  const played = (await page.evaluate(
    async ([name, gpu]) => {
      const module = await import(`${location.origin}/tests/browser/avatar/${name}.js`);
      return name === "three" ? module.playInThree(gpu) : module.playInBabylon();
    },
    [engine, webgpu] as const,
  )) as Played;
  mkdirSync(PICTURES, { recursive: true });
  for (const [name, url] of Object.entries(played.pictures)) {
    const png = Buffer.from(url.replace(/^data:image\/png;base64,/, ""), "base64");
    const renderer = webgpu ? "webgpu" : "webgl";
    writeFileSync(join(PICTURES, `avatar-${engine}-${renderer}-${name}.png`), png);
  }
  const percent = (share: number) => `${(share * 100).toFixed(2)} %`;
  console.log(
    `${engine}: bound in ${played.bindMs.toFixed(0)} ms, offsets to ${(1000 * played.largestM).toFixed(1)} mm, ` +
      `of the picture differ ${percent(played.moved)} with tissue, ${percent(played.left)} after it`,
  );
  expect(problems).toEqual([]);
  expect(played.report.shareClose).toBeGreaterThan(0.98);
  expect(played.told).toBeGreaterThan(5);
  expect(played.largestM).toBeGreaterThan(0.005);
  expect(played.moved).toBeGreaterThan(0.003);
  expect(played.left).toBe(0);
  expect(played.isGivenBack).toBe(true);
}
