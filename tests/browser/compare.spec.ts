// Two actors under a divider, ground truth, plots, and what a visitor takes along.
import { readFile } from "node:fs/promises";
import { expect, type Page } from "@playwright/test";
import { parseAst } from "vite";
import type {} from "../../web/demo/src/hook.js";
import { fromHalf, SafeTensors } from "../../web/demo/src/safetensors.js";
import { legendColours, rampPlaces } from "./ramp.js";
import { differing, openDemo, picture, test } from "./support.js";

/** Left and right of the divider in the middle of a page 1000 pixels wide, below the names. */
const LEFT = { x: 0.22, y: 0.32, width: 0.08, height: 0.48 };
const RIGHT = { x: 0.35, y: 0.32, width: 0.1, height: 0.48 };

const switchOf = (page: Page, name: string) => page.getByRole("switch", { name });
const actor = (page: Page, side: "Left" | "Right") => page.getByLabel(side, { exact: true });
const dividerX = (page: Page) =>
  page.locator("#divider").evaluate((element) => {
    const { left, width } = element.getBoundingClientRect();
    return left + width / 2;
  });
/** Length of the largest offset of an avatar, in millimetres. */
const largestMm = (page: Page, side: "avatar" | "leftAvatar") =>
  page.evaluate((name) => {
    const offsets = window.dynaskinDemo?.[name]?.offsets ?? [];
    let largest = -1;
    for (let at = 0; at < offsets.length; at += 3) {
      largest = Math.max(
        largest,
        Math.hypot(offsets[at] ?? 0, offsets[at + 1] ?? 0, offsets[at + 2] ?? 0),
      );
    }
    return 1000 * largest;
  }, side);

test("two actors share motion and clock under a divider", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&motion=jump&clothes=unsupported");
  await page.evaluate(() => window.dynaskinDemo?.seek(1.85));
  const alone = await picture(page, "compare-alone");
  await page.locator("#layout").getByText("Divider").click();
  await expect(page.locator("#wipe")).toBeVisible();
  await expect(page.locator("#name-left")).toContainText("Linear skinning");
  await page.evaluate(() => window.dynaskinDemo?.seek(1.85));
  expect(await largestMm(page, "leftAvatar")).toBe(0);
  expect(await largestMm(page, "avatar")).toBeGreaterThan(5);
  const both = await picture(page, "compare-both");
  expect(differing(alone, both, 12, LEFT)).toBeGreaterThan(0.002);
  expect(differing(alone, both, 12, RIGHT)).toBe(0);

  await test.step("dragged, moved by keys, put back", async () => {
    const start = await dividerX(page);
    await page.mouse.move(start, 400);
    await page.mouse.down();
    await page.mouse.move(start + 120, 400, { steps: 3 });
    await page.mouse.up();
    expect(await dividerX(page)).toBeCloseTo(start + 120, 0);
    expect(page.url()).toMatch(/split=0\.6/);
    await page.locator("#divider").press("ArrowLeft");
    expect(await dividerX(page)).toBeLessThan(start + 120);
    await page.locator("#divider").press("Home");
    expect(await dividerX(page)).toBeCloseTo(0, 0);
    await page.locator("#divider").dblclick();
    expect(await dividerX(page)).toBeCloseTo(start, 0);
  });

  await test.step("one actor alone while a key or a name is held", async () => {
    await page.evaluate(() => window.dynaskinDemo?.seek(1.85));
    await page.keyboard.down("b");
    const right = await picture(page, "compare-held");
    expect(differing(alone, right, 12, LEFT)).toBe(0);
    await page.keyboard.up("b");
    expect(differing(both, await picture(page, "compare-released"), 12, LEFT)).toBe(0);
    await page.locator("#name-left").hover();
    await page.mouse.down();
    await expect(page.locator("#name-left")).toHaveAttribute("aria-pressed", "true");
    const left = await picture(page, "compare-held-left");
    expect(differing(both, left, 12, RIGHT)).toBeGreaterThan(0.002);
    await page.mouse.up();
    await expect(page.locator("#name-left")).toHaveAttribute("aria-pressed", "false");
  });

  await test.step("other methods are fetched when they are chosen", async () => {
    const fetched: string[] = [];
    page.on("request", (request) => fetched.push(new URL(request.url()).pathname));
    await actor(page, "Left").selectOption({ label: "Spring bones" });
    await expect.poll(() => largestMm(page, "leftAvatar")).toBeGreaterThan(5);
    expect(fetched.some((path) => path.endsWith("/methods/spring-bones/decoder.onnx"))).toBe(true);
    await expect(page.locator("#about-text")).toContainText("damped springs");
    // The first one brings the whole core, which reads the body anew; further ones bring themselves.
    fetched.length = 0;
    await actor(page, "Left").selectOption({ label: "Dyna / DMPL" });
    await expect.poll(() => fetched.some((path) => path.includes("/methods/"))).toBe(true);
    await expect(page.locator("#name-left")).toContainText("Dyna / DMPL");
    expect(fetched.filter((path) => /body\.glb|\.wasm$/.test(path))).toEqual([]);
    await actor(page, "Left").selectOption({ label: "Spring bones" });
    await expect(page.locator("#name-left")).toContainText("Spring bones");
    await page.getByRole("button", { name: "Swap sides" }).click();
    await expect(page.locator("#name-right")).toContainText("Spring bones");
    expect(page.url()).toMatch(/left=dynaskin.*right=spring-bones/);
  });
});

test("takes actors, clip, heat map, plots and camera from the link", async ({ page }) => {
  await openDemo(
    page,
    "?view=wipe&left=dmpl&clip=one-leg-hop&heat=error&plots=1&region=belly&split=0.3&paused=1&camera=1,0.2,2.5,1",
  );
  await expect(page.locator("#name-left")).toContainText("Dyna / DMPL");
  await expect(page.locator("#now-playing")).toHaveText("One leg hop, simulated · female body");
  await expect(page.locator("#legend")).toContainText("Distance from ground truth");
  await expect(page.locator("#plots")).toContainText("Belly, mean distance from ground truth (mm)");
  expect(await dividerX(page)).toBeCloseTo(0.3 * 652, 0);
  expect(await page.evaluate(() => window.dynaskinDemo?.view.camera.distanceM)).toBe(2.5);
  expect(page.url()).toContain("camera=1");
});

test("ground truth is shown, and what each actor misses", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&plots=1&view=wipe");
  await page
    .getByRole("combobox", { name: "Motion" })
    .selectOption({ label: "Jumping jacks, simulated" });
  await expect(page.locator("#name-left")).toContainText("Ground truth");
  const landing = async () => {
    await page.evaluate(() => window.dynaskinDemo?.seek(3));
    return largestMm(page, "leftAvatar");
  };
  // The clip plays once its file is there.
  await expect.poll(landing).toBeGreaterThan(10);
  const errors = () =>
    page.evaluate(() => window.dynaskinDemo?.samples.map(({ errorMm }) => errorMm) ?? []);
  const learned = await errors();
  expect(learned.length).toBeGreaterThan(100);
  expect(Math.max(...learned.map(([left]) => left ?? 99))).toBe(0);
  const mean = (values: (number | null)[]) =>
    values.reduce<number>((sum, value) => sum + (value ?? Number.NaN), 0) / values.length;
  await actor(page, "Right").selectOption({ label: "Linear skinning" });
  await page.evaluate(() => window.dynaskinDemo?.seek(3));
  const still = await errors();
  const [dynaskinMm, linearMm] = [learned, still].map((all) =>
    mean(all.map(([, right]) => right ?? null)),
  );
  console.log(
    `chest, two seconds of jumping jacks: dynaskin ${dynaskinMm} mm, linear ${linearMm} mm`,
  );
  expect(dynaskinMm).toBeLessThan(0.8 * (linearMm ?? 0));

  await test.step("as a heat map", async () => {
    await switchOf(page, "Heat map").click();
    const offsets = await picture(page, "truth-offsets");
    await page.locator("#heat-of").getByText("Error").click();
    await expect(page.locator("#legend")).toContainText("15+");
    const missed = await picture(page, "truth-error");
    // Ground truth is all cold, what plain skinning misses is warmer than the nothing it moves.
    expect(differing(offsets, missed, 12, LEFT)).toBeGreaterThan(0.01);
    expect(differing(offsets, missed, 12, RIGHT)).toBeGreaterThan(0.01);
  });

  await test.step("and a free motion ends it", async () => {
    await page.getByRole("combobox", { name: "Motion" }).selectOption("hop");
    await expect(page.locator("#name-left")).toContainText("Linear skinning");
    await expect(page.locator("#heat-of")).toBeHidden();
    await expect(page.locator("#plot-error")).toBeHidden();
  });
});

test("the error's heat map: ground truth is all cold, colours lie on the ramp", async ({
  reused: page,
}) => {
  const query = "?paused=1&view=side&clip=one-leg-hop&left=linear&right=truth";
  await openDemo(page, `${query}&heat=error`);
  await page.evaluate(() => window.dynaskinDemo?.seek(2.6));
  const heat = await picture(page, "error-heat");
  const ramp = await legendColours(page);
  await page.keyboard.press("m");
  await page.evaluate(() => window.dynaskinDemo?.seek(2.6));
  const painted = await picture(page, "error-painted");
  const bodies = await page.evaluate(() => window.dynaskinDemo?.bodiesPx ?? []);
  const [linear = [], truth = []] = bodies.map(({ left, right, top, bottom }) =>
    rampPlaces(heat, painted, ramp, {
      x: left / heat.width,
      // Below the name and above the legend.
      y: (top + 0.12 * (bottom - top)) / heat.height,
      width: (right - left) / heat.width,
      height: (0.55 * (bottom - top)) / heat.height,
    }),
  );
  const share = (places: (number | null)[], wanted: (place: number) => boolean) =>
    places.filter((place) => place !== null && wanted(place)).length / places.length;
  console.log(
    `error map: truth ${truth.length} pixels, cold ${share(truth, (p) => p < 0.1).toFixed(3)}, warm ` +
      `${share(truth, (p) => p > 0.3).toFixed(3)}; linear on the ramp ` +
      `${share(linear, () => true).toFixed(3)}, warm ${share(linear, (p) => p > 0.3).toFixed(3)}`,
  );
  expect(truth.length).toBeGreaterThan(2000);
  expect(share(truth, () => true)).toBeGreaterThan(0.9);
  expect(share(truth, (place) => place > 0.15)).toBeLessThan(0.01);
  expect(share(linear, () => true)).toBeGreaterThan(0.9);
  expect(share(linear, (place) => place > 0.3)).toBeGreaterThan(0.03);
});

test("plots follow the timeline", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&motion=hop");
  await switchOf(page, "Plots").click();
  const times = () =>
    page.evaluate(() => window.dynaskinDemo?.samples.map((sample) => sample.timeSeconds) ?? []);
  await page.getByLabel("Time in the motion").fill("5");
  await expect.poll(async () => (await times()).at(-1)).toBeCloseTo(5, 1);
  expect((await times())[0]).toBeCloseTo(3, 1);
  const chest = await page.evaluate(() => window.dynaskinDemo?.samples.at(-1)?.heightMm[1]);
  await page.getByLabel("Region of the plots").selectOption("calves");
  await expect(page.locator("#plots")).toContainText("Calves");
  expect(await page.evaluate(() => window.dynaskinDemo?.samples.at(-1)?.heightMm[1])).not.toBe(
    chest,
  );
  const inked = await page.locator("#plot-height canvas").evaluate((element) => {
    const canvas = element as HTMLCanvasElement;
    const data = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data;
    return [...(data ?? [])].filter((value, idx) => idx % 4 === 0 && value > 150).length;
  });
  expect(inked).toBeGreaterThan(50);

  await test.step("no part of the window is empty after a jump", async () => {
    /** Shares of the plot's width at which its line begins and ends. */
    const span = await page.locator("#plot-height canvas").evaluate((element) => {
      const canvas = element as HTMLCanvasElement;
      const { width, height } = canvas;
      const data = canvas.getContext("2d")?.getImageData(0, 0, width, height).data ?? [];
      const colourful = (at: number) =>
        Math.max(data[at] ?? 0, data[at + 1] ?? 0, data[at + 2] ?? 0) -
        Math.min(data[at] ?? 0, data[at + 1] ?? 0, data[at + 2] ?? 0);
      const columns = [...Array(width).keys()].filter((x) =>
        [...Array(height).keys()].some((y) => colourful((y * width + x) * 4) > 90),
      );
      return [(columns[0] ?? width) / width, (columns.at(-1) ?? 0) / width];
    });
    expect(span[0]).toBeLessThan(0.22);
    expect(span[1]).toBeGreaterThan(0.9);
  });

  await test.step("values are told by name", async () => {
    const rows = page.locator("#plot-now tr");
    await expect(rows).toHaveText([/^dynaskin-?\d+\.\d mm$/]);
  });
});

test("clothes hold the chest, and the caption says so", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&motion=hop");
  const gain = () =>
    page.evaluate(() => window.dynaskinDemo?.avatar?.controls.regions.chest.gain ?? 0);
  expect(await gain()).toBeLessThan(1);
  await expect(page.locator("#clothes-note")).toContainText("supported chest");
  await page.getByText("Unsupported", { exact: true }).click();
  expect(await gain()).toBe(1);
  await expect(page.locator("#clothes-note")).toContainText("Nothing holds");
  expect(page.url()).toContain("clothes=unsupported");
});

test("pictures, recordings and links are saved", async ({ page }) => {
  await openDemo(page, "?paused=1&view=wipe");
  const saved = async (press: () => Promise<void>) => {
    const download = page.waitForEvent("download");
    await press();
    const file = await download;
    return { name: file.suggestedFilename(), bytes: await readFile(await file.path()) };
  };
  const png = await saved(() => page.getByRole("button", { name: "Picture" }).click());
  expect(png.name).toBe("dynaskin.png");
  expect(png.bytes.subarray(1, 4).toString()).toBe("PNG");
  expect(png.bytes.length).toBeGreaterThan(30_000);
  await page.getByRole("button", { name: "Record" }).click();
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await page.waitForTimeout(1500);
  const webm = await saved(() => page.getByRole("button", { name: "Stop recording" }).click());
  expect(webm.name).toBe("dynaskin.webm");
  expect(webm.bytes.readUInt32BE(0)).toBe(0x1a45dfa3);
  expect(webm.bytes.length).toBeGreaterThan(5_000);
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.getByRole("button", { name: "Link to this view" }).click();
  await expect(page.getByText("link to this very view")).toBeVisible();
  expect(await page.evaluate(() => navigator.clipboard.readText())).toBe(page.url());
});

test("says so where a browser cannot record", async ({ page }) => {
  await page.addInitScript(() => {
    Reflect.deleteProperty(globalThis, "MediaRecorder");
  });
  await openDemo(page, "?paused=1");
  await page.keyboard.press("v");
  await expect(page.getByText("This browser cannot record")).toBeVisible();
});

test("the program has the present settings and parses", async ({ page }) => {
  await openDemo(page, "?paused=1&sex=male&shape=1.5,-0.5&motion=twist&tempo=0.7&height=0.08");
  await page.getByLabel("Strength").fill("1.5");
  await page.keyboard.press("u");
  await expect(page.locator("#code-text")).toBeVisible();
  const code = await page.locator("#code-text").inputValue();
  const [, program = ""] = /<script type="module">(.*)<\/script>/s.exec(code) ?? [];
  expect(() => parseAst(program)).not.toThrow();
  for (const part of [
    'import { male } from "dynaskin-male";',
    "load({ model: male })",
    "shape: [1.5, -0.5, 0, 0, 0, 0, 0, 0, 0, 0]",
    'Motion.procedural("twist", avatar, { tempoHz: 0.7, heightM: 0.08 })',
    'avatar.setControls("sportswear")',
    "avatar.strength = 1.5",
  ]) {
    expect(code).toContain(part);
  }
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.getByRole("button", { name: "Copy the program" }).click();
  expect(await page.evaluate(() => navigator.clipboard.readText())).toBe(code);
  await expect(page.locator("#code-dialog")).toBeHidden();
  await page.keyboard.press("?");
  await expect(page.getByRole("dialog", { name: "Keys and gestures" })).toBeVisible();
  await page.keyboard.press("Escape");
  await expect(page.locator("#keys-dialog")).toBeHidden();
});

test("half precision is read as IEEE 754 has it, and bad files are refused", () => {
  const cases = [
    [0x0000, 0],
    [0x3c00, 1],
    [0xc000, -2],
    [0x3555, 0.333251953125],
    [0x0001, 2 ** -24],
    [0x7bff, 65504],
    [0x7c00, Number.POSITIVE_INFINITY],
  ] as const;
  for (const [bits, value] of cases) expect(fromHalf(bits)).toBe(value);
  expect(fromHalf(0x7e00)).toBeNaN();
  expect(() => new SafeTensors(new ArrayBuffer(4))).toThrow("header");
  const header = JSON.stringify({ a: { dtype: "F32", shape: [2], data_offsets: [0, 8] } });
  const file = new Uint8Array(8 + header.length + 4);
  new DataView(file.buffer).setBigUint64(0, BigInt(header.length), true);
  file.set(new TextEncoder().encode(header), 8);
  expect(() => new SafeTensors(file.buffer).singles("a")).toThrow("8 bytes of F32");
  expect(() => new SafeTensors(file.buffer).singles("b")).toThrow("no tensor b");
});
