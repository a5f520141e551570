// npm run bench:first-view [-- BASELINE_DIST ...]: what a first visitor of the built demo waits for on Chromium's
// "Fast 4G", from a server that sends packed files and from one that does not. Folders of other builds are measured in
// the same run. A bench: how long pictures take to draw depends on the machine.
import { existsSync } from "node:fs";
import { join, relative, resolve } from "node:path";
import { measureFirstView } from "./bench/first-view.mjs";
import { DEMO, ROOT } from "./lib/paths.mjs";
import { main, say } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { findChromium } from "./toolchain.mjs";

/** Visits of which the median counts. */
const ROUNDS = 3;
const ARGUMENTS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--enable-unsafe-swiftshader",
];
const COLUMNS = ["poster", "moving", "networks"];

const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];
const seconds = (value) => (value === null ? "-" : `${value.toFixed(2)} s`);

async function measureBuild(browser, dist, packed) {
  const server = await serve({ root: dist, packed });
  try {
    const visits = [];
    for (let round = 0; round < ROUNDS; round += 1) {
      visits.push(await measureFirstView(browser, `${server.url}/index.html`));
    }
    const times = COLUMNS.map((name) => {
      const values = visits.map((visit) => visit[name]);
      return seconds(values.includes(null) ? null : median(values));
    });
    return [...times, `${(median(visits.map(({ bytes }) => bytes)) / 1e6).toFixed(2)} MB`];
  } finally {
    server.close();
  }
}

main(async () => {
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  const builds = [join(DEMO, "dist"), ...process.argv.slice(2).map((path) => resolve(path))];
  for (const dist of builds) {
    if (!existsSync(join(dist, "index.html"))) {
      throw new Error(
        `${dist} has no index.html; \`npm run build\` makes ${relative(ROOT, builds[0])}.`,
      );
    }
  }
  const { chromium } = await import("@playwright/test");
  const browser = await chromium.launch({ executablePath, args: ARGUMENTS });
  try {
    const row = (name, cells) =>
      say(name.padEnd(44) + cells.map((cell) => cell.padStart(10)).join(""));
    row("Fast 4G", [...COLUMNS, "bytes"]);
    for (const packed of [true, false]) {
      for (const dist of builds) {
        const name = `${relative(ROOT, dist)}, ${packed ? "brotli" : "not packed"}`;
        row(name, await measureBuild(browser, dist, packed));
      }
    }
  } finally {
    await browser.close();
  }
});
