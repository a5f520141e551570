import { expect, type Page } from "@playwright/test";
import type {} from "../../web/examples/src/shared/hook.js";
import { EXAMPLES_URL } from "./places.js";
import { differing, picture, variation } from "./support.js";

/** The middle of the window, where an example's body stands. */
const MIDDLE = { x: 0.3, y: 0.1, width: 0.4, height: 0.8 };

/** A moment of the examples' motion at which the tissue is under way. */
const MOMENT_SECONDS = 2.4;

/** Opens an example page and waits until its avatar moves. */
export async function openExample(page: Page, path: string): Promise<void> {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => {
    if (message.type() === "error") problems.push(`${message.text()} (${message.location().url})`);
  });
  await page.goto(EXAMPLES_URL + path);
  await expect
    .poll(
      async () => {
        expect(problems).toEqual([]);
        return page.evaluate(() => window.dynaskinExample !== undefined);
      },
      { timeout: 120_000 },
    )
    .toBe(true);
}

/** Largest offset at this moment, in millimetres. */
export function largestOffsetMm(page: Page): Promise<number> {
  return page.evaluate(() => {
    const offsets = window.dynaskinExample?.avatar.offsets ?? new Float32Array();
    let largest = 0;
    for (let at = 0; at < offsets.length; at += 3) {
      largest = Math.max(
        largest,
        Math.hypot(offsets[at] ?? 0, offsets[at + 1] ?? 0, offsets[at + 2] ?? 0),
      );
    }
    return largest * 1000;
  });
}

/** Draws the moment with the tissue's strength; see the page's hook. */
async function showMoment(page: Page, strength: number): Promise<void> {
  await page.evaluate(
    async ([seconds, factor]) => {
      const example = window.dynaskinExample;
      if (!example) throw new Error("the example is not ready");
      example.avatar.strength = factor;
      example.showMoment(seconds);
      for (let frames = 0; frames < 3; frames += 1) await new Promise(requestAnimationFrame);
    },
    [MOMENT_SECONDS, strength] as const,
  );
}

/** The tissue moves as the page plays, and the picture shows it. */
export async function expectTissue(page: Page, path: string, name: string): Promise<void> {
  await openExample(page, path);
  // How far depends on the frame rate here: between slow frames a motion looks like cuts.
  await expect.poll(() => largestOffsetMm(page), { timeout: 60_000 }).toBeGreaterThan(0);
  await showMoment(page, 0);
  const still = await picture(page, `example-${name}-off`);
  expect(await largestOffsetMm(page)).toBe(0);
  await showMoment(page, 1);
  const moving = await picture(page, `example-${name}`);
  const offsetMm = await largestOffsetMm(page);
  const changed = differing(still, moving, 10, MIDDLE);
  console.log(
    `${name}: offsets to ${offsetMm.toFixed(1)} mm, ${(changed * 100).toFixed(2)} % of the pixels`,
  );
  expect(variation(moving, MIDDLE)).toBeGreaterThan(12);
  expect(offsetMm).toBeGreaterThan(1);
  expect(changed).toBeGreaterThan(0.0005);
}
