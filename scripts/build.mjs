// npm run build: the wasm files, the SDK and a static copy of the demo in web/demo/dist.
import { join, relative } from "node:path";
import { DEMO, EXAMPLES, ROOT } from "./lib/paths.mjs";
import { main, run, say, step } from "./lib/run.mjs";
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
    say(
      `\nThe page is in ${relative(process.cwd(), join(DEMO, "dist"))}: serve it with any web server, from any path.`,
    );
  });
}
