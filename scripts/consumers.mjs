// npm run test:consumers: packs the SDK, installs the tarball in applications made with the usual
// tools, and opens each in Chromium. Needs the network once, so it is not part of npm test.
// `npm run test:consumers -- build open` repeats only the named steps.
import { cpSync, mkdirSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { CACHE, MODELS, ROOT, SDK } from "./lib/paths.mjs";
import { main, run, say, step } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { buildSdk, tscProgram } from "./sdk.mjs";
import { findChromium } from "./toolchain.mjs";

const FOLDER = join(CACHE, "consumers");
const TARBALL = join(FOLDER, "dynaskin.tgz");

const node = (program, ...args) =>
  run(process.execPath, [join(FOLDER, "node_modules", program), ...args], {
    cwd: FOLDER,
    quiet: true,
  });
const npm = (...args) => run("npm", args, { cwd: FOLDER, quiet: true });

/** A fresh copy of tests/consumers with the packed SDK installed; its other packages are kept. */
async function install() {
  mkdirSync(FOLDER, { recursive: true });
  for (const old of ["dist-vite", "dist-webpack", "dist-esbuild", "models", "src", "types"]) {
    rmSync(join(FOLDER, old), { recursive: true, force: true });
  }
  cpSync(join(ROOT, "tests", "consumers"), FOLDER, { recursive: true });
  symlinkSync(MODELS, join(FOLDER, "models"));
  const { output } = await run("npm", ["pack", "--pack-destination", FOLDER], {
    cwd: SDK,
    quiet: true,
  });
  cpSync(join(FOLDER, output.trim().split("\n").at(-1)), TARBALL);
  await npm("install", "--no-audit", "--no-fund", "--omit=peer");
  // The version stays the same between runs, so npm would keep an old copy.
  rmSync(join(FOLDER, "node_modules", "dynaskin"), { recursive: true, force: true });
  await npm("install", "--no-save", "--no-audit", "--no-fund", TARBALL);
}

/** What the registry's users check before they trust a package. */
async function lint() {
  await node("publint/src/cli.js", "run", "node_modules/dynaskin", "--strict");
  await node(
    ...["@arethetypeswrong/cli/dist/index.js", TARBALL, "--profile", "esm-only"],
    ...["--exclude-entrypoints", "worker/thread", "--format", "ascii"],
  );
  await node("size-limit/bin.js");
}

/** Strict applications that check the package's declarations as well. */
async function types() {
  for (const resolution of ["node16", "bundler"]) {
    for (const engine of ["three", "babylon"]) {
      const project = join(FOLDER, "types", `tsconfig.${resolution}-${engine}.json`);
      await run(process.execPath, [tscProgram(), "-p", project], { quiet: true });
    }
  }
}

async function build() {
  writeFileSync(
    join(FOLDER, "vite.config.js"),
    'export default { build: { outDir: "dist-vite", rolldownOptions: { input: ["index.html", "worker.html"] } }, base: "/dist-vite/" };\n',
  );
  await node("vite/bin/vite.js", "build", "--logLevel", "warn");
  await run(process.execPath, [join(FOLDER, "webpack.mjs")], { cwd: FOLDER, quiet: true });
  await node(
    ...["esbuild/bin/esbuild", "src/inline.js", "--bundle", "--format=esm", "--minify"],
    ...["--outfile=dist-esbuild/inline.js", "--log-level=error"],
  );
  for (const [page, script] of [
    ["webpack", "/dist-webpack/main.js"],
    ["webpack-worker", "/dist-webpack/worker.js"],
    ["esbuild", "/dist-esbuild/inline.js"],
  ]) {
    writeFileSync(
      join(FOLDER, `${page}.html`),
      `<!doctype html><title>waiting</title><link rel="icon" href="data:,"><script type="module" src="${script}"></script>\n`,
    );
  }
}

/** Opens a page and returns its title once the application has written it. */
async function titleOf(browser, url) {
  const page = await browser.newPage();
  try {
    await page.goto(url);
    await page.waitForFunction(() => document.title !== "waiting", null, { timeout: 60_000 });
    return await page.title();
  } finally {
    await page.close();
  }
}

async function open(browser, name, url) {
  const title = await titleOf(browser, url);
  const offsetMm = Number(/^offset ([\d.]+) mm$/.exec(title)?.[1]);
  if (!(offsetMm > 1)) throw new Error(`${name}: ${title}`);
  say(`  ${name}: ${title}`);
}

async function openAll() {
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  const { chromium } = await import("@playwright/test");
  const args = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"];
  const browser = await chromium.launch({ executablePath, args });
  const files = await serve({ root: FOLDER });
  const { createServer } = await import("vite");
  const dev = await createServer({
    root: FOLDER,
    base: "/",
    server: { port: 5194 },
    logLevel: "error",
  });
  await dev.listen();
  try {
    await open(browser, "import map", `${files.url}/importmap/index.html`);
    await open(browser, "Vite build", `${files.url}/dist-vite/index.html`);
    await open(browser, "Vite build, worker", `${files.url}/dist-vite/worker.html`);
    await open(browser, "webpack", `${files.url}/webpack.html`);
    await open(browser, "webpack, worker", `${files.url}/webpack-worker.html`);
    await open(browser, "esbuild with dynaskin/inline", `${files.url}/esbuild.html`);
    await open(browser, "Vite dev", "http://localhost:5194/index.html");
    await open(browser, "Vite dev, worker", "http://localhost:5194/worker.html");
  } finally {
    await dev.close();
    await browser.close();
    files.close();
  }
}

const STEPS = [
  ["sdk", "SDK", buildSdk],
  ["install", "Packed and installed", install],
  ["lint", "publint, are the types wrong, size-limit", lint],
  ["types", "Strict TypeScript applications", types],
  ["build", "Bundled", build],
  ["open", "Opened in Chromium", openAll],
];

main(async () => {
  const chosen = process.argv.slice(2);
  for (const [name, title, work] of STEPS) {
    if (chosen.length === 0 || chosen.includes(name)) await step(title, work);
  }
});
