// npm run bench: what one avatar-frame costs in WebAssembly, in Node and in Chromium, beside the
// same two networks in onnxruntime-web in the same run; what many avatars cost together; and how large
// the wasm files are.
import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { measureCrowd } from "./bench/crowd.mjs";
import { measure } from "./bench/measure.mjs";
import { buildAll } from "./build.mjs";
import { MODELS, ROOT, SDK } from "./lib/paths.mjs";
import { bold, main, say, step } from "./lib/run.mjs";
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

async function inNode(model) {
  return measure({
    sdk: pathToFileURL(join(SDK, "dist", "index.js")).href,
    ort: pathToFileURL(join(ROOT, ORT_MODULE)).href,
    ortFolder: pathToFileURL(join(ROOT, ORT_FOLDER)).href,
    model: pathToFileURL(join(MODELS, model, "/")).href,
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

main(async () => {
  if (!existsSync(MODELS)) throw new Error("There are no models in models/ to measure.");
  await buildAll();
  const chromium = findChromium();
  if (!chromium) say("Chromium is not installed, so only Node is measured.");
  for (const model of readdirSync(MODELS, { withFileTypes: true })) {
    if (!model.isDirectory()) continue;
    const columns = await step(`One avatar-frame, ${model.name}`, async () => {
      const results = [["Node", await inNode(model.name)]];
      if (chromium) results.push(["Chromium", await inChromium(model.name, chromium)]);
      return results;
    });
    printTable(columns);
    printCrowds(
      await step(`Many avatars, ${model.name}: ms, medians of 100 ticks in Node`, () =>
        crowds(model.name),
      ),
    );
  }
  say(`\n${bold("Wasm files")}`);
  printSizes();
});
