// The page for a visitor's own avatar: dropped, bound in the page, moving; refused; left out; taken along.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import AxeBuilder from "@axe-core/playwright";
import { expect, type Page, test } from "@playwright/test";
import type {} from "../../web/demo/src/own/page.js";
import { ROOT } from "./places.js";
import { differing, dropFile, openDemo, picture } from "./support.js";

const AVATARS = join(ROOT, "web", "demo", "avatars");
const runner = () => readFileSync(join(AVATARS, "runner.vrm"));

/** Right half of the picture's part of the page: the avatar with tissue. */
const TISSUE_SIDE = { x: 0.32, y: 0.1, width: 0.3, height: 0.85 };

async function openOwn(page: Page): Promise<string[]> {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  await page.goto("/own.html");
  return problems;
}

async function answer(page: Page, build = "Woman"): Promise<void> {
  await page.getByText(build, { exact: true }).click();
  await page.getByLabel("This avatar depicts an adult").check();
}

/** Waits until it plays, and pauses: software draws too slowly for a page that is also clicked. */
async function expectBound(page: Page): Promise<void> {
  await expect
    .poll(() => page.evaluate(() => Boolean(window.dynaskinOwn?.bound)), { timeout: 240_000 })
    .toBe(true);
  await page.evaluate(() => window.dynaskinOwn?.setPlaying(false));
}

/** Binds the example of the female body, and stops it where it moves most. */
async function openRunner(page: Page): Promise<void> {
  await dropFile(page, "runner.vrm", runner());
  await answer(page);
  await expectBound(page);
  await page.getByRole("button", { name: "Strongest moment" }).click();
}

/** Largest distance from plain skinning now, metres. */
const apartM = (page: Page) => page.evaluate(() => window.dynaskinOwn?.bound?.apartM ?? -1);

async function expectAccessible(page: Page, what: string): Promise<void> {
  const { violations } = await new AxeBuilder({ page }).analyze();
  const serious = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  const found = serious.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(" ")}`);
  expect(found, what).toEqual([]);
}

/** A GLB of one triangle without a skeleton. */
function triangle(): Buffer {
  const bytes = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer);
  const json = JSON.stringify({
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    accessors: [...[{ bufferView: 0, componentType: 5126, type: "VEC3", count: 3 }]].map(
      (accessor) => ({ ...accessor, min: [0, 0, 0], max: [1, 1, 0] }),
    ),
    bufferViews: [{ buffer: 0, byteLength: bytes.length }],
    buffers: [{ byteLength: bytes.length }],
  });
  const text = Buffer.from(json.padEnd(Math.ceil(json.length / 4) * 4));
  const chunk = (kind: string, content: Buffer) => {
    const head = Buffer.alloc(8, kind, "latin1");
    head.writeUInt32LE(content.length, 0);
    head.write(kind, 4, "latin1");
    return Buffer.concat([head, content]);
  };
  const chunks = Buffer.concat([chunk("JSON", text), chunk("BIN\0", bytes)]);
  const head = Buffer.alloc(12);
  head.write("glTF", 0, "latin1");
  head.writeUInt32LE(2, 4);
  head.writeUInt32LE(12 + chunks.length, 8);
  return Buffer.concat([head, chunks]);
}

test("an avatar that is dropped is bound in the page and moves with tissue of its own", async ({
  page,
}) => {
  const asked: string[] = [];
  page.on("request", (request) => asked.push(request.url()));
  const problems = await openOwn(page);
  const origin = new URL(page.url()).origin;

  await test.step("three.js and what binds are not loaded before", () => {
    expect(asked.filter((url) => /workshop|bind_bg/.test(url))).toEqual([]);
  });

  await test.step("nothing is bound before it is declared an adult", async () => {
    await expect(page.getByLabel("This avatar depicts an adult")).not.toBeChecked();
    await expect(page.locator("input[name=build]:checked")).toHaveCount(0);
    await dropFile(page, "runner.vrm", runner());
    await expect(page.locator("#own-wanting")).toHaveText(
      "Still needed: that it depicts an adult and its build.",
    );
    await page.getByText("Woman", { exact: true }).click();
    await expect(page.locator("#own-wanting")).toHaveText(
      "Still needed: that it depicts an adult.",
    );
    expect(asked.filter((url) => /bind_bg/.test(url))).toEqual([]);
    await page.getByLabel("This avatar depicts an adult").check();
    await expectBound(page);
  });

  await test.step("it moves apart from plain skinning", async () => {
    const afterMs = await page.evaluate(() => window.dynaskinOwn?.movingAfterMs);
    await page.getByRole("button", { name: "Strongest moment" }).click();
    const most = await apartM(page);
    // Three times as far, so that a small picture shows it.
    await page.getByLabel("Strength").fill("3");
    await page.mouse.move(1, 1);
    await page.waitForTimeout(300);
    const soft = await picture(page, "own-tissue");
    await page.getByLabel("Strength").fill("0");
    // Positions are rounded to 32 bits on one side.
    await expect.poll(() => apartM(page)).toBeLessThan(1e-6);
    await page.waitForTimeout(300);
    const plain = await picture(page, "own-plain");
    const share = differing(soft, plain, 12, TISSUE_SIDE);
    console.log(
      `bound and moving after ${Math.round(afterMs ?? 0)} ms, up to ${(1000 * most).toFixed(1)} mm ` +
        `from plain skinning, ${(100 * share).toFixed(2)} % of the picture differ`,
    );
    expect(most).toBeGreaterThan(0.01);
    expect(most).toBeLessThan(0.15);
    expect(share).toBeGreaterThan(0.005);
  });

  await test.step("the report says what was found", async () => {
    const report = page.locator("#own-report");
    await expect(report).toContainText(/2\d of the body's 24 joints have a bone/);
    await expect(report).toContainText(/\d\d % of its skin lies within 2 cm of the fitted body/);
    await expect(report).toContainText(/Bound in \d+\.\d s; the binding has \d+ kB/);
  });

  await test.step("the next avatar is declared anew", async () => {
    await page.getByRole("button", { name: "lifter.glb" }).click();
    await expect(page.locator("#own-file-name")).toHaveText("Open: lifter.glb");
    await expect(page.getByLabel("This avatar depicts an adult")).not.toBeChecked();
    await expect(page.getByLabel("Man", { exact: true })).toBeChecked();
    expect(await page.evaluate(() => window.dynaskinOwn?.bound ?? null)).toBeNull();
    await page.getByLabel("This avatar depicts an adult").check();
    await expectBound(page);
  });

  await test.step("nothing was asked of any other machine, and nothing was sent", () => {
    expect(asked.filter((url) => !url.startsWith(origin) && !/^(blob|data):/.test(url))).toEqual(
      [],
    );
  });
  expect(problems).toEqual([]);
});

test("files that cannot be bound are refused with a sentence", async ({ page }) => {
  const problems = await openOwn(page);
  await answer(page);
  const refused = page.locator("#own-refused");
  await dropFile(page, "triangle.glb", triangle());
  await expect(refused).toContainText("triangle.glb is not bound.");
  await expect(refused).toContainText(/skin/i);
  await expectAccessible(page, "refused");
  await dropFile(page, "notes.vrm", "no avatar at all");
  await expect(refused).toContainText("notes.vrm is not bound.");
  await expect(refused).toContainText("It is no GLB or VRM file.");
  await dropFile(page, "cut.glb", runner().subarray(0, 60_000));
  await expect(refused).toContainText("cut.glb is not bound.");
  await expect(page.locator("#own-view")).toBeHidden();

  await test.step("the page goes on", async () => {
    await openRunner(page);
    await expect(refused).toBeEmpty();
    expect(await apartM(page)).toBeGreaterThan(0.01);
  });
  expect(problems).toEqual([]);
});

test("meshes are left out by a click or a key, the binding and the program are taken along", async ({
  page,
}) => {
  const problems = await openOwn(page);
  await openRunner(page);
  await expectAccessible(page, "playing");
  const code = page.locator("#own-code");
  await expect(code).toHaveValue(/await bindAvatar\(model, scene, \{ depicts: "adult", vrm \}\)/);
  const note = page.locator("#own-mesh-note");

  await test.step("by a click in the picture", async () => {
    const view = await page.locator("#own-view").boundingBox();
    if (!view) throw new Error("The picture is not there.");
    // The trunk of the right one of the two, which crouches.
    const at = { x: view.width * 0.76, y: view.height * 0.53 };
    await page.locator("#own-view").click({ position: at });
    await expect(note).toHaveText("Top stays as plain skinning has it.");
    await expect(page.getByLabel(/^Top/)).not.toBeChecked();
    await expect(code).toHaveValue(/exclude: \(mesh\) => \["Top"\]\.includes\(mesh\.name\)/);
    await page.locator("#own-view").click({ position: at });
    await expect(note).toHaveText("Top moves with the tissue.");
  });

  await test.step("on the keyboard", async () => {
    const before = await apartM(page);
    for (const name of [/^Top/, /^Leggings/, /^Skin/]) {
      await page.getByLabel(name).focus();
      await page.keyboard.press("Space");
    }
    await expect(page.getByLabel(/^Skin/)).not.toBeChecked();
    // Shoes move a little where they end.
    expect(await apartM(page)).toBeLessThan(0.002);
    for (const name of [/^Top/, /^Leggings/, /^Skin/]) {
      await page.getByLabel(name).focus();
      await page.keyboard.press("Space");
    }
    // In the same moment, the same again.
    expect(Math.abs((await apartM(page)) - before)).toBeLessThan(1e-4);
  });

  await test.step("the coverage map has other colours and its legend", async () => {
    await page.waitForTimeout(300);
    const before = await picture(page, "own-materials");
    await page.getByRole("switch", { name: "Coverage map" }).click();
    await expect(page.locator("#own-legend")).toBeVisible();
    await expect(page.locator("#own-ramp-end")).toHaveText(/^\d+ mm$/);
    await page.waitForTimeout(300);
    expect(differing(before, await picture(page, "own-coverage"), 24, TISSUE_SIDE)).toBeGreaterThan(
      0.03,
    );
    await expectAccessible(page, "coverage");
  });

  await test.step("a divider moves by keys", async () => {
    await page.getByText("Divider", { exact: true }).click();
    const divider = page.getByRole("slider", { name: "Divider between" });
    await divider.focus();
    await page.keyboard.press("ArrowLeft");
    await expect(divider).toHaveAttribute("aria-valuenow", "45");
  });

  await test.step("the binding is downloaded", async () => {
    const waiting = page.waitForEvent("download");
    await page.getByRole("button", { name: "Download the binding" }).click();
    const download = await waiting;
    expect(download.suggestedFilename()).toBe("runner.binding");
    const bytes = readFileSync(await download.path());
    expect(bytes.subarray(0, 8).toString("latin1")).toBe("DYNSKINB");
    expect(bytes.length).toBeLessThan(200_000);
  });
  expect(problems).toEqual([]);
});

test("an avatar dropped on the first page comes along", async ({ page }) => {
  await openDemo(page, "?paused=1");
  await dropFile(page, "lifter.glb", readFileSync(join(AVATARS, "lifter.glb")));
  await page.getByRole("button", { name: "Open it as an avatar" }).click();
  await expect(page).toHaveURL(/own\.html$/);
  await expect(page.locator("#own-file-name")).toHaveText("Open: lifter.glb");
});

for (const colorScheme of ["light", "dark"] as const) {
  test(`axe: the page before an avatar is there, ${colorScheme}`, async ({ page }) => {
    await page.emulateMedia({ colorScheme });
    await openOwn(page);
    await expectAccessible(page, colorScheme);
    await page.setViewportSize({ width: 390, height: 844 });
    await expectAccessible(page, `${colorScheme}, a phone`);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth)).toBe(
      true,
    );
  });
}

test("who asks for less motion finds it paused", async ({ page }) => {
  await page.emulateMedia({ reducedMotion: "reduce" });
  await openOwn(page);
  await dropFile(page, "runner.vrm", runner());
  await answer(page);
  await expectBound(page);
  await expect(page.getByText("Paused, because your system asks for less motion.")).toBeVisible();
  const time = () => page.evaluate(() => window.dynaskinOwn?.bound?.timeSeconds);
  const first = await time();
  await page.waitForTimeout(500);
  expect(await time()).toBe(first);
});

test("the Lab leads to the page", async ({ page }) => {
  await openDemo(page, "?paused=1");
  await page.getByRole("link", { name: "An avatar of your own" }).click();
  await expect(page.getByRole("heading", { level: 1, name: "Your own avatar" })).toBeVisible();
});
