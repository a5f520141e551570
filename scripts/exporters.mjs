// node scripts/exporters.mjs [WORD...]: makes files of one motion with the exporters that people use, and
// shows how far the poses that are read from each are from the motion. Downloads some 400 MB of
// pinned packages once, so it is no part of npm test. Needs Python 3.11 for Blender.
// With words, only files whose exporter or variant holds one are made anew, the others compared as
// they are.
//
// Ends badly where a file differs by more than 0.1 degrees that `misses` in
// scripts/exporters/variants.mjs does not name, or where one that it names does not any more.
import { existsSync, mkdirSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { EXPORTERS, SOURCES, VARIANTS, VERSIONS } from "./exporters/variants.mjs";
import { CACHE, cargoTargetDir, MODELS, ROOT } from "./lib/paths.mjs";
import { main, run, say, step, which } from "./lib/run.mjs";

const FOLDER = join(CACHE, "exporters");
const OUT = join(FOLDER, "files");
const PYTHON = join(FOLDER, `bpy-${VERSIONS.bpy}-${VERSIONS.vrm}`);
const BODY = join(MODELS, "female", "body.glb");
const LIMIT_DEGREES = 0.1;

const words = process.argv.slice(2);
const isWanted = (variant) =>
  words.length === 0 || words.some((word) => key(variant).includes(word));

const key = (variant) => `${variant.exporter}: ${variant.name}`;
const fileOf = (variant) =>
  join(OUT, key(variant).replace(/[^a-z0-9.]+/gi, "-") + EXPORTERS[variant.exporter].suffix);
const sourceFile = (source) => join(OUT, `known-${source}.bvh`);
const example = (name) => join(cargoTargetDir(), "debug", "examples", name);

async function install() {
  mkdirSync(FOLDER, { recursive: true });
  writeFileSync(join(FOLDER, "package.json"), '{ "private": true }\n');
  const packages = [`three@${VERSIONS.three}`, `gltfpack@${VERSIONS.gltfpack}`];
  await run("npm", ["install", "--ignore-scripts", "--no-save", ...packages], {
    cwd: FOLDER,
    quiet: true,
  });
  if (existsSync(join(PYTHON, "ready"))) return;
  if (!which("python3.11")) throw new Error("Blender's package needs python3.11 on the PATH.");
  rmSync(PYTHON, { recursive: true, force: true });
  await run("python3.11", ["-m", "venv", PYTHON], { quiet: true });
  const wheels = [
    `bpy==${VERSIONS.bpy}`,
    `bpy-vrm-format==${VERSIONS.vrm}`,
    `numpy==${VERSIONS.numpy}`,
  ];
  await run(join(PYTHON, "bin", "pip"), ["install", "--quiet", ...wheels], { quiet: true });
  writeFileSync(join(PYTHON, "ready"), "");
}

async function makeSources() {
  for (const variant of VARIANTS.filter(isWanted)) rmSync(fileOf(variant), { force: true });
  mkdirSync(OUT, { recursive: true });
  const cargo = ["build", "-p", "dynaskin-motion", "--features", "amass", "--examples"];
  await run("cargo", cargo, { quiet: true });
  for (const [name, [rate, zero]] of Object.entries(SOURCES)) {
    await run(example("known_motion"), [BODY, sourceFile(name), String(rate), zero]);
  }
}

/** Makes the files of one program, and gives what it says of those that it does not make. */
async function make(by, program, args) {
  const plan = VARIANTS.filter(isWanted)
    .filter((variant) => EXPORTERS[variant.exporter].by === by)
    .map((variant) => ({
      ...variant,
      out: fileOf(variant),
      source: sourceFile(variant.source),
    }));
  const path = join(OUT, `${by}.json`);
  writeFileSync(path, JSON.stringify(plan));
  const failed = new Map();
  const onLine = (line) => {
    const [tag, out, state, why] = line.split("\t");
    if (tag === "VARIANT" && state === "failed") failed.set(out, why);
  };
  await run(program, [...args, path], { quiet: true, onLine });
  return failed;
}

async function pack() {
  const failed = new Map();
  const program = join(FOLDER, "node_modules", "gltfpack", "cli.js");
  for (const variant of VARIANTS.filter(isWanted).filter(({ of }) => of)) {
    const input = fileOf(VARIANTS.find((other) => key(other) === variant.of));
    const args = [program, "-i", input, "-o", fileOf(variant), ...variant.flags];
    const { status } = await run(process.execPath, args, { quiet: true, allowFailure: true });
    if (status !== 0) failed.set(fileOf(variant), `ended with ${status}`);
  }
  return failed;
}

/** Rows by file: `{ degrees, joint, rootMm, rateHz }`, or `{ refused }`. */
async function compare() {
  const rows = new Map();
  for (const control of Object.keys(SOURCES)) {
    const made = VARIANTS.filter((variant) => variant.control === control).filter((variant) =>
      existsSync(fileOf(variant)),
    );
    const files = made.map((variant) => (variant.named ? "named=" : "") + fileOf(variant));
    const onLine = (line) => {
      const [degrees, joint, , rootMm, rateHz, file] = line.split("\t");
      const row = degrees === "refused" ? { refused: joint } : { degrees, joint, rootMm, rateHz };
      rows.set(file, row);
    };
    const args = [BODY, sourceFile(control), ...files];
    await run(example("compare_motions"), args, { quiet: true, allowFailure: true, onLine });
  }
  return rows;
}

/** Prints the tables and why files miss; gives the variants that are not as `misses` has it. */
function report(rows, failed) {
  const results = VARIANTS.map((variant) => {
    const file = fileOf(variant);
    const found = rows.get(file) ?? { refused: failed.get(file) ?? "no file was made" };
    return { ...variant, ...found, isSame: found.degrees <= LIMIT_DEGREES };
  });
  printTables(results);
  say();
  for (const { exporter, name, misses } of results.filter((result) => result.misses)) {
    say(`- ${EXPORTERS[exporter].title}, ${name}: ${misses}.`);
  }
  const apart = results.filter((result) => result.isSame).map((result) => +result.rootMm);
  say(`\nRoots of files within the limit: at most ${Math.max(0, ...apart)} mm apart.`);
  return results
    .filter((result) => result.isSame === Boolean(result.misses))
    .map((result) => {
      const found = `${result.degrees} degrees (${result.joint}), root ${result.rootMm} mm`;
      return `${key(result)}: ${result.refused ?? found}`;
    });
}

/** What several exporters have, beside each other; then what only one has. */
function printTables(results) {
  const cell = (result) => {
    if (!result) return "";
    return result.refused ? "none" : `${(+result.degrees).toFixed(3)}°`;
  };
  const line = (cells) => say(`| ${cells.join(" | ")} |`);
  const byName = new Map();
  for (const result of results) {
    byName.set(result.name, [...(byName.get(result.name) ?? []), result]);
  }
  const several = [...byName.values()].filter((group) => group.length > 1);
  const columns = Object.keys(EXPORTERS).filter((exporter) =>
    several.some((group) => group.some((result) => result.exporter === exporter)),
  );
  line(["variant", ...columns.map((exporter) => EXPORTERS[exporter].title)]);
  line(["---", ...columns.map(() => "---")]);
  for (const group of several) {
    const of = (exporter) => group.find((result) => result.exporter === exporter);
    line([group[0].name, ...columns.map((exporter) => cell(of(exporter)))]);
  }
  say();
  line(["exporter", "variant", "largest difference"]);
  line(["---", "---", "---"]);
  for (const [result] of [...byName.values()].filter((group) => group.length === 1)) {
    line([EXPORTERS[result.exporter].title, result.name, cell(result)]);
  }
}

main(async () => {
  await step("install", install);
  await step("sources", makeSources);
  const here = join(ROOT, "scripts", "exporters");
  const python = join(PYTHON, "bin", "python");
  const failed = await step("Blender", () => make("blender", python, [join(here, "blender.py")]));
  const byThree = await step("three", () =>
    make("three", process.execPath, [join(here, "three.mjs"), FOLDER]),
  );
  const byPack = await step("gltfpack", pack);
  const surprises = await step("compare", async () =>
    report(await compare(), new Map([...failed, ...byThree, ...byPack])),
  );
  if (surprises.length > 0) throw new Error(`not as expected:\n${surprises.join("\n")}`);
});
