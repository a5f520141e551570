// npm run faults -- ROUNDS [chromium] [firefox]: forces faults on the SDK in real browsers, and counts what
// is told to who waits and what is left hanging. So many rounds of each kind: WebGL2 contexts taken away,
// WebGPU devices destroyed, tabs hidden, loads aborted, workers killed. It takes minutes and is not part of
// npm test; `npm test -- wasm tsc` builds what it runs on.
import { spawnSync } from "node:child_process";
import { existsSync } from "node:fs";
import { join } from "node:path";
import puppeteer from "puppeteer-core";
import { SDK } from "./lib/paths.mjs";
import { main, red, say, which } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { findChromium, findFirefox } from "./toolchain.mjs";

/** A tab must hide, or draw again, within this time. */
const TAB_MS = 20_000;

const CHROMIUM = [
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--enable-unsafe-swiftshader",
  "--enable-unsafe-webgpu",
  "--use-webgpu-adapter=swiftshader",
  "--enable-features=Vulkan",
  "--use-vulkan=swiftshader",
  "--use-angle=swiftshader",
  // A page may lose its context as often as it likes.
  "--disable-domain-blocking-for-3d-apis",
];

/** Without a graphics card Firefox draws WebGL2 in software only when it is told to. */
const FIREFOX = {
  "webgl.force-enabled": true,
  "gfx.webrender.software": true,
  "webgl.max-contexts": 1000,
};

async function launch(name) {
  if (name === "chromium") {
    const executablePath = findChromium();
    if (!executablePath) return null;
    return puppeteer.launch({
      executablePath,
      headless: false,
      args: CHROMIUM,
      protocolTimeout: 0,
    });
  }
  const executablePath = findFirefox();
  if (!executablePath) return null;
  const browser = "firefox";
  const options = { browser, executablePath, headless: false, extraPrefsFirefox: FIREFOX };
  return puppeteer.launch({ ...options, protocolTimeout: 0 });
}

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Waits for the page to be so; whether it came to be. */
async function becomes(page, isSo) {
  const endMs = performance.now() + TAB_MS;
  while (performance.now() < endMs) {
    const shown = await page.evaluate(() => globalThis.faults.shown());
    if (isSo(shown)) return shown;
    await pause(20);
  }
  return null;
}

/** Another tab is brought to the front, and the page back again. */
async function hiddenTabs(browser, page, rounds) {
  const tally = { forced: 0, told: 0, hanging: 0, problems: [] };
  const other = await browser.newPage();
  await page.bringToFront();
  await page.evaluate(() => globalThis.faults.show());
  for (let round = 0; round < rounds; round += 1) {
    await other.bringToFront();
    if (!(await becomes(page, ({ hidden }) => hidden))) {
      tally.problems.push("the browser does not hide a tab behind another");
      break;
    }
    tally.forced += 1;
    // Some for longer than a stall takes.
    await pause(round % 3 === 0 ? 300 : 10);
    const { frames } = await page.evaluate(() => globalThis.faults.shown());
    await page.bringToFront();
    const back = await becomes(page, (shown) => !shown.hidden && shown.frames > frames + 1);
    if (back) tally.told += 1;
    else tally.hanging += 1;
  }
  const { problems } = await page.evaluate(() => globalThis.faults.shown());
  await page.evaluate(() => globalThis.faults.end());
  tally.problems.push(...problems);
  await other.close();
  return tally;
}

const KINDS = [
  ["WebGL2 contexts lost", "contexts"],
  ["WebGPU devices destroyed", "devices"],
  ["loads aborted", "aborts"],
  ["workers killed", "killedWorkers"],
  ["tabs hidden", null],
];

function row(cells) {
  const [browser, kind, ...rest] = cells.map(String);
  say(browser.padEnd(10) + kind.padEnd(26) + rest.map((cell) => cell.padStart(10)).join(""));
}

async function force(name, rounds) {
  const browser = await launch(name);
  if (!browser) {
    say(`  skipped: ${name} is not installed`);
    return [];
  }
  const server = await serve();
  const wrong = [];
  try {
    const page = await browser.newPage();
    page.on("pageerror", (error) => wrong.push(`uncaught: ${error?.message ?? error}`));
    await page.goto(`${server.url}/blank`);
    const places = { sdk: `${server.url}/web/sdk/dist`, model: `${server.url}/models/female/` };
    await page.evaluate(
      async (module, where) => {
        globalThis.faults = await import(module);
        await globalThis.faults.begin(where);
      },
      `${server.url}/scripts/faults/page.mjs`,
      places,
    );
    for (const [title, kind] of KINDS) {
      const startMs = performance.now();
      const tally = kind
        ? await page.evaluate((of, count) => globalThis.faults[of](count), kind, rounds)
        : await hiddenTabs(browser, page, rounds);
      if (tally === null) {
        row([name, title, "none here"]);
        continue;
      }
      const { forced, told, hanging, problems } = tally;
      const seconds = Math.round((performance.now() - startMs) / 1000);
      row([name, title, forced, told, hanging, problems.length, seconds]);
      if (hanging > 0) wrong.push(`${title}: ${hanging} left hanging`);
      wrong.push(...problems.slice(0, 5).map((problem) => `${title}: ${problem}`));
    }
    // The browser tells the end of a worker a moment later.
    const endMs = performance.now() + TAB_MS;
    while (page.workers().length > 0 && performance.now() < endMs) await pause(100);
    const left = page.workers().length;
    if (left > 0) wrong.push(`${left} workers are left`);
    say(`${name.padEnd(10)}workers left in the end: ${left}`);
  } finally {
    await browser.close();
    server.close();
  }
  return wrong.map((problem) => `${name}: ${problem}`);
}

main(async () => {
  const [rounds, ...names] = process.argv.slice(2);
  if (!(Number(rounds) > 0))
    throw new Error("Give the rounds of each kind: `npm run faults -- 100`.");
  if (!existsSync(join(SDK, "dist", "index.js"))) {
    throw new Error("There is no SDK to try: run `npm test -- wasm tsc` first.");
  }
  // Pages are hidden, and draw with WebGPU, only in windows.
  if (!process.env.DISPLAY) {
    const xvfb = which("xvfb-run");
    if (!xvfb) throw new Error("There is neither a display nor xvfb-run.");
    const screen = ["-a", "-s", "-screen 0 1600x1200x24", process.execPath];
    const again = spawnSync(xvfb, [...screen, ...process.argv.slice(1)], { stdio: "inherit" });
    process.exitCode = again.status ?? 1;
    return;
  }
  row(["browser", "fault", "forced", "told", "hanging", "wrong", "seconds"]);
  const wrong = [];
  for (const name of names.length > 0 ? names : ["chromium", "firefox"]) {
    wrong.push(...(await force(name, Number(rounds))));
  }
  for (const problem of wrong) say(red(problem));
  if (wrong.length > 0) process.exitCode = 1;
});
