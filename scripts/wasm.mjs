// Builds the two wasm files and their JavaScript glue into web/sdk/src/wasm, and the demo's core, which
// has the code of the compared methods, into web/demo/wasm.
import { createHash } from "node:crypto";
import {
  copyFileSync,
  existsSync,
  mkdirSync,
  readdirSync,
  readFileSync,
  renameSync,
  rmSync,
  writeFileSync,
} from "node:fs";
import { join, relative } from "node:path";
import { brotliCompressSync, constants } from "node:zlib";
import { machinePaths, remapFlags } from "./lib/machine-paths.mjs";
import { cargoTargetDir, DEMO, ROOT, SDK } from "./lib/paths.mjs";
import { run, say } from "./lib/run.mjs";
import { ensureWasmBindgen } from "./toolchain.mjs";

export const WASM_OUT = join(SDK, "src", "wasm");

/** Where the demo's core lies; the demo's vite.config.ts puts it in the place of the package's. */
const DEMO_OUT = join(DEMO, "wasm");

/** Cargo's profile of what is published: optimised for size and speed, in minutes. */
export const PUBLISHED = "release-wasm";

/** Builds in a fraction of the time: for tests, and for work on this machine. */
export const QUICK = "release";

/** Says which profile the files in {@link WASM_OUT} are of. */
const PROFILE_STAMP = join(WASM_OUT, ".profile-stamp");

/** Whether the wasm files in the SDK's sources are those that are published. */
export function isPublished() {
  return existsSync(PROFILE_STAMP) && readFileSync(PROFILE_STAMP, "utf8") === PUBLISHED;
}

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

/** A crashed file can be started again, with a memory of its own. */
const GLUE = ["--experimental-reset-state-function"];

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

/**
 * Builds what changed, and puts it where the SDK and the demo look for it. Each profile's glue and
 * optimised files are kept beside cargo's output, for as long as that is the same.
 */
export async function buildWasm(profile = process.env.DYNASKIN_WASM_PROFILE || PUBLISHED) {
  const wasmBindgen = await ensureWasmBindgen();
  for (const file of [...WASM_FILES, GUESTS]) {
    const folder = file.out ? "bound-for-demo" : "bound";
    const bound = join(cargoTargetDir(), "wasm32-unknown-unknown", profile, folder);
    await cargoBuild(file, profile);
    await bindAndOptimise(file, profile, bound, wasmBindgen);
    const out = file.out ?? WASM_OUT;
    mkdirSync(out, { recursive: true });
    for (const name of readdirSync(bound)) {
      if (new RegExp(`^${file.name}(_bg)?\\.`).test(name)) {
        copyFileSync(join(bound, name), join(out, name));
      }
    }
  }
  checkSharedGlue();
  writeFileSync(PROFILE_STAMP, profile);
}

/** A core runs only under the glue that was generated with it. */
function checkSharedGlue() {
  const own = readFileSync(join(WASM_OUT, "core.js"), "utf8");
  if (own !== readFileSync(join(DEMO_OUT, "core.js"), "utf8")) {
    throw new Error("The core with the compared methods needs another glue than the package's.");
  }
}

async function cargoBuild(file, profile) {
  const guests = file.features ? ", with the compared methods" : "";
  say(`  compiling ${file.package} (${profile}${guests})`);
  const flags = ["-C target-feature=+simd128", ...(await remapFlags())];
  const args = ["build", "-p", file.package, "--lib", "--target", "wasm32-unknown-unknown"];
  await run("cargo", [...args, ...(file.features ?? []), "--profile", profile], {
    env: { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: flags.join(" ") },
  });
}

async function bindAndOptimise(file, profile, folder, wasmBindgen) {
  const compiled = join(
    cargoTargetDir(),
    "wasm32-unknown-unknown",
    profile,
    `${file.library}.wasm`,
  );
  const out = join(folder, `${file.name}_bg.wasm`);
  const stamp = join(folder, `.${file.name}-stamp`);
  const key = createHash("sha256")
    .update(readFileSync(compiled))
    .update([profile, file.optimise, ...FEATURES, ...GLUE].join(" "))
    .digest("hex");
  const fresh = existsSync(stamp) && existsSync(out) && readFileSync(stamp, "utf8") === key;
  if (!fresh) {
    mkdirSync(folder, { recursive: true });
    rmSync(stamp, { force: true });
    await run(wasmBindgen, [
      ...[compiled, "--target", "web", "--omit-default-module-path"],
      ...["--out-dir", folder, "--out-name", file.name, ...GLUE],
    ]);
    if (profile === PUBLISHED) await optimise(file, out);
    writeFileSync(stamp, key);
  }
  const left = machinePaths(readFileSync(out));
  if (left.length > 0) {
    throw new Error(`${out} names ${left.length} folders of this machine, such as ${left[0]}`);
  }
  const place = relative(ROOT, join(file.out ?? WASM_OUT, `${file.name}_bg.wasm`));
  say(`  ${place}: ${describeSize(readFileSync(out))}`);
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
