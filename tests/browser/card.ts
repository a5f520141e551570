import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import { openModules } from "./modules.js";
import { PICTURES } from "./places.js";

/** What is asked of the card, in metres. */
const TOLERANCE_M = 1e-4;

const ALL = [true, true, true];
const NONE = [false, false, false];

/** What `playOnCard` in card/stage.js gives. */
interface Played {
  positionM: number;
  normal: number;
  offsetM: number;
  readM: number;
  onCard: Record<string, boolean[]>;
  restsExactly: boolean[];
  tissueDifference: number;
  pictureDifference: number;
  errors: Record<string, number>;
  isPlain: boolean;
  pictures: Record<string, string>;
}

/** Plays a crowd that an engine's card decodes, and holds what it made to the CPU's. */
export async function expectCard(
  page: Page,
  file: "three" | "babylon",
  name: string,
  onWebGpu = false,
): Promise<void> {
  const problems = await openModules(page, "card");
  const played = (await page.evaluate(
    async ({ file, name, onWebGpu }) =>
      (await import(`${location.origin}/tests/browser/card/${file}.js`))[name](onWebGpu),
    { file, name, onWebGpu },
  )) as Played;
  const { pictures, ...numbers } = played;
  const where = onWebGpu ? `${file}-webgpu` : file;
  console.log(`${where}: ${JSON.stringify(numbers)}`);
  mkdirSync(PICTURES, { recursive: true });
  for (const [decoding, url] of Object.entries(pictures)) {
    const png = Buffer.from(url.replace(/^data:image\/png;base64,/, ""), "base64");
    writeFileSync(join(PICTURES, `card-${where}-${decoding}.png`), png);
  }
  expect(problems).toEqual([]);
  expect(played.positionM).toBeLessThanOrEqual(TOLERANCE_M);
  expect(played.normal).toBeLessThanOrEqual(1e-3);
  // The CPU's own numbers would be the same to the last bit.
  expect(played.normal).toBeGreaterThan(0);
  expect(played.offsetM).toBeGreaterThan(0.01);
  expect(played.readM).toBeLessThanOrEqual(1e-7);
  expect(played.restsExactly).toEqual([true, true]);
  expect(played.tissueDifference).toBeGreaterThan(0.05);
  expect(played.pictureDifference).toBeLessThan(0.005);
  const { lost, ...errors } = played.errors;
  // CONTEXT_LOST_WEBGL is no fault of ours.
  expect(lost).toBe(onWebGpu ? undefined : 37442);
  expect(Object.values(errors).every((error) => error === 0)).toBe(true);
  expect(played.isPlain).toBe(true);
  expect(played.onCard).toEqual({
    ...{
      begin: ALL,
      rest: ALL,
      motion: ALL,
      without: ALL,
      cpu: NONE,
      again: ALL,
      strain: [false, true, true],
    },
    ...(onWebGpu ? {} : { dualQuaternions: ALL, linear: ALL, lost: NONE, restored: ALL }),
    asleep: ALL,
  });
}
