// Models that cannot be used and links that make no sense: the page says so and goes on.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page } from "@playwright/test";
import type {} from "../../web/demo/src/hook.js";
import { ROOT } from "./places.js";
import { openDemo, test } from "./support.js";

const MALE = join(ROOT, "models", "male");
const LETTER = Buffer.from("Dear reader, this is no network.".repeat(400));

/** Answers requests for a file of the male model with other bytes. */
function replace(page: Page, file: string, body: Buffer | string): Promise<unknown> {
  return page.route(`**/male/${file}`, (route) => route.fulfill({ body }));
}

/** The male `bundle.json` with another hash for one of its files. */
function bundleWith(key: "body" | "predictor", sha256: string): string {
  const bundle = JSON.parse(readFileSync(join(MALE, "bundle.json"), "utf8"));
  const file = key === "body" ? bundle.body : bundle.lowered[key];
  file.sha256 = sha256;
  return JSON.stringify(bundle);
}

const sha256 = (bytes: Buffer) => createHash("sha256").update(bytes).digest("hex");
const halfBody = () => readFileSync(join(MALE, "body.glb")).subarray(0, 400_000);

const BAD_MODELS: [string, (page: Page) => Promise<unknown>, RegExp][] = [
  [
    "a wrong hash",
    (page) => replace(page, "bundle.json", bundleWith("predictor", "0".repeat(64))),
    /predictor.*SHA-256.*fetch the file again/i,
  ],
  [
    "a predictor that is no network",
    async (page) => {
      await replace(page, "predictor.lowered", LETTER);
      await replace(page, "bundle.json", bundleWith("predictor", sha256(LETTER)));
    },
    /predictor/i,
  ],
  [
    "a truncated body.glb",
    (page) => replace(page, "body.glb", halfBody()),
    /body\.glb.*SHA-256.*fetch the file again/i,
  ],
  [
    "a truncated body.glb of the right hash",
    async (page) => {
      await replace(page, "body.glb", halfBody());
      await replace(page, "bundle.json", bundleWith("body", sha256(halfBody())));
    },
    /body|GLB/i,
  ],
  ["no network", (page) => page.route("**/male/*.lowered", (route) => route.abort()), /\.lowered/i],
];

for (const [what, prepare, expected] of BAD_MODELS) {
  // A page of its own: one that has played other methods loads networks as ONNX.
  test(`${what}: the switch to it is refused, and the old body goes on`, async ({ page }) => {
    await prepare(page);
    const problems = await openDemo(page);
    const state = () =>
      page.evaluate(() => ({
        model: window.dynaskinDemo?.model?.name,
        dynamics: window.dynaskinDemo?.avatar?.dynamics,
      }));
    await page.getByText("Male", { exact: true }).click();
    await expect(page.getByRole("alert")).toContainText("The male body could not be loaded");
    await expect(page.getByRole("alert")).toContainText(expected);
    console.log(`${what}: ${await page.getByRole("alert").locator("p").textContent()}`);
    expect(await state()).toEqual({ model: "female", dynamics: true });
    await expect(page.locator("#now-playing")).toContainText("female body");
    await expect(page.getByRole("radio", { name: "Female" })).toBeChecked();
    expect(page.url()).not.toContain("male");
    const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds);
    const before = await time();
    await expect.poll(time).not.toBe(before);
    expect(problems).toEqual([]);
  });
}

/** Links, and what the page then says it plays. */
const NONSENSE: [string, string][] = [
  ["?motion=jump&tempo=5", "Jump · female body"],
  ["?motion=jump&tempo=0.6&height=0.45", "Jump · female body"],
  ["?motion=hop&tempo=-1e99&height=NaN", "Hop · female body"],
  ["?motion=../../etc&sex=robot&speed=77&backend=glide", "Jump · female body"],
  ["?motion=walk&shape=1e999,,abc,9&tempo=Infinity&paused=perhaps", "Walk · female body"],
  ["?motion=%E0%A4%A&tempo[]=2&&&=&height=0x20", "Jump · female body"],
];

for (const [query, playing] of NONSENSE) {
  test(`the link ${query} starts the page`, async ({ page }) => {
    const problems = await openDemo(page, query);
    await expect(page.locator("#now-playing")).toHaveText(playing);
    await expect(page.getByRole("combobox", { name: "Motion" })).not.toHaveValue("");
    await expect(page.getByLabel("Playback speed")).not.toHaveValue("");
    await expect(page.getByRole("alert")).not.toContainText("could not");
    const time = () => page.evaluate(() => window.dynaskinDemo?.timeSeconds);
    const before = await time();
    await expect.poll(time).not.toBe(before);
    expect(problems).toEqual([]);
  });
}
