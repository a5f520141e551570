// npm run bench: what one avatar-frame costs in WebAssembly, in Node and in Chromium, beside the
// same two networks in onnxruntime-web in the same run; what many avatars cost together; and how large
// the wasm files are.
//
// npm run bench -- --baseline FOLDER: this build beside an earlier one, a checkout of the repository in
// which `npm run build` ran, in turns in one process. With --write, the table goes into
// docs/performance.md: there is one of builds with the same networks and one of builds with their own. With --as-built, this build is measured as it lies there.
import { existsSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { cpus } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { parseArgs } from "node:util";
import { avatarBytes, compare, compareLoading } from "./bench/baseline.mjs";
import { measureCrowd } from "./bench/crowd.mjs";
import { measure } from "./bench/measure.mjs";
import { buildAll } from "./build.mjs";
import { MODELS, ROOT, SDK } from "./lib/paths.mjs";
import { bold, main, run, say, step } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { findChromium } from "./toolchain.mjs";
import { WASM_FILES, wasmSizes } from "./wasm.mjs";

/** Stages of a frame as `measure` reports them, and their names in the table. */
const ROWS = [
  ["featuresMs", "features"],
  ["predictMs", "predict"],
  ["decodeMs", "decode"],
  ["applyMs", "apply and normals"],
  ["tissueMs", "tissue, together (aim ≤ 0.4)"],
  ["skinMs", "skin on the CPU"],
  ["networksMs", "both networks, dynaskin"],
  ["onnxruntimeMs", "both networks, onnxruntime-web"],
];

const ORT_FOLDER = "/node_modules/onnxruntime-web/dist/";
const ORT_MODULE = `${ORT_FOLDER}ort.wasm.min.mjs`;

async function inNode(model, root = ROOT) {
  return measure({
    sdk: pathToFileURL(join(root, "web/sdk/dist/index.js")).href,
    ort: pathToFileURL(join(ROOT, ORT_MODULE)).href,
    ortFolder: pathToFileURL(join(ROOT, ORT_FOLDER)).href,
    model: pathToFileURL(join(root, "models", model, "/")).href,
  });
}

async function inChromium(model, chromium) {
  const { chromium: driver } = await import("@playwright/test");
  const server = await serve();
  const flags = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"];
  const quiet = ["--disable-background-networking", "--disable-component-update", "--disable-sync"];
  const browser = await driver.launch({ executablePath: chromium, args: [...flags, ...quiet] });
  try {
    const page = await browser.newPage();
    await page.goto(`${server.url}/blank`);
    const places = {
      sdk: `${server.url}/web/sdk/dist/index.js`,
      ort: server.url + ORT_MODULE,
      ortFolder: server.url + ORT_FOLDER,
      model: `${server.url}/models/${model}/`,
    };
    const module = `${server.url}/scripts/bench/measure.mjs`;
    return await page.evaluate(
      async ([from, where]) => (await import(from)).measure(where),
      [module, places],
    );
  } finally {
    await browser.close();
    server.close();
  }
}

function printTable(columns) {
  const cell = (value) => (value === undefined ? "–" : value.toFixed(3)).padStart(12);
  say(
    `${"ms, median of 600 frames".padEnd(34)}${columns.map(([name]) => name.padStart(12)).join("")}`,
  );
  for (const [key, label] of ROWS) {
    say(label.padEnd(34) + columns.map(([, result]) => cell(result[key])).join(""));
  }
  const ratio = ([, { onnxruntimeMs, networksMs }]) =>
    `${(onnxruntimeMs / networksMs).toFixed(2)}×`.padStart(12);
  say(`${"speed against onnxruntime-web".padEnd(34)}${columns.map(ratio).join("")}`);
}

async function crowds(model) {
  return measureCrowd({
    sdk: pathToFileURL(join(SDK, "dist", "index.js")).href,
    model: pathToFileURL(join(MODELS, model, "/")).href,
  });
}

function printCrowds(rows) {
  const heads = ["per tick", "per avatar", "one by one", "ratio", "half detail"];
  const stages = ["features", "predict", "decode", "apply", "matrices"];
  const line = (cells) => say(cells.map((cell) => cell.padStart(12)).join(""));
  line(["avatars", ...heads, ...stages]);
  for (const { count, togetherMs, aloneMs, halfMs, stages: stageMs } of rows) {
    const numbers = [togetherMs, togetherMs / count, aloneMs].map((ms) => ms.toFixed(3));
    const ratio = `${(aloneMs / togetherMs).toFixed(2)}×`;
    const parts = [halfMs, ...stageMs].map((ms) => ms.toFixed(3));
    line([`${count}`, ...numbers, ratio, ...parts]);
  }
  const fifty = rows.find(({ count }) => count === 50)?.togetherMs ?? Number.NaN;
  say(`50 avatars at 60 Hz: ${fifty.toFixed(1)} ms a tick of one thread (aim ≤ 10)`);
}

function printSizes() {
  say(`${"bytes".padEnd(34)}${"raw".padStart(12)}${"brotli".padStart(12)}`);
  for (const { name } of WASM_FILES) {
    const { raw, brotli } = wasmSizes(readFileSync(join(SDK, "dist", "wasm", `${name}_bg.wasm`)));
    say(`${`${name}_bg.wasm`.padEnd(34)}${`${raw}`.padStart(12)}${`${brotli}`.padStart(12)}`);
  }
}

/** A folder that a build can be loaded from, or a sentence that says what it lacks. */
function baselineFolder(folder) {
  const root = resolve(process.env.INIT_CWD ?? process.cwd(), folder);
  for (const needed of ["web/sdk/dist/index.js", "web/sdk/dist/wasm/core_bg.wasm", "models"]) {
    if (!existsSync(join(root, needed))) {
      throw new Error(
        `${root} has no ${needed}: --baseline needs a checkout of the repository after \`npm run build\`.`,
      );
    }
  }
  return root;
}

const ratioCell = ({ ratio, low, high }) =>
  `${ratio.toFixed(3)} | ${low.toFixed(3)} to ${high.toFixed(3)} |`;

/** Rows about loading, memory and onnxruntime-web, which are not rounds of frames. */
async function furtherRows(baseline, model) {
  const loading = compareLoading(baseline, ROOT, model);
  const bytes = [await avatarBytes(baseline, model), await avatarBytes(ROOT, model)];
  const chromium = findChromium();
  const speed = async (result) => {
    const { onnxruntimeMs, networksMs } = await result;
    return `${(onnxruntimeMs / networksMs).toFixed(2)} times`;
  };
  const node = [await speed(inNode(model, baseline)), await speed(inNode(model))];
  return [
    `| ${loading.name}, ms | ${loading.beforeMs.toFixed(0)} | ${loading.afterMs.toFixed(0)} | ${ratioCell(loading)}`,
    // Memory grows in steps: the room of one more avatar may be there already.
    `| one more avatar, bytes of memory | ${bytes.join(" | ")} | ${bytes[0] > 0 ? (bytes[1] / bytes[0]).toFixed(3) : ""} | |`,
    `| both networks against onnxruntime-web, Node | ${node.join(" | ")} | | |`,
    ...(chromium
      ? [
          `| both networks against onnxruntime-web, Chromium | | ${await speed(inChromium(model, chromium))} | | |`,
        ]
      : []),
  ];
}

async function compareWith(baseline, isWritten) {
  const parts = [];
  let isSame = true;
  for (const model of modelNames()) {
    if (!existsSync(join(baseline, "models", model))) continue;
    const { rows, sameNetworks } = await step(`Beside the baseline, ${model}`, () =>
      compare(baseline, ROOT, model),
    );
    isSame &&= sameNetworks;
    parts.push([
      `${model}${sameNetworks ? ", the same networks" : ": the networks differ"}:`,
      "",
      "| ms, medians of 30 rounds in Node | before | after | after / before | quartiles |",
      "| --- | --- | --- | --- | --- |",
      ...rows.map(
        (row) =>
          `| ${row.name} | ${row.beforeMs.toFixed(4)} | ${row.afterMs.toFixed(4)} | ${ratioCell(row)}`,
      ),
      ...(await step(`Loading, memory and onnxruntime-web, ${model}`, () =>
        furtherRows(baseline, model),
      )),
      "",
    ]);
  }
  parts.push([
    "| wasm, bytes with brotli 11 | before | after | after / before |",
    "| --- | --- | --- | --- |",
    ...WASM_FILES.map(({ name }) => {
      const [before, after] = [baseline, ROOT].map((root) => {
        const file = join(root, `web/sdk/dist/wasm/${name}_bg.wasm`);
        return existsSync(file) ? wasmSizes(readFileSync(file)).brotli : undefined;
      });
      const ratio = before === undefined ? "" : (after / before).toFixed(3);
      return `| ${name} | ${before ?? ""} | ${after} | ${ratio} |`;
    }),
    "",
  ]);
  const table = parts.flat().join("\n");
  say(table);
  if (isWritten) writeTable(await describe(baseline), table, isSame ? "same" : "own");
}

const PERFORMANCE = join(ROOT, "docs", "performance.md");

/** Puts the table between the marks of docs/performance.md, of builds with the `same` or their `own` networks. */
function writeTable(heading, table, networks) {
  const [begin, last] = ["begin", "end"].map(
    (mark) => `<!-- bench, ${networks} networks: ${mark} -->`,
  );
  const page = readFileSync(PERFORMANCE, "utf8");
  const [start, end] = [page.indexOf(begin), page.indexOf(last)];
  if (start < 0 || end < start) throw new Error(`${PERFORMANCE} lacks ${begin} and ${last}.`);
  const before = page.slice(0, start + begin.length);
  writeFileSync(PERFORMANCE, `${before}\n${heading}\n\n${table}${page.slice(end)}`);
  say(`Written to docs/performance.md.`);
}

/** What was compared, and on which machine. */
async function describe(baseline) {
  const commit = async (cwd) => {
    const { output } = await run("git", ["rev-parse", "--short", "HEAD"], { cwd, quiet: true });
    return output.trim();
  };
  const processor = `${cpus()[0]?.model ?? "unknown processor"}, ${cpus().length} cores`;
  const [before, after] = [await commit(baseline), await commit(ROOT)];
  return `Before: ${before}. After: ${after}. Node ${process.versions.node}, ${processor}.`;
}

function modelNames() {
  return readdirSync(MODELS, { withFileTypes: true })
    .filter((entry) => entry.isDirectory())
    .map(({ name }) => name);
}

async function measureThis() {
  const chromium = findChromium();
  if (!chromium) say("Chromium is not installed, so only Node is measured.");
  for (const model of modelNames()) {
    const columns = await step(`One avatar-frame, ${model}`, async () => {
      const results = [["Node", await inNode(model)]];
      if (chromium) results.push(["Chromium", await inChromium(model, chromium)]);
      return results;
    });
    printTable(columns);
    printCrowds(
      await step(`Many avatars, ${model}: ms, medians of 100 ticks in Node`, () => crowds(model)),
    );
  }
  say(`\n${bold("Wasm files")}`);
  printSizes();
}

main(async () => {
  const { values } = parseArgs({
    options: {
      baseline: { type: "string" },
      write: { type: "boolean" },
      "as-built": { type: "boolean" },
    },
  });
  if (values.write && !values.baseline) throw new Error("--write needs --baseline FOLDER.");
  if (!existsSync(MODELS)) throw new Error("There are no models in models/ to measure.");
  const baseline = values.baseline === undefined ? undefined : baselineFolder(values.baseline);
  if (!values["as-built"]) await buildAll();
  if (baseline === undefined) await measureThis();
  else await compareWith(baseline, values.write ?? false);
});
