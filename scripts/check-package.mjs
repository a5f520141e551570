// npm run check:package: packs the crate `dynaskin` and those that it needs, unpacks them, and runs its
// example in a crate that knows nothing but the unpacked ones. It compiles for minutes where nothing has
// been compiled yet, so it is not part of npm test.
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { CACHE, cargoTargetDir, MODELS, ROOT } from "./lib/paths.mjs";
import { main, run, say, step } from "./lib/run.mjs";

const FOLDER = join(CACHE, "check-package");
const PACKED = join(FOLDER, "packed");
const UNPACKED = join(FOLDER, "crates");
const SCRATCH = join(FOLDER, "scratch");
const AVATARS = 4;

/** The published crates as cargo knows them: those that do not say `publish = false`. */
async function publishedCrates() {
  const { output } = await run("cargo", ["metadata", "--no-deps", "--format-version", "1"], {
    quiet: true,
  });
  const packages = JSON.parse(output).packages.filter(({ publish }) => publish?.length !== 0);
  return packages.map(({ name, version }) => ({ name, version }));
}

async function pack(crates) {
  rmSync(PACKED, { recursive: true, force: true });
  const names = crates.flatMap(({ name }) => ["-p", name]);
  // The scratch crate below compiles what was packed.
  await run("cargo", ["package", ...names, "--no-verify", "--allow-dirty"], {
    env: { CARGO_TARGET_DIR: PACKED },
    quiet: true,
  });
}

async function unpack(crates) {
  rmSync(UNPACKED, { recursive: true, force: true });
  mkdirSync(UNPACKED, { recursive: true });
  for (const { name, version } of crates) {
    const file = join(PACKED, "package", `${name}-${version}.crate`);
    // Packed files have one old date, by which cargo would take changed sources for built ones.
    await run("tar", ["-xzmf", file, "-C", UNPACKED], { quiet: true });
    for (const needed of ["Cargo.toml", "README.md", "src/lib.rs"]) {
      if (existsSync(join(UNPACKED, `${name}-${version}`, needed))) continue;
      throw new Error(`The package of ${name} lacks ${needed}.`);
    }
    say(`  ${name} ${version}`);
  }
}

/** A crate with the examples of `dynaskin` and nothing of this repository but the packages. */
function writeScratch(crates) {
  rmSync(SCRATCH, { recursive: true, force: true });
  mkdirSync(join(SCRATCH, "src"), { recursive: true });
  const own = crates.find(({ name }) => name === "dynaskin");
  const folder = ({ name, version }) => join(UNPACKED, `${name}-${version}`);
  const patches = crates.map(
    (each) => `${each.name} = { path = ${JSON.stringify(folder(each))} }\n`,
  );
  writeFileSync(
    join(SCRATCH, "Cargo.toml"),
    [
      '[package]\nname = "scratch"\nversion = "0.0.0"\nedition = "2024"\npublish = false\n\n',
      `[dependencies]\ndynaskin = "${own.version}"\n\n[workspace]\n\n[patch.crates-io]\n`,
      ...patches,
      `\n${devProfile()}`,
    ].join(""),
  );
  writeFileSync(join(SCRATCH, "src", "lib.rs"), "");
  cpSync(join(folder(own), "examples"), join(SCRATCH, "examples"), { recursive: true });
  // The versions that are tested here.
  cpSync(join(ROOT, "Cargo.lock"), join(SCRATCH, "Cargo.lock"));
}

/** The workspace's settings for builds, so that what its tests compiled is used again. */
function devProfile() {
  const manifest = readFileSync(join(ROOT, "Cargo.toml"), "utf8");
  const [profile] = /\[profile\.dev\][\s\S]*?(?=\n\[profile\.release\])/.exec(manifest) ?? [];
  if (!profile) throw new Error("Cargo.toml has no [profile.dev] before [profile.release].");
  return `${profile}\n`;
}

async function runExample() {
  const cargo = (...args) =>
    run("cargo", args, {
      cwd: SCRATCH,
      env: { CARGO_TARGET_DIR: cargoTargetDir() },
      quiet: true,
    });
  await cargo("build", "--examples");
  const model = join(MODELS, "female");
  const { output } = await cargo("run", "--example", "crowd", "--", model, `${AVATARS}`);
  if (!output.includes(" ms a step")) throw new Error(`The example said:\n${output}`);
  for (const line of output.trim().split("\n")) say(`  ${line}`);
}

main(async () => {
  const crates = await publishedCrates();
  await step("cargo package", () => pack(crates));
  await step("What was packed", () => unpack(crates));
  writeScratch(crates);
  await step("The example, on the packages alone", runExample);
});
