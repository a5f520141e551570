// npm run soak -- STEPS [STEPS_IN_CHROMIUM] [SEED]: random calls of the SDK for that many steps of avatars,
// in Node and in Chromium, on the shipped female model. Everything must stay finite, memory flat after the
// first 100,000 steps and steps as fast as at the beginning, and both must show the same bits.
// 0 steps leave an engine out; the lines and artifacts/soak-*.json have the hashes of each.
// 24 hours of a page at 60 Hz are 5,184,000 steps. `npm test -- wasm tsc` builds what it runs on.
import { spawnSync } from "node:child_process";
import { existsSync, mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { MODELS, ROOT, SDK } from "./lib/paths.mjs";
import { bold, duration, main, red, say } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { beginWalk } from "./soak/walk.mjs";
import { findChromium } from "./toolchain.mjs";

/** Steps after which memory must be flat. */
const SETTLED_STEPS = 100_000;

/** Steps between two looks, and between two lines. */
const PART_STEPS = 20_000;
const LINE_STEPS = 200_000;

/** Memory may grow by so much after {@link SETTLED_STEPS}. */
const MOST_GROWTH_BYTES = 1e6;

/** Ended by hand: what was walked until then is judged. */
let isInterrupted = false;
for (const signal of ["SIGINT", "SIGTERM"]) {
  process.on(signal, () => {
    isInterrupted = true;
  });
}

/**
 * Walks in one engine, part by part.
 *
 * @param {{ advance: (count: number) => Promise<object>, probeMs: () => Promise<number>,
 *   heapBytes: () => Promise<number>, look: () => Promise<object> }} engine
 */
async function walk(name, steps, engine) {
  const startMs = performance.now();
  const early = {};
  for (let done = 0; done < steps && !isInterrupted; ) {
    const next = early.heapBytes === undefined ? Math.min(steps, SETTLED_STEPS) : steps;
    done = (await engine.advance(Math.min(PART_STEPS, next - done))).steps;
    if (early.heapBytes === undefined && done >= Math.min(steps, SETTLED_STEPS)) {
      early.heapBytes = await engine.heapBytes();
      early.probeMs = await engine.probeMs();
      early.wasmBytes = (await engine.look()).wasmBytes;
    }
    // Signals arrive between two parts.
    await new Promise(setImmediate);
    if (done % LINE_STEPS < PART_STEPS) {
      const { hash, wasmBytes, problems } = await engine.look();
      const seconds = (performance.now() - startMs) / 1000;
      say(
        `  ${name}: ${done.toLocaleString("en")} steps in ${seconds.toFixed(0)} s, ${hash}, ` +
          `${(wasmBytes / 1e6).toFixed(1)} MB of wasm, ${problems.length} faults`,
      );
    }
  }
  const late = { heapBytes: await engine.heapBytes(), probeMs: await engine.probeMs() };
  const found = await engine.look();
  return { name, early, late, ...found, seconds: (performance.now() - startMs) / 1000 };
}

/** What a page and Node give of a walk. */
const lookAt = (it) => ({
  steps: it.steps,
  calls: it.calls,
  refusals: it.refusals,
  problems: it.problems,
  marks: it.marks,
  wasmBytes: it.wasmBytes,
  hash: it.advance(0).hash,
});

async function inNode(steps, seed) {
  const it = await beginWalk({
    sdk: pathToFileURL(join(SDK, "dist", "index.js")).href,
    model: pathToFileURL(join(MODELS, "female", "/")).href,
    seed,
  });
  return walk("Node", steps, {
    advance: async (count) => it.advance(count),
    probeMs: async () => it.probeMs(),
    heapBytes: async () => {
      globalThis.gc();
      // Buffers are freed beside the program, after the collection.
      await new Promise((done) => setTimeout(done, 1000));
      globalThis.gc();
      const { heapUsed, arrayBuffers } = process.memoryUsage();
      return heapUsed + arrayBuffers;
    },
    look: async () => lookAt(it),
  });
}

async function inChromium(executablePath, steps, seed) {
  const { chromium } = await import("@playwright/test");
  const server = await serve();
  const flags = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"];
  const memory = ["--enable-precise-memory-info", "--js-flags=--expose-gc"];
  const browser = await chromium.launch({ executablePath, args: [...flags, ...memory] });
  try {
    const page = await browser.newPage();
    page.setDefaultTimeout(0);
    await page.goto(`${server.url}/blank`);
    const places = {
      sdk: `${server.url}/web/sdk/dist/index.js`,
      model: `${server.url}/models/female/`,
      seed,
    };
    await page.evaluate(
      async ([module, where]) => {
        globalThis.walk = await (await import(module)).beginWalk(where);
      },
      [`${server.url}/scripts/soak/walk.mjs`, places],
    );
    return await walk("Chromium", steps, {
      advance: (count) => page.evaluate((steps) => globalThis.walk.advance(steps), count),
      probeMs: () => page.evaluate(() => globalThis.walk.probeMs()),
      heapBytes: () =>
        page.evaluate(() => {
          globalThis.gc();
          return performance.memory.usedJSHeapSize;
        }),
      look: () =>
        page.evaluate(
          (source) => new Function(`return (${source})`)()(globalThis.walk),
          `${lookAt}`,
        ),
    });
  } finally {
    await browser.close();
    server.close();
  }
}

const megabytes = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;

/** Says what a walk showed; gives what is wrong with it. */
function judge({ name, steps, calls, refusals, seconds, problems, marks, early, late, ...rest }) {
  const wrong = problems.map((problem) => `${name}: ${problem}`);
  const wasmGrowth = rest.wasmBytes - early.wasmBytes;
  const heapGrowth = late.heapBytes - early.heapBytes;
  say(`\n${bold(name)}: ${steps.toLocaleString("en")} steps in ${duration(1000 * seconds)}`);
  say(`  ${calls.toLocaleString("en")} calls, ${refusals.toLocaleString("en")} odd ones refused`);
  say(`  hash of what was shown: ${rest.hash}`);
  say(`  numbers that are not finite, or other faults: ${problems.length}`);
  say(`  wasm memory: ${megabytes(rest.wasmBytes)}, grown by ${megabytes(wasmGrowth)}`);
  say(`  JavaScript's memory: ${megabytes(late.heapBytes)}, grown by ${megabytes(heapGrowth)}`);
  say(
    `  a plain step: ${early.probeMs.toFixed(3)} ms at first, ${late.probeMs.toFixed(3)} ms at last`,
  );
  const [first, last] = [marks[0], marks.at(-1)].map((mark) => mark?.msPerStep ?? Number.NaN);
  say(`  a step of the walk: ${first.toFixed(3)} ms at first, ${last.toFixed(3)} ms at last`);
  for (const [what, growth] of [
    ["wasm memory", wasmGrowth],
    ["JavaScript's memory", heapGrowth],
  ]) {
    if (growth > MOST_GROWTH_BYTES) wrong.push(`${name}: ${what} grew by ${megabytes(growth)}`);
  }
  return wrong;
}

/** Whether two walks showed the same at every mark that both reached. */
function compare(one, other) {
  const marks = Math.min(one.marks.length, other.marks.length);
  for (let idx = 0; idx < marks; idx += 1) {
    const [a, b] = [one.marks[idx], other.marks[idx]];
    if (a.steps !== b.steps || a.hash !== b.hash) {
      return [`${one.name} and ${other.name} differ before step ${a.steps}`];
    }
  }
  if (marks === 0) return [`${one.name} and ${other.name}: too few steps to compare`];
  say(`\n${one.name} and ${other.name} show the same bits at ${marks} marks.`);
  return [];
}

main(async () => {
  // For a look at what is left after the garbage is collected.
  if (!globalThis.gc) {
    const args = ["--expose-gc", import.meta.filename, ...process.argv.slice(2)];
    process.exitCode = spawnSync(process.execPath, args, { stdio: "inherit" }).status ?? 1;
    return;
  }
  const [steps, inBrowser = Math.min(steps, 500_000), seed = 1] = process.argv.slice(2).map(Number);
  if (!(steps > 0 || inBrowser > 0)) {
    throw new Error("Give a number of steps, such as `npm run soak -- 100000`.");
  }
  if (!existsSync(join(SDK, "dist", "index.js"))) {
    throw new Error("There is no SDK to walk on: run `npm test -- wasm tsc` first.");
  }
  const results = steps > 0 ? [await inNode(steps, seed)] : [];
  const chromium = findChromium();
  if (chromium && inBrowser > 0) results.push(await inChromium(chromium, inBrowser, seed));
  else say("  skipped: Chromium");
  const wrong = results.flatMap(judge);
  if (results.length > 1) wrong.push(...compare(results[0], results[1]));
  mkdirSync(join(ROOT, "artifacts"), { recursive: true });
  for (const result of results) {
    const file = `soak-${result.name.toLowerCase()}.json`;
    writeFileSync(join(ROOT, "artifacts", file), JSON.stringify(result, null, 1));
  }
  for (const problem of wrong) say(red(problem));
  if (wrong.length > 0) process.exitCode = 1;
});
