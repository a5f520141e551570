// The demo page with WebGL2, as a visitor uses it.
import { expect, type Page } from "@playwright/test";
import type { RegionName } from "dynaskin";
import type {} from "../../web/demo/src/hook.js";
import { legendColours, rampPlaces } from "./ramp.js";
import { differing, openDemo, picture, STAGE, test, variation } from "./support.js";

const switchOf = (page: Page, name: string) => page.getByRole("switch", { name });
const timeSeconds = (page: Page) => page.evaluate(() => window.dynaskinDemo?.timeSeconds ?? 0);

/** Offsets of the vertices that belong to this region and no other, in metres. */
function offsetsOf(page: Page, region: RegionName): Promise<number[]> {
  return page.evaluate((wanted) => {
    const { avatar, model } = window.dynaskinDemo ?? {};
    if (!avatar || !model) throw new Error("the demo is not ready");
    const names = ["chest", "belly", "buttocks", "thighs", "calves", "upper-arms"] as const;
    const weights = names.map((name) => [name, model.body.regionWeights(name)] as const);
    return [...avatar.offsets].filter((_, idx) =>
      weights.every(([name, of]) => (of[Math.floor(idx / 3)] ?? 0) > 0 === (name === wanted)),
    );
  }, region);
}

test("draws a body that moves", async ({ reused: page }) => {
  await openDemo(page, "?motion=jumping-jacks");
  expect(await page.evaluate(() => window.dynaskinDemo?.backend)).toBe("webgl2");
  await page.evaluate(() => window.dynaskinDemo?.seek(1));
  const early = await picture(page, "webgl2-early");
  await page.evaluate(() => window.dynaskinDemo?.seek(2.3));
  const late = await picture(page, "webgl2-late");
  expect(variation(early)).toBeGreaterThan(12);
  expect(differing(early, late)).toBeGreaterThan(0.03);
});

test("plays by itself and says what it learned from", async ({ reused: page }) => {
  await openDemo(page);
  await expect(page.locator("#about-text")).toContainText(/simulated tissue.*never saw.* \d+ %/);
  const before = await timeSeconds(page);
  await expect.poll(() => timeSeconds(page)).not.toBe(before);
});

test("shows the body with plain skinning before the networks are there", async ({ page }) => {
  let letThrough = () => {};
  const held = new Promise<void>((done) => {
    letThrough = done;
  });
  await page.route("**/predictor.lowered", async (route) => {
    await held;
    await route.continue();
  });
  await page.goto("/?motion=hop");
  await expect.poll(() => timeSeconds(page), { timeout: 90_000 }).toBeGreaterThan(0);
  const early = await page.evaluate(() => ({
    ready: window.dynaskinDemo?.ready,
    dynamics: window.dynaskinDemo?.avatar?.dynamics,
  }));
  expect(early).toEqual({ ready: false, dynamics: false });
  await expect(page.locator("#loading")).toContainText("networks");
  letThrough();
  await expect.poll(() => page.evaluate(() => window.dynaskinDemo?.ready)).toBe(true);
  expect(await page.evaluate(() => window.dynaskinDemo?.avatar?.dynamics)).toBe(true);
});

test("every control does what it says", async ({ page }) => {
  // Paused, because a page that draws in software has no time left to answer clicks.
  await openDemo(page, "?paused=1");
  const avatar = <T>(read: (demo: NonNullable<typeof window.dynaskinDemo>) => T) =>
    page.evaluate<T>(`(${read.toString()})(window.dynaskinDemo)`);

  await test.step("dynamics, by button and key", async () => {
    await switchOf(page, "Tissue dynamics").click();
    expect(await avatar((demo) => demo.avatar?.strength)).toBe(0);
    await page.keyboard.press("d");
    expect(await avatar((demo) => demo.avatar?.strength)).toBe(1);
  });

  const play = page.getByRole("button", { name: "Play", exact: true });
  await test.step("pause, frame step and speed", async () => {
    const stopped = await timeSeconds(page);
    await page.getByRole("button", { name: "Next frame" }).click();
    expect((await timeSeconds(page)) - stopped).toBeCloseTo(1 / 60, 5);
    await page.getByLabel("Playback speed").selectOption("0.1");
    expect(page.url()).toContain("speed=0.1");
    await play.click();
    await expect.poll(() => timeSeconds(page)).toBeGreaterThan(stopped + 1 / 60);
    await page.getByRole("button", { name: "Pause" }).click();
    await page.getByLabel("Time in the motion").fill("3");
    await expect.poll(() => timeSeconds(page)).toBeCloseTo(3, 0);
    await page.getByLabel("Time in the motion").blur();
    await page.keyboard.press(" ");
    await expect(page.getByRole("button", { name: "Pause" })).toBeVisible();
    await page.keyboard.press(" ");
    await expect(play).toBeVisible();
  });

  await test.step("motion with tempo and height", async () => {
    await page.getByRole("combobox", { name: "Motion" }).selectOption("twist");
    await expect(page.locator("#now-playing")).toContainText("Twist");
    await page.getByLabel("Tempo").fill("0.7");
    await page.getByLabel("Height").fill("0.08");
    expect(page.url()).toMatch(/motion=twist.*tempo=0\.7.*height=0\.0[78]/);
  });

  await test.step("shape", async () => {
    await page.getByLabel("Stature").fill("175");
    // 163.3 cm and 6.53 cm a standard deviation.
    expect(await avatar((demo) => demo.avatar?.shape[0])).toBeCloseTo((175 - 163.31) / 6.5324, 2);
    await page.getByLabel("Stature").fill("163.3");
    const widthM = () =>
      avatar((demo) => {
        const { positions } = demo.avatar ?? {};
        const body = demo.model?.body;
        if (!positions || !body) return Number.NaN;
        const weights = body.regionWeights("belly");
        const xs = [...weights.keys()].filter((v) => (weights[v] ?? 0) > 0.5);
        return Math.max(...xs.map((v) => Math.abs(positions[3 * v] ?? 0)));
      });
    const before = await widthM();
    const usualKg = await page.getByLabel("Weight").inputValue();
    await page.getByLabel("Weight").fill("80");
    await expect(page.getByLabel("Weight")).toHaveValue(/^(79|80)/);
    await expect(page.getByLabel("Age", { exact: true })).toHaveValue(/^4[345]/);
    expect(Number(await page.locator("#trait-chest").inputValue())).toBeGreaterThan(95);
    expect(await widthM()).toBeGreaterThan(before * 1.1);
    // Going back undoes going forth.
    await page.getByLabel("Weight").fill(usualKg);
    expect(await widthM()).toBeCloseTo(before, 3);
    for (const [name, value] of [
      ["muscle", "80"],
      ["chest", "100"],
      ["age", "60"],
    ] as const) {
      await page.locator(`#trait-${name}`).fill(value);
      expect(await avatar((demo) => demo.avatar?.shape.some((beta) => beta !== 0))).toBe(true);
    }
    await page.getByText("Ten shape coefficients").click();
    await page.getByLabel("Shape 10").fill("-1.5");
    expect(await avatar((demo) => demo.avatar?.shape[9])).toBe(-1.5);
    await page.getByRole("button", { name: "Average body" }).click();
    expect(await avatar((demo) => demo.avatar?.shape[0])).toBe(0);
    await page.getByRole("button", { name: "Random body" }).click();
    expect(await avatar((demo) => demo.avatar?.shape.some((beta) => beta !== 0))).toBe(true);
  });

  await test.step("strength and regions", async () => {
    await page.getByLabel("Strength").fill("0.5");
    expect(await avatar((demo) => demo.avatar?.strength)).toBe(0.5);
    await page.getByText("Regions", { exact: true }).click();
    const belly = () =>
      avatar((demo) => {
        const { stiffness, damping } = demo.avatar?.controls.regions.belly ?? {};
        return [stiffness, damping].map((value) => +(value ?? 0).toFixed(2));
      });
    const [stiffness = 0, damping = 0] = await belly();
    await page.getByText("Stiffness", { exact: true }).click();
    await page.getByLabel("Belly").fill("1");
    await page.getByText("Damping", { exact: true }).click();
    await page.getByLabel("Belly").fill("-1");
    expect(await belly()).toEqual([+(stiffness * 2).toFixed(2), +(damping / 2).toFixed(2)]);
    expect(page.url()).toMatch(/stiffness=belly:2&damping=belly:0\.5/);
    await page.getByText("Gain", { exact: true }).click();
    await page.evaluate(() => window.dynaskinDemo?.seek(2.6));
    const before = {
      belly: await offsetsOf(page, "belly"),
      arms: await offsetsOf(page, "upper-arms"),
    };
    const sizes = (values: number[]) => Math.max(...values.map(Math.abs));
    expect(sizes(before.belly)).toBeGreaterThan(1e-5);
    expect(sizes(before.arms)).toBeGreaterThan(1e-5);
    await page.getByLabel("Belly").fill("0");
    await page.getByLabel("Upper arms").fill("2");
    expect(sizes(await offsetsOf(page, "belly"))).toBe(0);
    const doubled = await offsetsOf(page, "upper-arms");
    const misses = doubled.map((value, idx) => value - 2 * (before.arms[idx] ?? Number.NaN));
    expect(sizes(misses)).toBeLessThan(1e-7);
  });

  await test.step("heat map with its legend", async () => {
    await switchOf(page, "Heat map").click();
    await expect(page.locator("#legend")).toContainText("mm");
    await page.keyboard.press("m");
    await expect(page.locator("#legend")).toBeHidden();
  });

  await test.step("timings, copied as text", async () => {
    await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
    await switchOf(page, "Timings").click();
    await play.click();
    await expect(page.locator("#hud")).toContainText(/predict\s*\d+\.\d\d ms/);
    await expect(page.locator("#hud")).toContainText("webgl2");
    await page.keyboard.press(" ");
    await page.getByRole("button", { name: "Copy" }).click();
    await expect(page.getByText("on the clipboard")).toBeVisible();
    expect(await page.evaluate(() => navigator.clipboard.readText())).toMatch(/decode: \d/);
  });

  await test.step("the other body", async () => {
    await page.getByText("Male", { exact: true }).click();
    await expect(page.locator("#now-playing")).toContainText("male body");
    await expect.poll(() => avatar((demo) => demo.model?.name), { timeout: 90_000 }).toBe("male");
    expect(page.url()).toContain("sex=male");
  });
});

test("the heat map paints the offsets in the legend's colours", async ({ reused: page }) => {
  await openDemo(page, "?paused=1&heat=1&motion=jump&clothes=unsupported");
  // The tick of the first four seconds at which most of the skin is far from plain skinning.
  const peak = await page.evaluate(() => {
    const demo = window.dynaskinDemo;
    const sum = () => demo?.avatar?.offsets.reduce((total, value) => total + value * value, 0) ?? 0;
    let best = { sum: 0, timeSeconds: 0 };
    demo?.seek(0);
    for (let tick = 0; tick < 240; tick += 1) {
      demo?.step();
      const { timeSeconds = 0 } = demo ?? {};
      if (sum() > best.sum) best = { sum: sum(), timeSeconds };
    }
    demo?.seek(best.timeSeconds);
    return best.timeSeconds;
  });
  const hot = await picture(page, "heat-on");
  const ramp = await legendColours(page);
  await page.keyboard.press("m");
  await page.evaluate((time) => window.dynaskinDemo?.seek(time), peak);
  const plain = await picture(page, "heat-off");
  const aboveLegend = { ...STAGE, height: 0.68 };
  const places = rampPlaces(hot, plain, ramp, aboveLegend);
  const onRamp = places.filter((place) => place !== null);
  const share = (wanted: (place: number) => boolean) =>
    onRamp.filter(wanted).length / places.length;
  const painted = rampPlaces(plain, hot, ramp, aboveLegend).filter((place) => place !== null);
  console.log(
    `heat map: ${places.length} pixels, on the ramp ${share(() => true).toFixed(3)}, cold ` +
      `${share((place) => place < 0.1).toFixed(3)}, warm ${share((place) => place > 0.4).toFixed(3)}; ` +
      `painted body ${(painted.length / places.length).toFixed(3)}`,
  );
  expect(places.length).toBeGreaterThan(2000);
  expect(share(() => true)).toBeGreaterThan(0.9);
  expect(share((place) => place < 0.1)).toBeGreaterThan(0.2);
  expect(share((place) => place > 0.4)).toBeGreaterThan(0.02);
  // Clothes and skin have other colours, so this measure can tell them from the map.
  expect(painted.length / places.length).toBeLessThan(0.6);
});

test("orbits, zooms and comes back", async ({ reused: page }) => {
  await openDemo(page, "?paused=1");
  await page.evaluate(() => window.dynaskinDemo?.seek(0.2));
  const camera = () =>
    page.evaluate(() => {
      const { yawRadians = 0, distanceM = 0 } = window.dynaskinDemo?.view.camera ?? {};
      return { yawRadians, distanceM };
    });
  const start = await camera();
  const before = await picture(page, "camera-before");
  await page.mouse.move(450, 400);
  await page.mouse.down();
  await page.mouse.move(250, 380, { steps: 4 });
  await page.mouse.up();
  await page.mouse.wheel(0, -300);
  await page.waitForTimeout(500);
  const turned = await camera();
  expect(Math.abs(turned.yawRadians - start.yawRadians)).toBeGreaterThan(0.5);
  expect(turned.distanceM).toBeLessThan(start.distanceM);
  expect(differing(before, await picture(page, "camera-after"))).toBeGreaterThan(0.05);
  await page.keyboard.press("r");
  expect(await camera()).toEqual(start);
});

test("takes its settings from the link", async ({ page }) => {
  await openDemo(
    page,
    "?sex=male&motion=walk&dynamics=0&heat=1&hud=1&speed=0.5&paused=1&shape=1,0,-1&backend=webgl2",
  );
  await expect(page.locator("#now-playing")).toHaveText("Walk · male body");
  await expect(switchOf(page, "Tissue dynamics")).toHaveAttribute("aria-checked", "false");
  await expect(page.locator("#legend")).toBeVisible();
  await expect(page.locator("#hud")).toBeVisible();
  await expect(page.getByLabel("Playback speed")).toHaveValue("0.5");
  const shape = await page.evaluate(() => [...(window.dynaskinDemo?.avatar?.shape ?? [])]);
  expect(shape.slice(0, 4)).toEqual([1, 0, -1, 0]);
});

test("stands still for visitors who asked for less motion", async ({ page }) => {
  await page.emulateMedia({ reducedMotion: "reduce" });
  await openDemo(page);
  await expect(page.getByRole("button", { name: "Play", exact: true })).toBeVisible();
});

test("names every control for screen readers", async ({ page }) => {
  await openDemo(page, "?heat=1&hud=1&paused=1");
  const unnamed = await page.evaluate(() => {
    const nameOf = (element: Element) => {
      const control = element as HTMLInputElement;
      const label = control.labels?.[0]?.textContent ?? "";
      return (element.getAttribute("aria-label") ?? "") + label + (element.textContent ?? "");
    };
    return [...document.querySelectorAll("button, input:not([hidden]), select, canvas")]
      .filter((element) => !element.closest("[aria-hidden=true]") && nameOf(element).trim() === "")
      .map((element) => element.outerHTML);
  });
  expect(unnamed).toEqual([]);
});

for (const colorScheme of ["light", "dark"] as const) {
  test(`fits a phone, ${colorScheme}`, async ({ page }) => {
    await page.setViewportSize({ width: 390, height: 844 });
    await page.emulateMedia({ colorScheme });
    await openDemo(page, "?motion=jump&heat=1&clothes=unsupported");
    await page.evaluate(() => window.dynaskinDemo?.seek(1.85));
    const part = { x: 0.2, y: 0.15, width: 0.6, height: 0.5 };
    expect(variation(await picture(page, `phone-${colorScheme}`), part)).toBeGreaterThan(12);
    await page.getByRole("button", { name: "Show or hide the controls" }).click();
    await expect(page.getByLabel("Stature")).toBeVisible();
    await picture(page, `phone-${colorScheme}-open`);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    expect(wide).toBeLessThanOrEqual(390);
  });
}
