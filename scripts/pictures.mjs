// npm run pictures [landing ...]: takes the pictures of README and docs from the built demo. Open
// them afterwards: a picture can be wrong in ways that no test sees.
import { join } from "node:path";
import { buildAll, buildDemo } from "./build.mjs";
import { ROOT } from "./lib/paths.mjs";
import { main, say, step } from "./lib/run.mjs";
import { findChromium } from "./toolchain.mjs";

const DOCS = join(ROOT, "docs");
const ARGUMENTS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--enable-unsafe-swiftshader",
];
const JPEG = { type: "jpeg", quality: 78 };
/** Seconds into the jump at which the body lands. */
const LANDING = "paused=1&time=1.85";

/** Opens the demo at an address and waits until all of it is on the screen. */
async function open(browser, url, query, viewport) {
  const page = await browser.newPage({ viewport });
  await page.goto(`${url}?resolution=full&${query}`);
  await page.waitForFunction(
    () =>
      window.dynaskinDemo?.ready && document.getElementById("loading").classList.contains("done"),
    null,
    { timeout: 120_000 },
  );
  // It fades, slowly where pictures are drawn in software.
  await page.addStyleTag({ content: ".loading { display: none !important }" });
  await page.waitForTimeout(1500);
  return page;
}

/** The body of the landing, over the average, so that what sportswear lets move can be seen. */
const LANDING_WEIGHT_KG = 74;

/** Off, on, and the offsets, beside each other. */
async function landing(browser, url) {
  const parts = [];
  for (const [title, query] of [
    ["plain skinning", "&dynamics=0"],
    ["dynaskin, in sportswear", ""],
    ["what dynaskin adds", "&heat=1"],
  ]) {
    const shared = `view=one&motion=jump&${LANDING}`;
    const page = await open(browser, url, `${shared}${query}`, { width: 1000, height: 760 });
    await page.addStyleTag({
      content:
        ".panel, .transport, .brand, .names, .readings { display: none !important }" +
        ".legend { inset: auto auto 48px 116px !important; width: 210px !important; " +
        "transform-origin: left bottom; scale: 0.76 }",
    });
    await page.locator("#trait-weight").evaluate((input, weightKg) => {
      input.value = weightKg;
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }, `${LANDING_WEIGHT_KG}`);
    await page.waitForTimeout(1500);
    const clip = { x: 108, y: 218, width: 362, height: 500 };
    parts.push({ title, png: (await page.screenshot({ clip })).toString("base64") });
    await page.close();
  }
  const page = await browser.newPage({ viewport: { width: 1100, height: 500 } });
  const figures = parts.map(
    ({ title, png }) => `<div><img src="data:image/png;base64,${png}" /><b>${title}</b></div>`,
  );
  await page.setContent(
    `<style>body{margin:0;display:flex;gap:7px;font:700 18px system-ui}div{position:relative}
     b{position:absolute;left:14px;top:12px;color:#1d2027}</style>${figures.join("")}`,
  );
  return page;
}

const PICTURES = {
  landing,
  "demo-first-view": async (browser, url) => {
    const page = await open(browser, url, "", { width: 1280, height: 720 });
    // The first landing, at its deepest.
    await page.evaluate(() => {
      window.dynaskinDemo.restartStory();
      for (let picture = 0; picture < 40; picture += 1) window.dynaskinDemo.advanceStory(1 / 60);
    });
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
    const page = await open(browser, url, "", { width: 1000, height: 640 });
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

main(async () => {
  const chosen = process.argv.slice(2);
  const unknown = chosen.find((name) => !(name in PICTURES));
  if (unknown) {
    throw new Error(`No picture is called ${unknown}: ${Object.keys(PICTURES).join(", ")}.`);
  }
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  await buildAll();
  await step("Demo", buildDemo);
  const { chromium } = await import("@playwright/test");
  const { preview } = await import("vite");
  const server = await preview({ root: join(ROOT, "web", "demo"), preview: { port: 5189 } });
  const browser = await chromium.launch({ executablePath, args: ARGUMENTS });
  try {
    for (const name of chosen.length > 0 ? chosen : Object.keys(PICTURES)) {
      const page = await PICTURES[name](browser, server.resolvedUrls.local[0]);
      const path = join(DOCS, `${name}.jpg`);
      await page.screenshot({ ...JPEG, path });
      await page.close();
      say(`  ${path}`);
    }
  } finally {
    await browser.close();
    await server.close();
  }
});
