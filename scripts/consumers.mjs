// npm run test:consumers: packs the SDK and the models, installs the tarballs in applications made with the usual
// tools, and opens each in Chromium. Needs the network once, so it is not part of npm test.
// `npm run test:consumers -- build open` repeats only the named steps. The size limits are for the
// WebAssembly that is published: run `npm run build` before.
import { spawn } from "node:child_process";
import { createHash } from "node:crypto";
import {
  cpSync,
  existsSync,
  mkdirSync,
  readFileSync,
  rmSync,
  symlinkSync,
  writeFileSync,
} from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { CACHE, MODELS, ROOT } from "./lib/paths.mjs";
import { freePorts } from "./lib/ports.mjs";
import { main, run, say, step } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { packAll } from "./pack.mjs";
import { buildSdk, tscProgram } from "./sdk.mjs";
import { findChromium } from "./toolchain.mjs";

const FOLDER = join(CACHE, "consumers");
const TARBALL = join(FOLDER, "dynaskin.tgz");

/** What is packed and installed. */
const PACKED = ["dynaskin", "dynaskin-female", "dynaskin-male"];

const NEXT = join(FOLDER, "next");
/** The worker's own part alone has as many; what it imports, some tools put in files beside it. */
const LEAST_THREAD_BYTES = 1000;
const OUTPUTS = ["dist-vite", "dist-vite7", "dist-webpack", "dist-esbuild"];
// Vite sets NODE_ENV for its own process, and Next would inherit it.
const QUIET_NEXT = { NEXT_TELEMETRY_DISABLED: "1", NODE_ENV: "production" };

const installed = (...path) => join(FOLDER, "node_modules", ...path);
const node = (program, ...args) =>
  run(process.execPath, [installed(program), ...args], { cwd: FOLDER, quiet: true });
/** Run as it is: esbuild's own installation puts a native program there where it may. */
const esbuild = (name) =>
  run(
    installed("esbuild", "bin", "esbuild"),
    [`src/${name}.js`, "--bundle", "--format=esm", "--minify", "--log-level=error"].concat(
      `--outfile=dist-esbuild/${name}.js`,
    ),
    { cwd: FOLDER, quiet: true },
  );
const npm = (...args) => run("npm", args, { cwd: FOLDER, quiet: true });

/** A fresh copy of tests/consumers with the packed SDK installed; its other packages are kept. */
async function install() {
  mkdirSync(FOLDER, { recursive: true });
  for (const old of [...OUTPUTS, "models", "src", "types", "next"]) {
    rmSync(join(FOLDER, old), { recursive: true, force: true });
  }
  cpSync(join(ROOT, "tests", "consumers"), FOLDER, { recursive: true });
  symlinkSync(MODELS, join(FOLDER, "models"));
  cpSync(MODELS, join(NEXT, "public", "models"), { recursive: true });
  const [sdk, ...models] = await packAll(join(FOLDER, "packed"));
  cpSync(sdk, TARBALL);
  await installLocked();
  // The version stays the same between runs, so npm would keep an old copy.
  for (const name of PACKED) rmSync(installed(name), { recursive: true, force: true });
  await npm("install", "--no-save", "--no-audit", "--no-fund", "--omit=peer", TARBALL, ...models);
  writePrograms();
}

/**
 * The first programs in the package's README and in docs/renderer.md, as a reader would copy them, each
 * with what the test watches.
 */
function writePrograms() {
  const write = (name, code, watch) => {
    if (!code) throw new Error(`There is no program for src/${name}.`);
    writeFileSync(
      join(FOLDER, "src", name),
      `${code}import * as watch from "./show.js";\n${watch}\n`,
    );
  };
  const readme = readFileSync(installed("dynaskin", "README.md"), "utf8");
  const [, first] = /```js\n(.*?)```/s.exec(readme) ?? [];
  write("readme.js", first, "watch.showLargest(avatar);");
  const guide = readFileSync(join(ROOT, "docs", "renderer.md"), "utf8");
  const [, drawing] = /<script type="module">\n(.*?)<\/script>/s.exec(guide) ?? [];
  write("renderer.js", drawing, "watch.showDrawn(canvas);");
}

/** What the lock file names, unless it is there from an earlier run. */
async function installLocked() {
  const lock = readFileSync(join(FOLDER, "package-lock.json"));
  const key = createHash("sha256").update(lock).digest("hex");
  const stamp = installed(".dynaskin-lock");
  if (existsSync(stamp) && readFileSync(stamp, "utf8") === key) return;
  await npm("ci", "--no-audit", "--no-fund", "--omit=peer");
  writeFileSync(stamp, key);
}

/** What the registry's users check before they trust a package. */
async function lint() {
  for (const name of [
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "README.md",
    "THIRD_PARTY_NOTICES.txt",
    "sbom.cdx.json",
  ]) {
    if (!existsSync(installed("dynaskin", name))) throw new Error(`The package lacks ${name}.`);
  }
  for (const name of PACKED) {
    await node("publint/src/cli.js", "run", `node_modules/${name}`, "--strict");
  }
  await node(
    ...["@arethetypeswrong/cli/dist/index.js", TARBALL, "--profile", "esm-only"],
    ...["--exclude-entrypoints", "worker/thread", "--format", "ascii"],
  );
  await node("size-limit/bin.js");
}

/** Strict applications that check the package's declarations as well. */
async function types() {
  for (const resolution of ["node16", "bundler"]) {
    for (const engine of ["three", "babylon", "renderer"]) {
      const project = join(FOLDER, "types", `tsconfig.${resolution}-${engine}.json`);
      await run(process.execPath, [tscProgram(), "-p", project], { quiet: true });
    }
  }
}

async function build() {
  await node("vite/bin/vite.js", "build", "--logLevel", "warn");
  await node("vite7/bin/vite.js", "build", "--logLevel", "warn", "-c", "vite7.config.js");
  await run(process.execPath, [join(FOLDER, "webpack.mjs")], { cwd: FOLDER, quiet: true });
  await esbuild("inline");
  await buildThreads();
  for (const [page, script] of [
    ["webpack", "/dist-webpack/main.js"],
    ["webpack-worker", "/dist-webpack/worker.js"],
    ["esbuild", "/dist-esbuild/inline.js"],
    ["esbuild-worker", "/dist-esbuild/own-worker.js"],
  ]) {
    writeFileSync(
      join(FOLDER, `${page}.html`),
      `<!doctype html><title>waiting</title><link rel="icon" href="data:,"><script type="module" src="${script}"></script>\n`,
    );
  }
}

/**
 * The worker's script as an application's own file, for `createWorker`. It exports nothing: a bundler
 * that thinks it has no side effects leaves an empty file.
 */
async function buildThreads() {
  for (const name of ["thread", "own-worker"]) {
    await esbuild(name);
  }
  for (const [tool, file] of [
    ["esbuild", "dist-esbuild/thread.js"],
    ["Vite 8", "dist-vite/thread.js"],
    ["Vite 7", "dist-vite7/thread.js"],
    ["webpack", "dist-webpack/thread.js"],
  ]) {
    const script = readFileSync(join(FOLDER, file), "utf8");
    say(`  ${tool}: the worker's script has ${script.length} bytes`);
    if (script.length < LEAST_THREAD_BYTES || !script.includes("addEventListener")) {
      throw new Error(`${tool} made ${script.length} bytes of import "dynaskin/worker/thread".`);
    }
  }
}

/** The production build of an application whose pages are rendered on a server. */
async function buildNext() {
  await run(process.execPath, [installed("next", "dist", "bin", "next"), "build"], {
    cwd: NEXT,
    env: QUIET_NEXT,
    quiet: true,
  });
}

/** Serves what `buildNext` made. */
async function startNext() {
  const server = spawn(
    process.execPath,
    [installed("next", "dist", "bin", "next"), "start", "-p", "0", "-H", "127.0.0.1"],
    { cwd: NEXT, env: { ...process.env, ...QUIET_NEXT }, stdio: ["ignore", "pipe", "inherit"] },
  );
  const url = await new Promise((found, failed) => {
    server.on("exit", (code) => failed(new Error(`next start ended with ${code}.`)));
    server.stdout.on("data", (text) => {
      const [address] = /http:\/\/127\.0\.0\.1:\d+/.exec(String(text)) ?? [];
      if (address) found(address);
    });
  });
  return { url, close: () => server.kill() };
}

/** The page as the server sends it, before any script has run. */
async function expectServerRendered(url) {
  const html = await (await fetch(url)).text();
  for (const sentence of [/dynaskin [\d.]+ knows \d+ motions/, /the adapter is a function/]) {
    if (!sentence.test(html)) throw new Error(`Next's server did not render ${sentence}.`);
  }
}

/** Vite's development server, of the version that is installed in `folder`. */
async function viteDev(folder, port, config) {
  const module = pathToFileURL(join(folder, "dist", "node", "index.js")).href;
  const { createServer } = await import(module);
  const server = await createServer({
    root: FOLDER,
    base: "/",
    configFile: join(FOLDER, config),
    server: { port, strictPort: true },
    logLevel: "error",
  });
  await server.listen();
  return { url: `http://localhost:${port}`, close: () => server.close() };
}

/** Opens a page and returns its title once the application has written it; keeps a picture. */
async function titleOf(browser, name, url) {
  const page = await browser.newPage();
  try {
    await page.goto(url);
    await page.waitForFunction(() => document.title !== "waiting", null, { timeout: 60_000 });
    await page.screenshot({ path: join(FOLDER, "pictures", `${name}.png`) });
    return await page.title();
  } finally {
    await page.close();
  }
}

async function open(browser, name, url) {
  const title = await titleOf(browser, name, url);
  const offsetMm = Number(/^offset ([\d.]+) mm$/.exec(title)?.[1]);
  if (!(offsetMm > 1)) throw new Error(`${name}: ${title}`);
  say(`  ${name}: ${title}`);
}

/** The same for a page that draws with dynaskin/renderer. */
async function openDrawing(browser, name, url) {
  const title = await titleOf(browser, name, url);
  if (!(Number(/^variation ([\d.]+)$/.exec(title)?.[1]) > 15)) throw new Error(`${name}: ${title}`);
  say(`  ${name}: ${title}`);
}

async function openAll() {
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  const { chromium } = await import("@playwright/test");
  const args = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"].concat(
    "--enable-unsafe-swiftshader",
  );
  const browser = await chromium.launch({ executablePath, args });
  const servers = [];
  const start = async (starting) => {
    const server = await starting;
    servers.push(server);
    return server.url;
  };
  try {
    const files = await start(serve({ root: FOLDER }));
    await open(browser, "import map", `${files}/importmap/index.html`);
    await openDrawing(browser, "import map, renderer", `${files}/importmap/renderer.html`);
    for (const [tool, folder] of [
      ["Vite 8 build", "dist-vite"],
      ["Vite 7 build", "dist-vite7"],
    ]) {
      await open(browser, tool, `${files}/${folder}/index.html`);
      await open(browser, `${tool}, worker`, `${files}/${folder}/worker.html`);
      await open(browser, `${tool}, README`, `${files}/${folder}/readme.html`);
      await openDrawing(browser, `${tool}, renderer`, `${files}/${folder}/renderer.html`);
    }
    await open(browser, "webpack", `${files}/webpack.html`);
    await open(browser, "webpack, worker", `${files}/webpack-worker.html`);
    await open(browser, "esbuild with dynaskin/inline", `${files}/esbuild.html`);
    await open(browser, "esbuild, worker of its own", `${files}/esbuild-worker.html`);
    for (const [tool, name, config] of [
      ["Vite 8 dev", "vite", "vite.config.js"],
      ["Vite 7 dev", "vite7", "vite7.config.js"],
    ]) {
      const dev = await start(viteDev(installed(name), await freePorts(1), config));
      await open(browser, tool, `${dev}/index.html`);
      await open(browser, `${tool}, worker`, `${dev}/worker.html`);
      await openDrawing(browser, `${tool}, renderer`, `${dev}/renderer.html`);
    }
    const next = await start(startNext());
    await expectServerRendered(next);
    await open(browser, "Next", next);
    await open(browser, "Next, worker", `${next}/worker`);
  } finally {
    for (const server of servers) await server.close();
    await browser.close();
  }
}

const STEPS = [
  ["sdk", "SDK", buildSdk],
  ["install", "Packed and installed", install],
  ["lint", "publint, are the types wrong, size-limit", lint],
  ["types", "Strict TypeScript applications", types],
  ["build", "Bundled", build],
  ["next", "Built with Next", buildNext],
  ["open", "Opened in Chromium", openAll],
];

main(async () => {
  const chosen = process.argv.slice(2);
  for (const [name, title, work] of STEPS) {
    if (chosen.length === 0 || chosen.includes(name)) await step(title, work);
  }
});
