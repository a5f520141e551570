// npm test: every check of the project, in order, with one closing line over all of them.
// `npm test -- rust sdk` runs only the named steps.
import { mkdirSync, rmSync } from "node:fs";
import { join } from "node:path";
import { buildDemo, buildExamples } from "./build.mjs";
import { checkDocs } from "./docs.mjs";
import { ROOT, SDK } from "./lib/paths.mjs";
import { freePorts } from "./lib/ports.mjs";
import { bold, duration, main, red, run, say, step, which } from "./lib/run.mjs";
import { checkNotices } from "./lib/shipped-crates.mjs";
import { CargoTally, playwrightResults, Tally, vitestResults } from "./lib/tally.mjs";
import { buildSdk, tscProgram } from "./sdk.mjs";
import { checkSnippets } from "./snippets.mjs";
import {
  checkMinimumRust,
  ensureCargoTool,
  ensureNodePackages,
  ensurePython,
  ensureRust,
  ensureSystemPackages,
  findChromium,
  findFirefox,
} from "./toolchain.mjs";
import { buildWasm, PUBLISHED, QUICK } from "./wasm.mjs";
import { checkWasmSizes } from "./wasm-sizes.mjs";
import { weighDemo } from "./weigh.mjs";

const REPORTS = join(ROOT, "test-results");
const node = (program, ...args) => run(process.execPath, [program, ...args]);
const COLOURS = process.stdout.isTTY ? [] : ["--colors=off"];
const bin = (name, ...path) => join(ROOT, "node_modules", name, ...path);

/** Chosen where most of the tests are to run on another build. */
const PROFILE = process.env.DYNASKIN_WASM_PROFILE || QUICK;

/** Profiles of the WebAssembly in the SDK, which the steps `wasm` and `tsc` make, and in the demo. */
const built = { sdk: PROFILE, demo: null };

/** Puts WebAssembly of a profile into the SDK and the demo, where it is not there yet. */
async function buildOn(profile) {
  if (built.sdk !== profile) {
    await buildWasm(profile);
    await buildSdk();
  }
  if (built.demo !== profile) await buildDemo();
  Object.assign(built, { sdk: profile, demo: profile });
}

/** A step without tests of its own counts as one: it passed or it failed. */
const oneCheck = (work) => async () => {
  await work();
  return { passed: 1 };
};

async function setUp() {
  await ensureRust();
  await ensureNodePackages();
  await ensureSystemPackages();
  return {};
}

async function cargoTest() {
  const tally = new CargoTally();
  // Some tests compare with onnxruntime; without it they are skipped by name.
  const found = await ensurePython();
  if ("reason" in found) say(`  no Python for the comparison with onnxruntime: ${found.reason}`);
  const nextest = await ensureCargoTool("cargo-nextest");
  const test = ["test", "--workspace", "--no-fail-fast"];
  if ("reason" in nextest) {
    say(`  with cargo test, one test at a time: no cargo-nextest, ${nextest.reason}`);
    await countTests("cargo", [...test, "--", "--show-output"], found, tally);
    return tally;
  }
  say(
    "  with cargo-nextest, each test a process of its own; then the examples of the documentation",
  );
  await countTests(nextest.program, ["nextest", "run", "--workspace"], found, tally);
  // nextest runs no documentation tests.
  await countTests("cargo", [...test, "--doc", "--", "--show-output"], found, tally);
  return tally;
}

/** Adds what a test runner for Rust says to a tally. */
async function countTests(program, args, python, tally) {
  const failedBefore = tally.failed;
  const { status } = await run(program, args, {
    env: "python" in python ? { DYNASKIN_PYTHON: python.python } : {},
    onLine: (line) => tally.read(line),
    // nextest reports here.
    onErrorLine: (line) => tally.read(line),
    allowFailure: true,
  });
  // A crate that does not compile fails no test.
  if (status !== 0 && tally.failed === failedBefore) tally.add({ failed: 1 });
}

/** Licences, duplicates and sources; advisories and yanked versions where their list can be fetched. */
async function cargoDeny() {
  const tool = await ensureCargoTool("cargo-deny");
  if ("reason" in tool) {
    say(`  skipped: ${tool.reason}`);
    return { skipped: 1, skippedNames: [`cargo deny: ${tool.reason}`] };
  }
  await run(tool.program, ["check", "licenses", "bans", "sources"]);
  const { status } = await run(tool.program, ["fetch", "db"], { quiet: true, allowFailure: true });
  if (status !== 0) {
    const name = "cargo deny check advisories: the advisory database cannot be fetched";
    say(`  skipped: ${name}`);
    return { passed: 1, skipped: 1, skippedNames: [name] };
  }
  await run(tool.program, ["check", "advisories"]);
  return { passed: 2 };
}

/** Known holes in npm packages that ship or build what ships, where their list can be had. */
async function npmAudit() {
  const audit = ["audit", "--json", "--audit-level=high"];
  const { output } = await run("npm", audit, { quiet: true, allowFailure: true });
  let report = null;
  try {
    report = JSON.parse(output);
  } catch {
    // No report at all: said below.
  }
  const counts = report?.metadata?.vulnerabilities;
  if (!counts) {
    const name = "npm audit: the list of known holes cannot be fetched";
    say(`  skipped: ${name}`);
    return { skipped: 1, skippedNames: [name] };
  }
  say(`  ${counts.total} of all kinds, ${counts.high + counts.critical} high or critical`);
  if (counts.high + counts.critical === 0) return { passed: 1 };
  throw new Error(`npm audit: ${Object.keys(report.vulnerabilities).join(", ")}`);
}

async function vitest() {
  const report = join(REPORTS, "vitest.json");
  await run(
    process.execPath,
    [bin("vitest", "vitest.mjs"), "run", "--reporter=default", "--reporter=json"].concat(
      `--outputFile.json=${report}`,
    ),
    { cwd: SDK, allowFailure: true },
  );
  return vitestResults(report);
}

/**
 * The browser tests: all but some on WebAssembly that is built in no time, and those some, which go
 * through all of the page, on what is published.
 */
async function browserTests() {
  await buildOn(PROFILE);
  await buildExamples();
  return playwright("playwright.json", ["--grep-invert", "@published"]);
}

async function publishedTests() {
  await buildOn(PUBLISHED);
  await buildExamples();
  await weighDemo();
  checkWasmSizes();
  const results = await playwright("playwright-published.json", ["--grep", "@published"]);
  return { ...results, passed: (results.passed ?? 0) + 2 };
}

async function playwright(reportName, chosen) {
  const chromium = findChromium();
  if (!chromium) {
    say("  skipped: the browser tests need Chromium. Install it, or set CHROMIUM to its path.");
    return { skipped: 1, skippedNames: ["browser tests: no Chromium"] };
  }
  const report = join(REPORTS, reportName);
  const args = [
    bin("@playwright", "test", "cli.js"),
    ...["test", "--config", join(ROOT, "tests", "browser", "playwright.config.ts")],
    ...chosen,
  ];
  const env = {
    CHROMIUM: chromium,
    PLAYWRIGHT_JSON_OUTPUT_FILE: report,
    DYNASKIN_TEST_PORT: `${await freePorts(3)}`,
  };
  // A WebGPU canvas presents only in a window, so the browser runs under a virtual display.
  const xvfb = which("xvfb-run");
  const [program, ...rest] = xvfb
    ? [xvfb, "-a", "-s", "-screen 0 1600x1200x24", process.execPath, ...args]
    : [process.execPath, ...args];
  await run(program, rest, { env, allowFailure: true });
  return playwrightResults(report);
}

async function firefoxTests() {
  const firefox = findFirefox();
  const xvfb = which("xvfb-run");
  if (!firefox || !xvfb) {
    say("  skipped: needs Debian's firefox-esr (or FIREFOX, the path of one) and xvfb-run.");
    return { skipped: 1, skippedNames: ["Firefox: not installed, or no virtual display"] };
  }
  await buildOn(PUBLISHED);
  const report = join(REPORTS, "firefox.json");
  // Firefox without a window has no WebGL2 in software.
  await run(
    xvfb,
    ["-a", "-s", "-screen 0 1600x1200x24", process.execPath].concat(bin("vitest", "vitest.mjs"), [
      "run",
      "--reporter=default",
      "--reporter=json",
      `--outputFile.json=${report}`,
    ]),
    {
      cwd: join(ROOT, "tests", "firefox"),
      env: { FIREFOX: firefox, DYNASKIN_TEST_PORT: `${await freePorts(1)}` },
      allowFailure: true,
    },
  );
  return vitestResults(report);
}

const STEPS = [
  { name: "setup", title: "What the tests need", work: setUp, always: true },
  { name: "msrv", title: "One oldest Rust", work: oneCheck(async () => checkMinimumRust()) },
  {
    name: "fmt",
    title: "cargo fmt",
    work: oneCheck(async () => {
      await run("cargo", ["fmt", "--check"]);
      // A workspace of its own.
      const fuzz = ["--manifest-path", join(ROOT, "fuzz", "Cargo.toml")];
      await run("cargo", ["fmt", ...fuzz, "--", "--check"]);
    }),
  },
  {
    name: "clippy",
    title: "cargo clippy",
    work: oneCheck(async () => {
      await run("cargo", ["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]);
      // The renderer's bindings exist only in WebAssembly.
      const wasm = ["-p", "dynaskin-wasm-render", "--target", "wasm32-unknown-unknown"];
      await run("cargo", ["clippy", ...wasm, "--", "-D", "warnings"]);
      // The core without tract.
      const slim = ["-p", "dynaskin-wasm", "--no-default-features", "--lib"];
      await run("cargo", ["clippy", ...slim, "--", "-D", "warnings"]);
    }),
  },
  { name: "deny", title: "cargo deny", work: cargoDeny },
  { name: "audit", title: "npm audit", work: npmAudit },
  {
    name: "notices",
    title: "Notices and bill of materials of what ships",
    work: oneCheck(checkNotices),
  },
  { name: "rust", title: "Rust tests", work: cargoTest },
  {
    name: "biome",
    title: "biome: format and lint",
    work: oneCheck(() => node(bin("@biomejs", "biome", "bin", "biome"), "ci", ...COLOURS, ".")),
  },
  { name: "docs", title: "Paths and links of the pages", work: oneCheck(checkDocs) },
  { name: "wasm", title: "WebAssembly", work: oneCheck(() => buildWasm(PROFILE)) },
  {
    name: "tsc",
    title: "TypeScript",
    needs: ["wasm"],
    work: oneCheck(async () => {
      await buildSdk();
      for (const project of ["web/sdk/tests", "web/demo", "web/examples", "tests/browser"]) {
        await node(tscProgram(), "--noEmit", "-p", join(ROOT, project));
      }
    }),
  },
  {
    name: "snippets",
    title: "Code of the pages",
    needs: ["wasm", "tsc"],
    work: oneCheck(checkSnippets),
  },
  { name: "sdk", title: "vitest on the built SDK", needs: ["wasm", "tsc"], work: vitest },
  { name: "browser", title: "Browser tests", needs: ["wasm", "tsc"], work: browserTests },
  {
    name: "published",
    title: "What is published: its size, and the page on it",
    needs: ["wasm", "tsc"],
    work: publishedTests,
  },
  { name: "firefox", title: "The demo in Firefox", needs: ["wasm", "tsc"], work: firefoxTests },
];

async function runSteps(chosen) {
  const total = new Tally();
  const failedSteps = [];
  for (const { name, title, needs = [], work, always } of STEPS) {
    if (!always && chosen.length > 0 && !chosen.includes(name)) continue;
    const blocker = needs.find((need) => failedSteps.includes(need));
    if (blocker) {
      say(red(`\n▸ ${title}: not run, because ${blocker} failed`));
      total.add({ failed: 1 });
      failedSteps.push(name);
      continue;
    }
    try {
      const results = await step(title, work);
      total.add(results);
      if (results.failed > 0) failedSteps.push(name);
    } catch (error) {
      say(red(`  ${error.message}`));
      total.add({ failed: 1 });
      failedSteps.push(name);
      if (name === "setup") break;
    }
  }
  return { total, failedSteps };
}

main(async () => {
  const chosen = process.argv.slice(2);
  const unknown = chosen.filter((name) => !STEPS.some((entry) => entry.name === name));
  if (unknown.length > 0) {
    throw new Error(
      `No step is called ${unknown.join(", ")}. There are: ${STEPS.map((s) => s.name).join(", ")}.`,
    );
  }
  rmSync(REPORTS, { recursive: true, force: true });
  mkdirSync(REPORTS, { recursive: true });
  const start = performance.now();
  const { total, failedSteps } = await runSteps(chosen);
  say(`\n${bold("Result")} after ${duration(performance.now() - start)}`);
  for (const name of total.skippedNames) say(`  skipped: ${name}`);
  for (const name of failedSteps) say(red(`  failed: ${name}`));
  say();
  say(total.line);
  if (total.failed > 0) process.exitCode = 1;
});
