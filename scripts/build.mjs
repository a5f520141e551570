// npm run build: the wasm files, the SDK and a static copy of the demo in web/demo/dist.
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join, relative, sep } from "node:path";
import { brotliCompressSync, constants } from "node:zlib";
import { DEMO, EXAMPLES, ROOT } from "./lib/paths.mjs";
import { main, run, say, step } from "./lib/run.mjs";
import { isLoadedFirst } from "./lib/sizes.mjs";
import { buildSdk } from "./sdk.mjs";
import { ensureNodePackages, ensureRust } from "./toolchain.mjs";
import { buildDemoWasm, buildWasm } from "./wasm.mjs";
import { weighDemo } from "./weigh.mjs";

/** Everything the package and the demo need, in order. */
export async function buildAll() {
  await build(buildWasm);
}

/** What the demo page alone needs: faster by a core of several megabytes, which it does not load. */
export async function buildForDemo() {
  await build(buildDemoWasm);
}

async function build(wasm) {
  await step("Rust", ensureRust);
  await step("npm packages", ensureNodePackages);
  await step("WebAssembly", () => wasm());
  await step("SDK", buildSdk);
}

/** Vite's static build of the demo. */
export async function buildDemo() {
  await run(process.execPath, [viteProgram(), "build", "--logLevel", "warn"], { cwd: DEMO });
}

/** Files that are worth packing: the page's own, and the models'. */
const PACKED = /\.(wasm|js|css|html|glb|onnx|json|lowered|safetensors|bin)$/;

/**
 * Puts a `.br` beside each file of the built demo that is worth it, for servers that send packed files
 * which they find beside the plain ones.
 */
export function packDemo() {
  const dist = join(DEMO, "dist");
  const names = readdirSync(dist, { recursive: true }).filter((name) => PACKED.test(name));
  let [plain, packed] = [0, 0];
  for (const name of names) {
    const bytes = readFileSync(join(dist, name));
    const isFirst = isLoadedFirst(name.replaceAll(sep, "/"));
    const params = {
      // The highest takes its time. What few load, and is large, can do with less.
      [constants.BROTLI_PARAM_QUALITY]: isFirst ? 11 : /methods/.test(name) ? 5 : 9,
      [constants.BROTLI_PARAM_LGWIN]: 24,
    };
    const smaller = brotliCompressSync(bytes, { params });
    if (smaller.length > 0.95 * bytes.length) continue;
    writeFileSync(join(dist, `${name}.br`), smaller);
    plain += bytes.length;
    packed += smaller.length;
  }
  const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
  say(`  ${megabytes(plain)} MB are ${megabytes(packed)} MB beside them, as .br`);
}

/** Vite's static build of the example pages. */
export async function buildExamples() {
  await run(process.execPath, [viteProgram(), "build", "--logLevel", "warn"], { cwd: EXAMPLES });
}

/** The path of Vite's command line. */
export function viteProgram() {
  return join(ROOT, "node_modules", "vite", "bin", "vite.js");
}

if (process.argv[1] === import.meta.filename) {
  main(async () => {
    await buildAll();
    await step("Demo page", buildDemo);
    await step("Size", () => weighDemo());
    await step("Packed files", packDemo);
    say(
      `\nThe page is in ${relative(process.cwd(), join(DEMO, "dist"))}: serve it with any web server, from any path.`,
    );
  });
}
