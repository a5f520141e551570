// npm run bench:methods [female]: what predictor and decoder of each compared method cost for one
// avatar-frame in WebAssembly in Node, as the JSON that `dynaskin evaluate --wasm-times` reads.
import { existsSync, mkdirSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { measureFiles } from "./bench/measure.mjs";
import { buildAll } from "./build.mjs";
import { MODELS, ROOT, SDK } from "./lib/paths.mjs";
import { main, say, step } from "./lib/run.mjs";

/** Folders of the bundles of a model by method, the model itself last. */
function bundles(model) {
  const own = join(MODELS, model);
  const methods = join(own, "methods");
  const names = existsSync(methods) ? readdirSync(methods).toSorted() : [];
  const compared = names.map((name) => [name, join(methods, name)]);
  return [...compared, ["dynaskin", own]].filter(([, folder]) =>
    existsSync(join(folder, "bundle.json")),
  );
}

async function networksMs(model, folder) {
  const file = (where, name) => pathToFileURL(join(where, name)).href;
  const stages = await measureFiles({
    sdk: pathToFileURL(join(SDK, "dist", "index.js")).href,
    files: {
      bundle: file(folder, "bundle.json"),
      body: file(join(MODELS, model), "body.glb"),
      predictor: file(folder, "predictor.onnx"),
      decoder: file(folder, "decoder.onnx"),
    },
  });
  return stages.predictMs + stages.decodeMs;
}

main(async () => {
  const model = process.argv[2] ?? "female";
  if (!existsSync(join(MODELS, model))) throw new Error(`There is no models/${model}.`);
  await buildAll();
  const times = await step(`Predictor and decoder of each method, ${model}`, async () => {
    const rows = {};
    for (const [name, folder] of bundles(model)) rows[name] = await networksMs(model, folder);
    return rows;
  });
  for (const [name, ms] of Object.entries(times)) {
    say(`${name.padEnd(28)}${ms.toFixed(3).padStart(10)} ms`);
  }
  const folder = join(ROOT, "artifacts");
  mkdirSync(folder, { recursive: true });
  const path = join(folder, `methods-${model}.json`);
  writeFileSync(path, `${JSON.stringify(times, null, 2)}\n`);
  say(`written to ${path}`);
});
