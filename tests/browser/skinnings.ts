import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import { openModules } from "./modules.js";
import { PICTURES } from "./places.js";

/** What `compareSkinnings` in skinning/stage.js gives. */
interface Skinnings {
  pictures: Record<string, string>;
  wrong: Record<string, number>;
  apart: number;
  readM: number;
}

/** Calls a function of `skinning/`. */
export async function inSkinning(
  page: Page,
  file: string,
  name: string,
  ...args: string[]
): Promise<unknown> {
  const problems = await openModules(page, "skinning");
  const given = await page.evaluate(
    async ([module, fn, values]) =>
      (await import(`${location.origin}/tests/browser/skinning/${module}.js`))[fn](...values),
    [file, name, args] as const,
  );
  expect(problems).toEqual([]);
  return given;
}

/** Skin and shadow are those of the surface that the CPU skins, linear and with dual quaternions. */
export async function expectSkinnings(
  page: Page,
  file: "three" | "babylon" | "renderer",
  name: string,
  ...args: string[]
): Promise<void> {
  const { pictures, wrong, apart, readM } = (await inSkinning(
    page,
    file,
    name,
    ...args,
  )) as Skinnings;
  mkdirSync(PICTURES, { recursive: true });
  for (const [skinning, url] of Object.entries(pictures)) {
    const png = Buffer.from(url.replace(/^data:image\/png;base64,/, ""), "base64");
    writeFileSync(join(PICTURES, `skinning-${[file, ...args, skinning].join("-")}.png`), png);
  }
  console.log(`${file} ${args}: ${JSON.stringify({ wrong, apart, readM })}`);
  expect(wrong.linear).toBeLessThan(0.0005);
  expect(wrong["dual-quaternion"]).toBeLessThan(0.0005);
  expect(apart).toBeGreaterThan(0.003);
  expect(readM).toBeLessThanOrEqual(1e-4);
}
