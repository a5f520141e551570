// npm run fuzz: tries mutated files on every reader, with libFuzzer and coverage counters.
//
//   npm run fuzz -- 30             30 minutes a target, all targets
//   npm run fuzz -- 0.2 bvh state  these targets
//   npm run fuzz -- save [TARGET]  keeps the smallest inputs that reach everything reached, for npm test
//
// What was found lies in fuzz/corpus; an input that is a fault in fuzz/artifacts. Edges and runs are printed
// in a table, and all runs so far are added up in artifacts/fuzz-runs.jsonl.
import {
  appendFileSync,
  existsSync,
  mkdirSync,
  readdirSync,
  readFileSync,
  renameSync,
  rmSync,
} from "node:fs";
import { join } from "node:path";
import { cargoTargetDir, ROOT } from "./lib/paths.mjs";
import { bold, main, red, run, say } from "./lib/run.mjs";

const FUZZ = join(ROOT, "fuzz");
const LOG = join(ROOT, "artifacts", "fuzz-runs.jsonl");

/** Counters of edges and comparisons, as cargo-fuzz asks for them; a stable compiler has them. */
const COVERAGE = [
  "-Cpasses=sancov-module",
  "-Cllvm-args=-sanitizer-coverage-level=4",
  "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
  "-Cllvm-args=-sanitizer-coverage-pc-table",
  "-Cllvm-args=-sanitizer-coverage-trace-compares",
  "--cfg=fuzzing",
].join(" ");

/** What one input may take: more is a fault. */
const LIMITS = ["-timeout=10", "-rss_limit_mb=1024"];

/** Longest input in bytes, some times the largest seed. */
const MAX_BYTES = 32_768;

/** Packed bytes of the inputs that npm test runs for one target. */
const SAVED_BYTES = 110_000;

const targetNames = () =>
  readdirSync(join(FUZZ, "fuzz_targets")).map((file) => file.replace(/\.rs$/, ""));

async function hostTriple() {
  const { output } = await run("rustc", ["-vV"], { quiet: true });
  return /^host: (.+)$/m.exec(output)[1];
}

/** Compiles the fuzzers; gives the folder that they lie in. */
async function build(targets) {
  const triple = await hostTriple();
  // With a target, the flags are not for build scripts.
  const args = ["build", "--release", "--manifest-path", join(FUZZ, "Cargo.toml")];
  const bins = targets.flatMap((name) => ["--bin", name]);
  await run("cargo", [...args, "--target", triple, ...bins], {
    env: { RUSTFLAGS: COVERAGE, CARGO_TARGET_DIR: cargoTargetDir() },
  });
  return join(cargoTargetDir(), triple, "release");
}

/** Has a fuzzer write its seeds, or save what it found. */
const corpus = (programs, name, ...words) =>
  run(join(programs, name), [], { env: { DYNASKIN_CORPUS: words.join("\t") } });

const corpusOf = (name) => join(FUZZ, "corpus", name);

/** Runs one fuzzer; gives its figures. */
async function fuzz(programs, name, seconds) {
  const faults = join(FUZZ, "artifacts", name);
  for (const folder of [corpusOf(name), faults]) mkdirSync(folder, { recursive: true });
  const result = { name, runs: 0, edges: 0, counters: 0, inputs: 0, fault: null };
  const onErrorLine = (line) => {
    const number = (pattern) => Number(pattern.exec(line)?.[1] ?? Number.NaN);
    const counters = number(/\((\d+) inline 8-bit counters\)/);
    if (counters) result.counters = counters;
    const edges = number(/ cov: (\d+) /);
    if (edges) Object.assign(result, { edges, inputs: number(/ corp: (\d+)\//) });
    const runs = number(/^stat::number_of_executed_units: +(\d+)/);
    if (runs) result.runs = runs;
    const fault = /Test unit written to (\S+)/.exec(line)?.[1];
    if (fault) result.fault = fault;
  };
  const args = [corpusOf(name), `-max_total_time=${Math.ceil(seconds)}`, `-max_len=${MAX_BYTES}`];
  const more = ["-print_final_stats=1", "-reload=0", `-artifact_prefix=${faults}/`, ...LIMITS];
  const { status } = await run(join(programs, name), [...args, ...more], {
    onErrorLine,
    quiet: true,
    allowFailure: true,
  });
  if (status !== 0 && !result.fault) result.fault = `ended with ${status}`;
  return result;
}

/** Everything that was ever run in this clone. */
function total() {
  if (!existsSync(LOG)) return 0;
  const lines = readFileSync(LOG, "utf8").trim().split("\n");
  return lines.reduce((sum, line) => sum + JSON.parse(line).runs, 0);
}

const HEADS = ["reader", "runs", "runs/s", "edges", "of", "inputs", "faults"];

function row(cells) {
  const [first, ...rest] = cells.map(String);
  say(first.padEnd(12) + rest.map((cell) => cell.padStart(12)).join(""));
}

async function fuzzAll(minutes, targets) {
  const programs = await build(targets);
  const faults = [];
  for (const name of targets) await corpus(programs, name, "write", corpusOf(name));
  row(HEADS);
  let runs = 0;
  for (const name of targets) {
    const seconds = minutes * 60;
    const result = await fuzz(programs, name, seconds);
    runs += result.runs;
    const rate = Math.round(result.runs / seconds);
    const { edges, counters, inputs, fault } = result;
    row([name, result.runs.toLocaleString("en"), rate, edges, counters, inputs, fault ? 1 : 0]);
    if (fault) faults.push(`${name}: ${fault}`);
    mkdirSync(join(ROOT, "artifacts"), { recursive: true });
    appendFileSync(LOG, `${JSON.stringify({ ...result, seconds })}\n`);
  }
  say(`\n${bold(`${runs.toLocaleString("en")} runs`)}, ${total().toLocaleString("en")} so far`);
  for (const fault of faults) say(red(`  fault: ${fault}`));
  if (faults.length > 0) process.exitCode = 1;
}

/** Keeps the smallest inputs that reach all that is reached, in fuzz/corpus and in the repository. */
async function save(targets) {
  const programs = await build(targets);
  for (const name of targets) {
    await corpus(programs, name, "write", corpusOf(name));
    const merged = `${corpusOf(name)}-merged`;
    rmSync(merged, { recursive: true, force: true });
    mkdirSync(merged, { recursive: true });
    const args = ["-merge=1", merged, corpusOf(name), `-max_len=${MAX_BYTES}`, ...LIMITS];
    await run(join(programs, name), args, { quiet: true });
    rmSync(corpusOf(name), { recursive: true, force: true });
    renameSync(merged, corpusOf(name));
    await corpus(programs, name, "save", corpusOf(name), SAVED_BYTES);
  }
}

main(async () => {
  const [what = "", ...names] = process.argv.slice(2);
  const unknown = names.filter((name) => !targetNames().includes(name));
  if (unknown.length > 0) {
    throw new Error(
      `No target is called ${unknown.join(", ")}. There are: ${targetNames().join(", ")}.`,
    );
  }
  const targets = names.length > 0 ? names : targetNames();
  if (what === "save") return save(targets);
  const minutes = Number(what);
  if (!(minutes > 0)) throw new Error("Give the minutes a target, such as `npm run fuzz -- 30`.");
  return fuzzAll(minutes, targets);
});
