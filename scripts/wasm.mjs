// Builds the two wasm files and their JavaScript glue into web/sdk/src/wasm, and the demo's core, which
// has the code of the compared methods, into web/demo/wasm.
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, readFileSync, renameSync, rmSync, writeFileSync } from "node:fs";
import { join, relative } from "node:path";
import { brotliCompressSync, constants } from "node:zlib";
import { cargoTargetDir, DEMO, ROOT, SDK } from "./lib/paths.mjs";
import { run, say } from "./lib/run.mjs";
import { ensureWasmBindgen } from "./toolchain.mjs";

export const WASM_OUT = join(SDK, "src", "wasm");

/** Where the demo's core lies; the demo's vite.config.ts puts it in the place of the package's. */
const DEMO_OUT = join(DEMO, "wasm");

/** `release` builds in a fraction of the time, for work on this machine only. */
const PROFILE = process.env.DYNASKIN_WASM_PROFILE || "release-wasm";

/** Whether the wasm files are those that are published: optimised for size and speed. */
export const isFullProfile = PROFILE === "release-wasm";

/** Two files, so that pages with an engine of their own never download wgpu. */
export const WASM_FILES = [
  { name: "core", package: "dynaskin-wasm", library: "dynaskin_wasm", optimise: "-O3" },
  {
    name: "renderer",
    package: "dynaskin-wasm-render",
    library: "dynaskin_wasm_render",
    optimise: "-Os",
  },
];

// What Rust's wasm32 target and +simd128 use. wasm-opt would otherwise guess from a section that
// wasm-bindgen rewrites.
const FEATURES = [
  "--enable-simd",
  "--enable-bulk-memory",
  "--enable-bulk-memory-opt",
  "--enable-call-indirect-overlong",
  "--enable-multivalue",
  "--enable-mutable-globals",
  "--enable-nontrapping-float-to-int",
  "--enable-reference-types",
  "--enable-sign-ext",
];

/** The core with the code of the compared methods. It shares the package's glue. */
const GUESTS = {
  // A wasm file names the glue that it imports.
  name: "core",
  package: "dynaskin-wasm",
  library: "dynaskin_wasm",
  optimise: "-O3",
  features: ["--features", "guests"],
  out: DEMO_OUT,
};

/** Builds what changed; the glue and the optimised file are kept when cargo's output is the same. */
export async function buildWasm() {
  const wasmBindgen = await ensureWasmBindgen();
  for (const file of [...WASM_FILES, GUESTS]) {
    await cargoBuild(file);
    await bindAndOptimise(file, wasmBindgen);
  }
  checkSharedGlue();
}

/** A core runs only under the glue that was generated with it. */
function checkSharedGlue() {
  const own = readFileSync(join(WASM_OUT, "core.js"), "utf8");
  if (own !== readFileSync(join(DEMO_OUT, "core.js"), "utf8")) {
    throw new Error("The core with the compared methods needs another glue than the package's.");
  }
}

async function cargoBuild(file) {
  say(
    `  compiling ${file.package} (${PROFILE}${file.features ? ", with the compared methods" : ""})`,
  );
  const args = ["build", "-p", file.package, "--lib", "--target", "wasm32-unknown-unknown"];
  await run("cargo", [...args, ...(file.features ?? []), "--profile", PROFILE], {
    env: { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: "-C target-feature=+simd128" },
  });
}

async function bindAndOptimise(file, wasmBindgen) {
  const compiled = join(
    cargoTargetDir(),
    "wasm32-unknown-unknown",
    PROFILE,
    `${file.library}.wasm`,
  );
  const folder = file.out ?? WASM_OUT;
  const out = join(folder, `${file.name}_bg.wasm`);
  const stamp = join(folder, `.${file.name}-stamp`);
  const key = createHash("sha256")
    .update(readFileSync(compiled))
    .update([PROFILE, file.optimise, ...FEATURES].join(" "))
    .digest("hex");
  const fresh = existsSync(stamp) && existsSync(out) && readFileSync(stamp, "utf8") === key;
  if (!fresh) {
    mkdirSync(folder, { recursive: true });
    rmSync(stamp, { force: true });
    await run(wasmBindgen, [
      ...[compiled, "--target", "web", "--omit-default-module-path"],
      ...["--out-dir", folder, "--out-name", file.name],
    ]);
    if (isFullProfile) await optimise(file, out);
    writeFileSync(stamp, key);
  }
  say(`  ${relative(ROOT, out)}: ${describeSize(readFileSync(out))}`);
}

async function optimise(file, wasm) {
  say(`  wasm-opt ${file.optimise} on ${file.name}_bg.wasm (a minute or two)`);
  const program = join(ROOT, "node_modules", "binaryen", "bin", "wasm-opt");
  const smaller = `${wasm}.opt`;
  await run(process.execPath, [program, wasm, "-o", smaller, file.optimise, ...FEATURES]);
  renameSync(smaller, wasm);
}

/** Raw and brotli size in bytes. */
export function wasmSizes(bytes) {
  const params = { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_LGWIN]: 24 };
  return { raw: bytes.length, brotli: brotliCompressSync(bytes, { params }).length };
}

function describeSize(bytes) {
  return `${(bytes.length / 1e6).toFixed(2)} MB`;
}
