// Builds the wasm files and their JavaScript glue into web/sdk/src/wasm, and the demo's core, which
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

/**
 * Files of their own, so that pages with an engine of their own never download wgpu, slim ones no tract, and only
 * those that bind avatars what binds.
 */
export const WASM_FILES = [
  { name: "core", package: "dynaskin-wasm", library: "dynaskin_wasm", optimise: "-O3" },
  {
    name: "renderer",
    package: "dynaskin-wasm-render",
    library: "dynaskin_wasm_render",
    optimise: "-Os",
  },
  {
    name: "bind",
    package: "dynaskin-wasm-bind",
    library: "dynaskin_wasm_bind",
    optimise: "-O3",
  },
  {
    // The core without tract.
    name: "slim",
    package: "dynaskin-wasm",
    library: "dynaskin_wasm",
    optimise: "-O3",
    features: ["--no-default-features"],
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

/** What the package and the demo need. */
const EVERY_FILE = [...WASM_FILES, GUESTS];

/** What the demo alone needs: its own core stands in for the package's, which has the same glue. */
const DEMO_FILES = [GUESTS, ...WASM_FILES.filter(({ name }) => name !== "core")];

/**
 * Builds what changed, and puts it where the SDK and the demo look for it. Each profile's glue and
 * optimised files are kept beside cargo's output, for as long as that is the same.
 */
export async function buildWasm(profile = process.env.DYNASKIN_WASM_PROFILE || PUBLISHED) {
  const bound = await bindAll(EVERY_FILE, profile);
  for (const { file, folder } of bound) place(file, folder, file.out ?? WASM_OUT);
  checkSharedGlue();
  writeFileSync(PROFILE_STAMP, profile);
}

/** The same for the demo page alone: one core instead of two. */
export async function buildDemoWasm(profile = process.env.DYNASKIN_WASM_PROFILE || PUBLISHED) {
  const bound = await bindAll(DEMO_FILES, profile);
  for (const { file, folder } of bound) {
    place(file, folder, WASM_OUT);
    if (file.out) place(file, folder, file.out);
  }
  writeFileSync(PROFILE_STAMP, `${profile}, the demo alone`);
}

/** Cargo uses all cores for most of a build, wasm-opt one: it works while cargo compiles the next file. */
async function bindAll(files, profile) {
  const optimised = [];
  let wasmBindgen;
  for (const file of files) {
    const compiled = cargoBuild(file, profile);
    // Installing the tool takes minutes once.
    [wasmBindgen] = await Promise.all([wasmBindgen ?? ensureWasmBindgen(), compiled]);
    optimised.push(await bind(file, profile, wasmBindgen));
  }
  for (const { done } of optimised) await done;
  return optimised;
}

function place(file, folder, out) {
  mkdirSync(out, { recursive: true });
  for (const name of readdirSync(folder)) {
    if (new RegExp(`^${file.name}(_bg)?\\.`).test(name)) {
      copyFileSync(join(folder, name), join(out, name));
    }
  }
}

/** A core runs only under the glue that was generated with it. */
function checkSharedGlue() {
  const own = readFileSync(join(WASM_OUT, "core.js"), "utf8");
  if (own !== readFileSync(join(DEMO_OUT, "core.js"), "utf8")) {
    throw new Error("The core with the compared methods needs another glue than the package's.");
  }
}

async function cargoBuild(file, profile) {
  const features = file.features ? `, ${file.features.join(" ")}` : "";
  say(`  compiling ${file.package} (${profile}${features})`);
  const flags = ["-C target-feature=+simd128", ...(await remapFlags())];
  const args = ["build", "-p", file.package, "--lib", "--target", "wasm32-unknown-unknown"];
  await run("cargo", [...args, ...(file.features ?? []), "--profile", profile], {
    env: { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: flags.join(" ") },
  });
}

/** Writes the glue, and begins to optimise: `done` resolves when `folder` holds the finished file. */
async function bind(file, profile, wasmBindgen) {
  const target = join(cargoTargetDir(), "wasm32-unknown-unknown", profile);
  const folder = join(target, file.out ? "bound-for-demo" : "bound");
  const compiled = join(target, `${file.library}.wasm`);
  const out = join(folder, `${file.name}_bg.wasm`);
  const stamp = join(folder, `.${file.name}-stamp`);
  const key = createHash("sha256")
    .update(readFileSync(compiled))
    .update([profile, file.optimise, ...FEATURES, ...GLUE].join(" "))
    .digest("hex");
  const fresh = existsSync(stamp) && existsSync(out) && readFileSync(stamp, "utf8") === key;
  const finish = async () => {
    if (!fresh) {
      if (profile === PUBLISHED) await optimise(file, out);
      writeFileSync(stamp, key);
    }
    const left = machinePaths(readFileSync(out));
    if (left.length > 0) {
      throw new Error(`${out} names ${left.length} folders of this machine, such as ${left[0]}`);
    }
    const place = relative(ROOT, join(file.out ?? WASM_OUT, `${file.name}_bg.wasm`));
    say(`  ${place}: ${describeSize(readFileSync(out))}`);
  };
  if (!fresh) {
    mkdirSync(folder, { recursive: true });
    rmSync(stamp, { force: true });
    await run(wasmBindgen, [
      ...[compiled, "--target", "web", "--omit-default-module-path"],
      ...["--out-dir", folder, "--out-name", file.name, ...GLUE],
    ]);
  }
  const done = finish();
  // A failure is thrown where `done` is awaited, which may be after another build's end.
  done.catch(() => {});
  return { file, folder, done };
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
