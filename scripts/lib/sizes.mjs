// What the demo's static build weighs, by part, held against a budget.
import { readdirSync, readFileSync, statSync } from "node:fs";
import { extname, join, relative, sep } from "node:path";
import { promisify } from "node:util";
import { brotliCompress, constants } from "node:zlib";

const compress = promisify(brotliCompress);

/**
 * The highest quality for what the page loads before a visitor touches it, as `npm run build` packs it; otherwise a
 * notch below, because it takes a minute for a core of 6 MB and saves a tenth.
 */
const brotli = (path) => ({
  params: {
    [constants.BROTLI_PARAM_QUALITY]: isLoadedFirst(path) ? 11 : 9,
    [constants.BROTLI_PARAM_LGWIN]: 24,
  },
});

/**
 * The parts, in the order of the table, and which files belong to each: the first part that knows a
 * file has it. `firstView` marks what the page loads before a visitor touches it.
 *
 * @type {{ name: string, has: (path: string) => boolean, firstView: boolean }[]}
 */
export const PARTS = [
  // The page for a visitor's own avatar, with three.js, the thread that binds, and the examples.
  {
    name: "own avatar",
    has: (path) => /(^|\/)(later-)?(own|workshop|thread|runner|lifter)[-.]/.test(path),
    firstView: false,
  },
  { name: "html", has: (path) => path.endsWith(".html"), firstView: true },
  { name: "later js", has: (path) => /(^|\/)later-.*\.js$/.test(path), firstView: false },
  { name: "js", has: (path) => path.endsWith(".js"), firstView: true },
  { name: "css", has: (path) => path.endsWith(".css"), firstView: true },
  { name: "poster", has: (path) => /poster-wide.*\.webp$/.test(path), firstView: true },
  // What a screen that is taller than wide has in its place.
  { name: "tall poster", has: (path) => /poster-tall.*\.webp$/.test(path), firstView: false },
  { name: "loop", has: (path) => /loop-wide.*\.bin$/.test(path), firstView: true },
  { name: "tall loop", has: (path) => /loop-tall.*\.bin$/.test(path), firstView: false },
  { name: "icon", has: (path) => path.endsWith(".svg"), firstView: true },
  { name: "slim wasm", has: (path) => /(^|\/)slim_bg.*\.wasm$/.test(path), firstView: true },
  { name: "core wasm", has: (path) => /(^|\/)core_bg.*\.wasm$/.test(path), firstView: false },
  { name: "renderer wasm", has: (path) => /renderer_bg.*\.wasm$/.test(path), firstView: true },
  { name: "bind wasm", has: (path) => /bind_bg.*\.wasm$/.test(path), firstView: false },
  { name: "female model", has: isModelFile("female"), firstView: true },
  { name: "male model", has: isModelFile("male"), firstView: false },
  // What the whole core plays: the same networks as ONNX, and those of the compared methods.
  {
    name: "whole networks",
    has: (path) => /^(female|male)\/[^/]*\.onnx$/.test(path),
    firstView: false,
  },
  {
    name: "compared methods",
    has: (path) => /\/methods\/.*\.(onnx|json)$/.test(path),
    firstView: false,
  },
  { name: "clips", has: (path) => extname(path) === ".safetensors", firstView: false },
  // Model cards and tables, which the page does not load.
  { name: "other", has: () => true, firstView: false },
];

function isModelFile(name) {
  const files = ["bundle.json", "body.glb", "predictor.lowered", "decoder.lowered"];
  return (path) => files.some((file) => path === `${name}/${file}`);
}

/** The name of the part that a file of the build belongs to; the path has forward slashes. */
export function partOf(path) {
  return PARTS.find((part) => part.has(path)).name;
}

/** Whether the page loads a file of the build, a path with forward slashes, before a visitor touches it. */
export function isLoadedFirst(path) {
  return PARTS.find((part) => part.has(path)).firstView;
}

/**
 * Bytes of each part of a build, raw and with brotli, and of the first view.
 *
 * @param {string} folder
 * @returns {Promise<Record<string, { raw: number, brotli: number }>>} by part, `first view` last
 */
export async function measureBuild(folder) {
  const sizes = Object.fromEntries(PARTS.map(({ name }) => [name, { raw: 0, brotli: 0 }]));
  for (const file of filesIn(folder)) {
    const bytes = readFileSync(file);
    const path = relative(folder, file).split(sep).join("/");
    const size = sizes[partOf(path)];
    size.raw += bytes.length;
    size.brotli += (await compress(bytes, brotli(path))).length;
  }
  const first = PARTS.filter(({ firstView }) => firstView).map(({ name }) => sizes[name]);
  const sum = (key) => first.reduce((total, size) => total + size[key], 0);
  return { ...sizes, "first view": { raw: sum("raw"), brotli: sum("brotli") } };
}

function filesIn(folder) {
  return (
    readdirSync(folder, { recursive: true })
      .map((name) => join(folder, name))
      // What lies packed beside a file is the same file.
      .filter((path) => statSync(path).isFile() && extname(path) !== ".br")
  );
}

/**
 * The parts that weigh more than the budget allows, as sentences; a part without a budget, and a
 * budget without a part, are mistakes in the file.
 *
 * @param {Record<string, { raw: number, brotli: number }>} sizes
 * @param {Record<string, number>} budget kilobytes with brotli, by part
 */
export function overBudget(sizes, budget) {
  const odd = Object.keys(budget).filter((name) => !(name in sizes));
  const problems = odd.map((name) => `the budget names ${name}, which is no part of the build`);
  for (const [name, { brotli }] of Object.entries(sizes)) {
    const allowed = budget[name];
    if (typeof allowed !== "number") problems.push(`${name} has no budget`);
    else if (brotli > allowed * 1000) {
      problems.push(`${name} has ${kilobytes(brotli)} kB, the budget is ${allowed} kB`);
    }
  }
  return problems;
}

/** By how much a file may outgrow what is recorded of it. */
const GROWTH = 1.02;

/**
 * The wasm files that have outgrown their record, as sentences; a file without a record, and a record
 * without a file, are mistakes in the list.
 *
 * @param {Record<string, number>} sizes bytes by name
 * @param {Record<string, number>} recorded the same when they were recorded
 */
export function overRecorded(sizes, recorded) {
  const gone = Object.keys(recorded).filter((name) => !(name in sizes));
  const problems = gone.map((name) => `${name} is recorded, and there is no such file`);
  for (const [name, bytes] of Object.entries(sizes)) {
    const before = recorded[name];
    if (typeof before !== "number") problems.push(`${name} is not recorded`);
    else if (bytes > before * GROWTH) {
      const percent = (100 * (bytes / before - 1)).toFixed(1);
      problems.push(`${name} has ${bytes} bytes, ${percent} % more than the ${before} recorded`);
    }
  }
  return problems;
}

/** The sizes as lines of a table. */
export function sizeTable(sizes, budget) {
  const row = (name, ...numbers) =>
    name.padEnd(18) + numbers.map((text) => `${text}`.padStart(12)).join("");
  return [
    row("part", "raw kB", "brotli kB", "budget kB"),
    ...Object.entries(sizes).map(([name, { raw, brotli }]) =>
      row(name, kilobytes(raw), kilobytes(brotli), budget[name] ?? "none"),
    ),
  ];
}

const kilobytes = (bytes) => (bytes / 1000).toFixed(bytes < 10_000 ? 1 : 0);
