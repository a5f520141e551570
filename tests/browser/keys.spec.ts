// The keyboard from wherever the focus is, and what is held down to compare.
import { expect, type Page } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { differing, openDemo, picture, STAGE, test } from "./support.js";

const PAUSED = "?paused=1&motion=jump&clothes=unsupported";
const seek = (page: Page) => page.evaluate(() => window.dynaskinDemo?.seek(1.85));
const radio = (page: Page, name: string) => page.getByRole("radio", { name, exact: true });
const isOn = (page: Page, id: string) =>
  page.locator(`#${id}`).evaluate((element) => element.getAttribute("aria-checked") === "true");

test("shortcuts work after any radio was clicked, and radios keep their own keys", async ({
  reused: page,
}) => {
  await openDemo(page, PAUSED);
  for (const name of ["Divider", "Sportswear", "Female", "One"]) {
    await page.getByText(name, { exact: true }).click();
    await expect(radio(page, name)).toBeFocused();
    const before = await isOn(page, "heat");
    await page.keyboard.press("m");
    expect(await isOn(page, "heat"), `M after ${name}`).toBe(!before);
  }
  await page.keyboard.press(" ");
  await expect(page.getByRole("button", { name: "Play", exact: true })).toBeVisible();
  await page.keyboard.press("ArrowRight");
  await expect(radio(page, "Divider")).toBeChecked();
  await page.getByText("Ten shape coefficients").click();
  await page.keyboard.press("g");
  await expect(page.locator("#plots")).toBeVisible();
  await page.keyboard.press("Space");
  await expect(page.getByLabel("Shape 10")).toBeHidden();
});

test("a list jumps to what is typed, which is no shortcut there", async ({ reused: page }) => {
  await openDemo(page, PAUSED);
  await page.getByRole("combobox", { name: "Motion" }).focus();
  await page.keyboard.press("m");
  expect(await isOn(page, "heat")).toBe(false);
  await page.locator("#view").focus();
  await page.keyboard.press("m");
  expect(await isOn(page, "heat")).toBe(true);
});

test("every key of the list does what it says", async ({ reused: page }) => {
  await openDemo(page, PAUSED);
  const layout = () => page.locator("input[name=layout]:checked").inputValue();
  for (const next of ["wipe", "side", "one"]) {
    await page.keyboard.press("c");
    expect(await layout()).toBe(next);
  }
  await page.keyboard.press("c");
  await expect(page.locator("#name-left")).toContainText("Linear skinning");
  await page.keyboard.press("x");
  await expect(page.locator("#name-right")).toContainText("Linear skinning");
  await page.keyboard.press("x");
  await expect(page.locator("#name-left")).toContainText("Linear skinning");
  for (const [key, id] of [
    ["g", "plots"],
    ["t", "hud"],
    ["m", "legend"],
  ] as const) {
    await page.keyboard.press(key);
    await expect(page.locator(`#${id}`)).toBeVisible();
    await page.keyboard.press(key);
    await expect(page.locator(`#${id}`)).toBeHidden();
  }
  const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds ?? Number.NaN);
  const before = await time();
  await page.keyboard.press(".");
  expect((await time()) - before).toBeCloseTo(1 / 60, 5);
  const download = page.waitForEvent("download");
  await page.keyboard.press("p");
  expect((await download).suggestedFilename()).toBe("dynaskin.png");
  await page.keyboard.press("?");
  const list = page.getByRole("dialog", { name: "Keys and gestures" });
  for (const key of ["Space", "PgUp", "Home", "End", "Esc", "Tab", "Double click", "pinch"]) {
    await expect(list).toContainText(key);
  }
  // A shortcut below a dialog would change what the visitor does not see.
  await page.keyboard.press("m");
  await expect(page.locator("#legend")).toBeHidden();
});

test("the picture's own keys and gestures move the camera", async ({ reused: page }) => {
  await openDemo(page, "?paused=1");
  const camera = () =>
    page.evaluate(() => {
      const { yawRadians, pitchRadians, distanceM, heightM } =
        window.dynaskinDemo?.view.camera ?? {};
      return { yawRadians, pitchRadians, distanceM, heightM } as Record<string, number>;
    });
  const start = await camera();
  await page.locator("#view").focus();
  const moves: [key: string, what: string, sign: number][] = [
    ["ArrowRight", "yawRadians", 1],
    ["ArrowLeft", "yawRadians", -1],
    ["ArrowUp", "pitchRadians", 1],
    ["ArrowDown", "pitchRadians", -1],
    ["+", "distanceM", -1],
    ["-", "distanceM", 1],
    ["PageUp", "heightM", 1],
    ["PageDown", "heightM", -1],
  ];
  for (const [key, what, sign] of moves) {
    const before = await camera();
    await page.keyboard.press(key);
    const after = await camera();
    expect(((after[what] ?? 0) - (before[what] ?? 0)) * sign, key).toBeGreaterThan(0);
  }
  await page.keyboard.down("Shift");
  await page.mouse.move(330, 300);
  await page.mouse.down();
  await page.mouse.move(330, 360, { steps: 3 });
  await page.mouse.up();
  await page.keyboard.up("Shift");
  expect((await camera()).heightM).toBeGreaterThan((start.heightM ?? 0) + 0.05);
  await page.locator("#view").dblclick({ position: { x: 60, y: 300 } });
  expect(await camera()).toEqual(start);
});

test("A and B show one actor in every layout, by key and by name", async ({ reused: page }) => {
  await openDemo(page, `${PAUSED}&view=one`);
  const shot = async (name: string) => {
    await page.waitForTimeout(400);
    return picture(page, `hold-${name}`);
  };
  const BODY = { ...STAGE, y: 0.3, height: 0.5 };

  await test.step("one alone: A takes its tissue away", async () => {
    await seek(page);
    const full = await shot("one");
    await page.keyboard.down("a");
    const plain = await shot("one-plain");
    await expect(page.locator("#names .name span")).toHaveText("dynaskin, off: plain skinning");
    expect(await page.evaluate(() => window.dynaskinDemo?.avatar?.strength)).toBe(0);
    await page.keyboard.up("a");
    expect(differing(full, plain, 12, BODY)).toBeGreaterThan(0.002);
    expect(differing(full, await shot("one-again"), 12, BODY)).toBe(0);
    await page.locator("#names .name").hover();
    await page.mouse.down();
    expect(differing(plain, await shot("one-by-name"), 12, BODY)).toBe(0);
    await page.mouse.up();
    await expect(page.locator("#names .name span")).toHaveText("dynaskin");
  });

  await test.step("side by side: the first or the second in the middle", async () => {
    await page.getByText("Side by side", { exact: true }).click();
    const names = page.locator("#names .name");
    await expect(names).toHaveCount(2);
    await seek(page);
    const row = await shot("row");
    await page.keyboard.down("a");
    const first = await shot("row-a");
    await expect(names.nth(1)).toBeHidden();
    await expect(names.nth(0)).toHaveAttribute("aria-pressed", "true");
    await page.keyboard.up("a");
    await page.keyboard.down("b");
    const second = await shot("row-b");
    await expect(names.nth(0)).toBeHidden();
    await page.keyboard.up("b");
    expect(differing(row, first, 12, BODY)).toBeGreaterThan(0.02);
    // In the same place, so that nothing but the skin differs.
    const far = differing(first, second, 12, BODY);
    expect(far).toBeGreaterThan(0.002);
    expect(far).toBeLessThan(0.3);
    expect(differing(row, await shot("row-again"), 12, BODY)).toBe(0);
    await names.nth(1).hover();
    await page.mouse.down();
    expect(differing(second, await shot("row-by-name"), 12, BODY)).toBe(0);
    await page.mouse.up();
    await names.nth(0).press("Enter");
    await expect(names).toHaveCount(2);
    await expect(names.nth(1)).toBeVisible();
  });
});

test("a finger on a name shows that actor alone", async ({ browser }) => {
  const context = await browser.newContext({
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  const page = await context.newPage();
  await openDemo(page, `${PAUSED}&view=side`);
  const names = page.locator("#names .name");
  const box = await names.nth(1).boundingBox();
  if (!box) throw new Error("the name is not shown");
  const devtools = await context.newCDPSession(page);
  const point = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  await devtools.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [point] });
  await expect(names.nth(0)).toBeHidden();
  await devtools.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await expect(names.nth(0)).toBeVisible();
  await context.close();
});

test("names say where the tissue is switched off", async ({ reused: page }) => {
  await openDemo(page, `${PAUSED}&view=side`);
  const names = page.locator("#names .name span");
  await expect(names).toHaveText(["Linear skinning", "dynaskin"]);
  await page.keyboard.press("d");
  await expect(names).toHaveText(["Linear skinning", "dynaskin, off: plain skinning"]);
  await page.getByText("Divider", { exact: true }).click();
  await expect(page.locator("#name-right")).toContainText("off: plain skinning");
  await page.keyboard.press("d");
  await expect(page.locator("#name-right-text")).toHaveText("dynaskin");
});
