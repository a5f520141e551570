import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import { openModules } from "./modules.js";
import { PICTURES } from "./places.js";

/** What `compareShadows` in shadow/stage.js gives. */
interface Shadows {
  moving: number;
  still: number;
  mixedUp: number;
  pictures: { still: string; moving: string };
}

/** The engine's shadow is that of the surface with tissue, and of no other. */
export async function expectShadows(
  page: Page,
  engine: "three" | "babylon",
  webgpu: boolean,
): Promise<void> {
  const problems = await openModules(page, "shadow");
  const shadows = (await page.evaluate(
    async ([name, gpu]) => {
      const module = await import(`${location.origin}/tests/browser/shadow/${name}.js`);
      return name === "three" ? module.compareInThree(gpu) : module.compareInBabylon(gpu);
    },
    [engine, webgpu] as const,
  )) as Shadows;
  mkdirSync(PICTURES, { recursive: true });
  for (const [name, url] of Object.entries(shadows.pictures)) {
    const png = Buffer.from(url.replace(/^data:image\/png;base64,/, ""), "base64");
    const renderer = webgpu ? "webgpu" : "webgl";
    writeFileSync(join(PICTURES, `shadow-${engine}-${renderer}-${name}.png`), png);
  }
  const percent = (share: number) => `${(share * 100).toFixed(2)} %`;
  console.log(
    `${engine}: of the shadow lie beside that of the surface ${percent(shadows.moving)} with tissue, ` +
      `${percent(shadows.still)} without, ${percent(shadows.mixedUp)} of one against the other`,
  );
  expect(problems).toEqual([]);
  expect(shadows.still).toBeLessThan(0.003);
  expect(shadows.moving).toBeLessThan(0.003);
  expect(shadows.mixedUp).toBeGreaterThan(0.006);
}
