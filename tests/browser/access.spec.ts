// axe finds nothing serious in any state that the page can be in.
import AxeBuilder from "@axe-core/playwright";
import { expect, type Page, test } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { hopFile } from "../hop-bvh.js";
import { dropFile, openAddress, openDemo, picture } from "./support.js";

/** Four actors, with all that can be shown beside them. */
const EVERYTHING =
  "?paused=1&view=side&clip=one-leg-hop&left=linear&third=casas-otaduy&fourth=truth&time=2.6" +
  "&heat=error&plots=1&hud=1";

/** What axe calls serious or critical, as text; prints how many rules it looked at. */
async function problemsOf(page: Page, what: string): Promise<string[]> {
  // What fades has other colours on the way.
  await page.waitForTimeout(700);
  const { violations, passes } = await new AxeBuilder({ page }).analyze();
  const minor = violations.filter(({ impact }) => impact !== "serious" && impact !== "critical");
  console.log(
    `axe, ${what}: ${passes.length} rules passed; minor: ${minor.map(({ id }) => id).join(", ") || "none"}`,
  );
  return violations
    .filter((violation) => !minor.includes(violation))
    .map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(" ")}`);
}

for (const colorScheme of ["light", "dark"] as const) {
  test(`axe: the page, ${colorScheme}`, async ({ page }) => {
    await page.setViewportSize({ width: 1280, height: 800 });
    await page.emulateMedia({ colorScheme });
    await openAddress(page, "/?resolution=full");
    for (const chapter of ["Compare", "Measure", "Five bodies", "Grab it"]) {
      await page.getByRole("button", { name: chapter, exact: true }).click();
      expect(await problemsOf(page, `${chapter}, ${colorScheme}`)).toEqual([]);
    }
    await openAddress(page, "/?paused=1&resolution=full");
    expect(await problemsOf(page, `the Lab, ${colorScheme}`)).toEqual([]);
    await openDemo(page, EVERYTHING);
    await expect(page.locator("#names .name")).toHaveCount(4);
    await page.locator("#view").hover();
    expect(await problemsOf(page, `four actors with everything, ${colorScheme}`)).toEqual([]);
    await openDemo(page, "?paused=1&view=wipe&motion=jump");
    expect(await problemsOf(page, `divider, ${colorScheme}`)).toEqual([]);
  });

  test(`axe: the body in hand and files, ${colorScheme}`, async ({ page }) => {
    await page.emulateMedia({ colorScheme });
    await openDemo(page, "?paused=1&motion=by-hand");
    expect(await problemsOf(page, `by hand, ${colorScheme}`)).toEqual([]);
    await dropFile(page, "hop.bvh", hopFile());
    await expect(page.locator("#file-report")).toContainText("hop.bvh");
    expect(await problemsOf(page, `file report, ${colorScheme}`)).toEqual([]);
    await dropFile(page, "nobody.bvh", hopFile().replaceAll(/(Left|Right|Hips|Spine)/g, "Box"));
    await expect(page.locator("#file-report")).toContainText("nobody.bvh cannot be played");
    await page.locator("#file-report").scrollIntoViewIfNeeded();
    expect(await problemsOf(page, `refused file, ${colorScheme}`)).toEqual([]);
  });

  test(`axe: every dialog, ${colorScheme}`, async ({ page }) => {
    await page.addInitScript(() => {
      Object.defineProperty(navigator, "clipboard", { value: undefined });
    });
    await page.emulateMedia({ colorScheme });
    await openDemo(page, "?paused=1");
    for (const key of ["u", "?", "k"]) {
      await page.keyboard.press(key);
      await expect(page.locator("dialog[open]")).toBeVisible();
      if (key === "k") {
        const done = page.locator("#benchmark-note");
        await expect(done).toContainText("medians of nine rounds", { timeout: 120_000 });
      }
      expect(await problemsOf(page, `dialog of ${key}, ${colorScheme}`)).toEqual([]);
      await page.keyboard.press("Escape");
    }
    await page.getByRole("button", { name: "Link to this view" }).click();
    await expect(page.locator("#copy-dialog")).toBeVisible();
    expect(await problemsOf(page, `copy by hand, ${colorScheme}`)).toEqual([]);
  });

  test(`axe: the lost graphics card, ${colorScheme}`, async ({ page }) => {
    await page.emulateMedia({ colorScheme });
    await openDemo(page, "?paused=1&backend=webgl2");
    await page.evaluate(() => {
      const canvas = document.querySelector<HTMLCanvasElement>("#view");
      canvas?.getContext("webgl2")?.getExtension("WEBGL_lose_context")?.loseContext();
    });
    await expect(page.locator("#loss")).toBeVisible();
    expect(await problemsOf(page, `loss, ${colorScheme}`)).toEqual([]);
  });

  test(`axe: a phone, ${colorScheme}`, async ({ browser }) => {
    const context = await browser.newContext({
      viewport: { width: 390, height: 844 },
      hasTouch: true,
      isMobile: true,
      colorScheme,
    });
    const page = await context.newPage();
    await openAddress(page, "/?paused=1&resolution=full");
    await expect(page.locator("#caption")).toBeVisible();
    expect(await problemsOf(page, `phone, ${colorScheme}`)).toEqual([]);
    await picture(page, `phone-first-${colorScheme}`);
    await page.getByRole("button", { name: "Show or hide the controls" }).click();
    expect(await problemsOf(page, `phone, controls, ${colorScheme}`)).toEqual([]);
    await openDemo(page, "?motion=by-hand");
    await expect(page.locator("#hand-tip")).toBeVisible();
    expect(await problemsOf(page, `phone, by hand, ${colorScheme}`)).toEqual([]);
    await page.keyboard.press("k");
    const done = page.locator("#benchmark-note");
    await expect(done).toContainText("medians of nine rounds", { timeout: 120_000 });
    expect(await problemsOf(page, `phone, benchmark, ${colorScheme}`)).toEqual([]);
    const table = page.locator("#benchmark-holder");
    // No column is out of sight: the values stand below each name.
    expect(await table.evaluate((at) => at.scrollWidth - at.clientWidth)).toBe(0);
    expect(
      await table
        .getByRole("cell")
        .first()
        .evaluate((at) => getComputedStyle(at, "::before").content),
    ).toBe('"ms a frame"');
    await context.close();
  });
}

test("neither names nor the caption cover a body, and the panel covers no actor", async ({
  page,
}) => {
  const everything = EVERYTHING.replace("&hud=1", "");
  for (const [query, width, height] of [
    [everything, 1280, 800],
    ["?paused=1", 1280, 800],
    ["?paused=1", 1280, 720],
    ["?paused=1", 1000, 640],
  ] as const) {
    await page.setViewportSize({ width, height });
    await openAddress(page, `/${query}&resolution=full`);
    await expect(page.locator("#loading")).toHaveClass(/done/);
    await page.evaluate(() => window.dynaskinDemo?.seek(1.85));
    await page.waitForTimeout(500);
    /** Where the bodies begin and end from left to right, and the tops of their heads, in pixels. */
    const bodies = await page.evaluate(() => window.dynaskinDemo?.bodiesPx ?? []);
    expect(bodies.length).toBeGreaterThan(1);
    const panel = await page.locator("#panel").boundingBox();
    const cards = await page.locator(".readings > :not([hidden])").all();
    const rights = await Promise.all(
      cards.map(async (card) => {
        const box = await card.boundingBox();
        return (box?.x ?? 0) + (box?.width ?? 0);
      }),
    );
    console.log(
      `bodies ${bodies.map(({ left, right }) => `${left.toFixed(0)}–${right.toFixed(0)}`).join(", ")}; ` +
        `cards end at ${Math.max(...rights).toFixed(0)}, the panel begins at ${panel?.x}`,
    );
    for (const { left, right } of bodies) {
      expect(left).toBeGreaterThan(Math.max(...rights));
      expect(right).toBeLessThan(panel?.x ?? 0);
    }
    const names = await page.locator("#names .name").all();
    for (const [idx, name] of names.entries()) {
      const box = await name.boundingBox();
      const body = bodies[idx];
      if (!box || !body) throw new Error("no name over a body");
      const belowPx = body.top - (box.y + box.height);
      expect(belowPx).toBeGreaterThan(-4);
      expect(belowPx).toBeLessThan(90);
    }
  }
});
