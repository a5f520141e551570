import { expect, type Page } from "@playwright/test";
import { openModules } from "./modules.js";

/** Vectors against what vertices moved by, in units of the picture from -1 to 1. */
interface Difference {
  vertices: number;
  /** The longest way of a vertex. */
  peak: number;
  /** The longest vector. */
  seen: number;
  /** Of the errors. */
  median: number;
  p90: number;
}

/** What `compareVelocity` in avatar/velocity.js gives. */
interface Velocities {
  moving: Difference;
  held: Difference;
  morphed: Difference;
  still: Difference;
  unasked: Difference;
  /** Where the card has decoded, then the CPU, and now the card again; null where the CPU has all the time. */
  changed: Difference | null;
  isDecodedOnCard: boolean;
}

/**
 * Errors as shares of the longest way. Vectors are read between four pixels, so that they differ from a vertex's by how
 * much they bend within one, and at the edge of the body by those of the background.
 */
const MOST = { median: 0.001, p90: 0.01 };
/** Where bones move, limbs pass before others that move otherwise, and more vertices lie at such edges. */
const MOST_P90_MOVING = 0.06;
/** Vectors of what stands still: single precision rounds a place in the picture by some 1e-7. */
const STILL = 2e-6;

/** An engine's motion vectors are what the surface moved by, and without being asked those of the bones. */
export async function expectVelocity(
  page: Page,
  engine: "three" | "babylon",
  way: string,
  webgpu: boolean,
): Promise<void> {
  const problems = await openModules(page, "velocity");
  const found = (await page.evaluate(
    async ([address, how, gpu]) => (await import(location.origin + address)).compare(how, gpu),
    [`/tests/browser/avatar/velocity-${engine}.js`, way, webgpu] as const,
  )) as Velocities;
  console.log(JSON.stringify(found));
  expect(problems).toEqual([]);
  const { moving, held, morphed, still, unasked, changed, isDecodedOnCard } = found;
  const isOnCard = way === "DynaSkin on the card";
  expect(isDecodedOnCard).toBe(isOnCard);
  expect(changed !== null).toBe(isOnCard);
  const compared = { moving, held, morphed, ...(changed && { changed }) };
  for (const [name, difference] of Object.entries(compared)) {
    const { vertices, median, p90 } = difference;
    expect(vertices, name).toBeGreaterThan(1000);
    // Ten pixels; half of the swing is lost by the time that the card takes over again, the edges' errors are not.
    expect(difference.peak, name).toBeGreaterThan(name === "changed" ? 0.02 : 0.04);
    const { peak } = name === "changed" ? held : difference;
    expect(median / peak, name).toBeLessThan(MOST.median);
    expect(p90 / peak, name).toBeLessThan(name === "moving" ? MOST_P90_MOVING : MOST.p90);
  }
  expect(held.seen).toBeGreaterThan(0.5 * held.peak);
  expect(still.seen).toBeLessThan(STILL);
  // The surface moves as it did, and the bones do not.
  expect(unasked.peak).toBeGreaterThan(0.04);
  expect(unasked.seen).toBeLessThan(STILL);
}
