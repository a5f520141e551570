// The programs of the README, of the guide for captures and of the demo, as a reader would copy them.
import { mkdirSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { build } from "vite";
import { PACKAGES, writeModelPackages } from "../../scripts/lib/model-packages.mjs";
import { snippetsOf } from "../../scripts/lib/snippets.mjs";
import { REPOSITORY_URL, ROOT } from "./places.js";
import { differing, openDemo, picture, variation } from "./support.js";

const FOLDER = "test-results/readme";
const ALL = { x: 0, y: 0, width: 1, height: 1 };

/** An application's folder with the packages installed. */
function application(name: string): string {
  const folder = join(ROOT, FOLDER, name);
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(join(folder, "node_modules"), { recursive: true });
  const installed: [string, string][] = [
    ["dynaskin", join(ROOT, "web", "sdk")],
    ["three", join(ROOT, "node_modules", "three")],
    ["dynaskin-female", join(PACKAGES, "dynaskin-female")],
    ["dynaskin-male", join(PACKAGES, "dynaskin-male")],
  ];
  for (const [name, target] of installed) symlinkSync(target, join(folder, "node_modules", name));
  return folder;
}

/** The first piece of code of a page in that language. */
async function codeOf(page: string, language: "html" | "js"): Promise<string> {
  const found = (await snippetsOf(join(ROOT, page))).find((each) => each.language === language);
  if (!found) throw new Error(`${page} has no piece of ${language}.`);
  return found.code;
}

/** Opens a page and looks at it twice: a body must be there, and it must move. */
async function expectMovingBody(page: Page, address: string, name: string): Promise<void> {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => {
    // Browsers ask every server for an icon.
    const isIcon = message.location().url.endsWith("/favicon.ico");
    if (message.type() === "error" && !isIcon) problems.push(message.text());
  });
  await page.goto(address);
  await expect
    .poll(
      async () => {
        expect(problems).toEqual([]);
        return variation(await picture(page, name), ALL);
      },
      { timeout: 120_000 },
    )
    .toBeGreaterThan(12);
  const first = await picture(page, name);
  await expect
    .poll(async () => differing(first, await picture(page, `${name}-later`), 12, ALL))
    .toBeGreaterThan(0.005);
  expect(problems).toEqual([]);
}

test.beforeAll(() => {
  writeModelPackages();
});

test("the page without any tool shows a body that moves", async ({ page }) => {
  const folder = application("page");
  writeFileSync(join(folder, "index.html"), await codeOf("README.md", "html"));
  await expectMovingBody(page, `${REPOSITORY_URL}/${FOLDER}/page/index.html`, "readme-page");
});

test("the page that the demo gives away shows a body that moves", async ({ page }) => {
  const folder = application("given");
  await openDemo(page, "?motion=twist&sex=male&shape=1.5,-0.5&strength=1.5&paused=1");
  await page.keyboard.press("u");
  await expect(page.locator("#code-text")).toBeVisible();
  writeFileSync(join(folder, "index.html"), await page.locator("#code-text").inputValue());
  await expectMovingBody(page, `${REPOSITORY_URL}/${FOLDER}/given/index.html`, "given-page");
});

test("the page of the guide for captures shows a body that moves", async ({ page }) => {
  const folder = application("captures");
  // Instead of a model that was trained on captures, and the shape of one of their people.
  symlinkSync(join(ROOT, "models", "female"), join(folder, "my-model"));
  const person = { shape: [0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0], sequence: "50004_hips" };
  writeFileSync(join(folder, "50004.json"), JSON.stringify(person));
  writeFileSync(join(folder, "index.html"), await codeOf("docs/your-captures.md", "html"));
  await expectMovingBody(page, `${REPOSITORY_URL}/${FOLDER}/captures/index.html`, "captures-page");
});

for (const [name, readme] of [
  ["repository", "README.md"],
  ["package", "web/sdk/README.md"],
] as const) {
  test(`the program with Vite of the README of the ${name} shows a body that moves`, async ({
    page,
  }) => {
    const folder = application(`vite-${name}`);
    mkdirSync(join(folder, "src"));
    writeFileSync(join(folder, "src", "main.js"), await codeOf(readme, "js"));
    // As create-vite's vanilla template has it.
    const html = `<!doctype html><html lang="en"><body><div id="app"></div>
      <script type="module" src="/src/main.js"></script></body></html>`;
    writeFileSync(join(folder, "index.html"), html);
    await build({ root: folder, base: "./", configFile: false, logLevel: "error" });
    const address = `${REPOSITORY_URL}/${FOLDER}/vite-${name}/dist/index.html`;
    await expectMovingBody(page, address, `readme-vite-${name}`);
  });
}
