// Colours of the heat map, found again in a picture of the page.
import type { Page } from "@playwright/test";
import { type Picture, STAGE, within } from "./support.js";

type Colour = [red: number, green: number, blue: number];

const linear = (byte: number) => {
  const value = byte / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
};
const toLinear = ([red, green, blue]: Colour): Colour => [linear(red), linear(green), linear(blue)];
const dot = (a: Colour, b: Colour) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** The stops of the legend's ramp as the page draws it, in linear light. */
export async function legendColours(page: Page): Promise<Colour[]> {
  const gradient = await page
    .locator("#legend-ramp")
    .evaluate((element) => getComputedStyle(element).backgroundImage);
  return [...gradient.matchAll(/rgb\((\d+), (\d+), (\d+)\)/g)].map(([, red, green, blue]) =>
    toLinear([Number(red), Number(green), Number(blue)]),
  );
}

/**
 * For each pixel of the body, which is where two pictures differ: its place on the ramp from 0 to
 * 1, or null for a colour that is not on it. Light makes the ramp's colours up to 45 % darker and
 * adds a white highlight; hue and saturation beyond that have to agree.
 */
export function rampPlaces(
  image: Picture,
  other: Picture,
  ramp: Colour[],
  part = STAGE,
): (number | null)[] {
  const steps = 4;
  const colours = Array.from({ length: (ramp.length - 1) * steps + 1 }, (_, idx) => {
    const low = ramp[Math.floor(idx / steps)] as Colour;
    const high = ramp[Math.ceil(idx / steps)] as Colour;
    const share = (idx % steps) / steps;
    return low.map((value, part) => value + ((high[part] ?? 0) - value) * share) as Colour;
  });
  const places: (number | null)[] = [];
  for (const at of within(image, part)) {
    const [seen, there] = [image, other].map(({ data }) => [...data.subarray(at, at + 3)]);
    if (!seen || !there || seen.every((value, part) => Math.abs(value - (there[part] ?? 0)) < 25)) {
      continue;
    }
    const misses = colours.map((colour) => missOf(toLinear(seen as Colour), colour));
    const best = misses.indexOf(Math.min(...misses));
    places.push((misses[best] ?? 1) < 0.012 ? best / (colours.length - 1) : null);
  }
  return places;
}

/** Distance of a colour from the nearest one that light can make of `colour`. */
function missOf(seen: Colour, colour: Colour): number {
  let least = Number.POSITIVE_INFINITY;
  for (const highlight of [0, 0.005, 0.01, 0.02, 0.04]) {
    const rest = seen.map((value) => value - highlight) as Colour;
    const share = Math.max(0.5, Math.min(1.02, dot(rest, colour) / dot(colour, colour)));
    least = Math.min(least, Math.hypot(...rest.map((v, part) => v - share * (colour[part] ?? 0))));
  }
  return least;
}
