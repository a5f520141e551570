// npm run pictures [-- NAME ...]: takes the pictures of README, docs and the demo from the built demo, with
// --as-built from the build that is there. Open them afterwards: a picture can be wrong in ways that no test sees.
import { join } from "node:path";
import { buildAll, buildDemo } from "./build.mjs";
import { ROOT } from "./lib/paths.mjs";
import { main, say, step } from "./lib/run.mjs";
import { installTools } from "./lib/tools.mjs";
import { makeBaked } from "./pictures/baked.mjs";
import { makeLoop } from "./pictures/loop.mjs";
import { advance, open } from "./pictures/open.mjs";
import { makePoster } from "./pictures/poster.mjs";
import { findChromium } from "./toolchain.mjs";

const DOCS = join(ROOT, "docs");
const ARGUMENTS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--enable-unsafe-swiftshader",
];
const JPEG = { type: "jpeg", quality: 78 };
/** Pictures of pages, into docs. */
const PICTURES = {
  "demo-first-view": async (browser, url) => {
    const page = await open(browser, url, "", { width: 1280, height: 720 });
    // The first landing, at its deepest.
    await page.evaluate(() => window.dynaskinDemo.restartStory());
    await advance(page, 40 / 60);
    await page.waitForTimeout(1500);
    return page;
  },
  "demo-four-actors": (browser, url) =>
    open(
      browser,
      url,
      "clip=one-leg-hop&left=linear&right=dynaskin&third=casas-otaduy&fourth=truth" +
        "&heat=error&plots=1&paused=1&time=2.62",
      { width: 1280, height: 800 },
    ),
  "demo-benchmark": async (browser, url) => {
    const page = await open(browser, url, "lab=1&paused=1", { width: 1000, height: 640 });
    await page.locator("#view").focus();
    await page.keyboard.press("k");
    await page.locator("#benchmark-note").filter({ hasNotText: "…" }).waitFor({ timeout: 120_000 });
    return page;
  },
  "demo-by-hand": async (browser, url) => {
    const query = "view=one&motion=by-hand&caption=0";
    const page = await open(browser, url, query, { width: 390, height: 844 });
    const grip = await page.locator("#grip-pelvis").boundingBox();
    await page.mouse.move(grip.x + grip.width / 2, grip.y + grip.height / 2);
    await page.mouse.down();
    await page.mouse.move(grip.x + 46, grip.y - 42, { steps: 12 });
    await page.waitForTimeout(700);
    return page;
  },
};

/** Pictures that are made of several; each returns its path. */
const MADE = {
  poster: makePoster,
  baked: makeBaked,
  loop: async (browser, url) => {
    const tools = await installTools(join(ROOT, "scripts", "pictures", "tools"), "pictures");
    return makeLoop(browser, url, tools);
  },
};

async function take(name, browser, url, launch) {
  if (name in MADE) return MADE[name](browser, url, launch);
  const page = await PICTURES[name](browser, url);
  const path = join(DOCS, `${name}.jpg`);
  await page.screenshot({ ...JPEG, path });
  await page.close();
  return path;
}

main(async () => {
  const isBuilt = process.argv.includes("--as-built");
  const chosen = process.argv.slice(2).filter((name) => name !== "--as-built");
  const known = Object.keys({ ...MADE, ...PICTURES });
  const unknown = chosen.find((name) => !known.includes(name));
  if (unknown) throw new Error(`No picture is called ${unknown}: ${known.join(", ")}.`);
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  if (!isBuilt) {
    await buildAll();
    await step("Demo", buildDemo);
  }
  const { chromium } = await import("@playwright/test");
  const { preview } = await import("vite");
  const server = await preview({ root: join(ROOT, "web", "demo"), preview: { port: 5189 } });
  const launch = (args, headless = !process.env.DISPLAY) =>
    chromium.launch({ executablePath, args, headless });
  const browser = await launch(ARGUMENTS, true);
  try {
    for (const name of chosen.length > 0 ? chosen : known) {
      say(`  ${await take(name, browser, server.resolvedUrls.local[0], launch)}`);
    }
  } finally {
    await browser.close();
    await server.close();
  }
});
