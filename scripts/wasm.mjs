// Builds the two wasm files and their JavaScript glue into web/sdk/src/wasm.
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
import { join } from "node:path";
import { brotliCompressSync, constants } from "node:zlib";
import { cargoTargetDir, ROOT, SDK } from "./lib/paths.mjs";
import { run, say } from "./lib/run.mjs";
import { ensureWasmBindgen } from "./toolchain.mjs";

export const WASM_OUT = join(SDK, "src", "wasm");

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

/**
 * Builds what changed, and puts it into the SDK's sources. Each profile's glue and optimised files are
 * kept beside cargo's output, for as long as that is the same.
 */
export async function buildWasm(profile = process.env.DYNASKIN_WASM_PROFILE || PUBLISHED) {
  const wasmBindgen = await ensureWasmBindgen();
  const bound = join(cargoTargetDir(), "wasm32-unknown-unknown", profile, "bound");
  for (const file of WASM_FILES) {
    await cargoBuild(file, profile);
    await bindAndOptimise(file, profile, bound, wasmBindgen);
  }
  mkdirSync(WASM_OUT, { recursive: true });
  for (const name of readdirSync(bound)) {
    if (!name.endsWith("-stamp")) copyFileSync(join(bound, name), join(WASM_OUT, name));
  }
  writeFileSync(PROFILE_STAMP, profile);
}

async function cargoBuild(file, profile) {
  say(`  compiling ${file.package} (${profile})`);
  const args = ["build", "-p", file.package, "--lib", "--target", "wasm32-unknown-unknown"];
  await run("cargo", [...args, "--profile", profile], {
    env: { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: "-C target-feature=+simd128" },
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
    .update([profile, file.optimise, ...FEATURES].join(" "))
    .digest("hex");
  const fresh = existsSync(stamp) && existsSync(out) && readFileSync(stamp, "utf8") === key;
  if (!fresh) {
    mkdirSync(folder, { recursive: true });
    rmSync(stamp, { force: true });
    await run(wasmBindgen, [
      ...[compiled, "--target", "web", "--omit-default-module-path"],
      ...["--out-dir", folder, "--out-name", file.name],
    ]);
    if (profile === PUBLISHED) await optimise(file, out);
    writeFileSync(stamp, key);
  }
  say(`  ${file.name}_bg.wasm: ${describeSize(readFileSync(out))}`);
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
