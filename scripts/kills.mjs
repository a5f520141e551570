// npm run kills [-- PROGRAM]: kills the commands that write files at random instants (SIGKILL), and gives
// them disks that are full after so many bytes. After each, every file must be as it was or as a run to the
// end writes it, a bundle must hold the files that its bundle.json names, and the same command must then
// finish. Takes the dynaskin that it compiles, or PROGRAM.
import { spawn, spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import {
  cpSync,
  existsSync,
  mkdirSync,
  mkdtempSync,
  readdirSync,
  readFileSync,
  rmSync,
} from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { cargoTargetDir, MODELS, ROOT } from "./lib/paths.mjs";
import { bold, main, red, run, say } from "./lib/run.mjs";

/** Kills of each command, and disks that are full. */
const KILLS = 5;
const FULL_DISKS = 3;

const BODY = join(MODELS, "female", "body.glb");

let seed = 1;
/** Uniform in 0 to 1, the same in every run. */
function random() {
  seed = (Math.imul(seed, 1_664_525) + 1_013_904_223) >>> 0;
  return seed / 2 ** 32;
}

/** A hash of what a file holds, but for how long a training took. */
function hashOf(file) {
  let bytes = readFileSync(file);
  if (file.endsWith("bundle.json")) bytes = bytes.toString().replace(/"minutes": *[\d.e-]+/, "");
  return createHash("sha256").update(bytes).digest("hex");
}

/** A hash as bundle.json has it. */
const sha256Of = (file) => createHash("sha256").update(readFileSync(file)).digest("hex");

/** Hash of each finished file under a folder, by its path there. */
function contents(folder) {
  if (!existsSync(folder)) return {};
  const files = readdirSync(folder, { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => join(entry.parentPath, entry.name));
  return Object.fromEntries(files.map((file) => [file.slice(folder.length + 1), hashOf(file)]));
}

const isLeftover = (name) => name.endsWith(".part") || name.endsWith(".lock");

/** The commands: what stands in the folder before, and what is run. */
function commands(work, data) {
  const simulate = (out, frames) => [
    ...["simulate", "--procedural", "--shapes", "1", "--filter", "hop-1", "--no-mirror"],
    ...["--limit-frames", String(frames), "--body", BODY, "--jobs", "2", "--out", out],
  ];
  const train = (method, number) => (out) => [
    ...["train", method, "--seed", String(number), "--data", data, "--body", BODY, "--out", out],
  ];
  const avatars = join(work, "avatars");
  const bind = (avatar) => (out) => [
    ...["bind", join(avatars, avatar), "--body", BODY, "--depicts", "adult"],
    ...["--out", join(out, "me.binding")],
  ];
  return {
    simulate: { before: (out) => simulate(out, 12), command: (out) => simulate(out, 24) },
    "train dmpl": {
      before: (out) => [...train("dmpl", 1)(out), "--components", "20"],
      command: (out) => [...train("dmpl", 2)(out), "--components", "18"],
    },
    "train spring-bones": {
      before: (out) => [...train("dmpl", 1)(out), "--components", "20"],
      command: train("spring-bones", 2),
    },
    avatars: {
      before: (out) => ["avatars", "--body", BODY, "--out", out],
      command: (out) => ["avatars", "--body", join(MODELS, "male", "body.glb"), "--out", out],
      prepare: avatars,
    },
    bind: { before: bind("mixamo-t.glb"), command: bind("vrm0-t.vrm") },
  };
}

/** Runs to the end. */
async function finish(program, args) {
  await run(program, args, { quiet: true });
}

/** Kills it after `ms`; says whether it was still running. */
function kill(program, args, ms) {
  return new Promise((done) => {
    const child = spawn(program, args, { stdio: "ignore" });
    const timer = setTimeout(() => child.kill("SIGKILL"), ms);
    child.on("close", (status, signal) => {
      clearTimeout(timer);
      done(signal === "SIGKILL" ? "killed" : `ended with ${status} before`);
    });
  });
}

/** Lets no file grow beyond `bytes`, as on a full disk. */
function fillDisk(program, args, bytes) {
  const blocks = Math.max(1, Math.floor(bytes / 512));
  const script = `trap '' XFSZ; ulimit -f ${blocks}; exec "$@"`;
  const { status } = spawnSync("sh", ["-c", script, "sh", program, ...args], { stdio: "ignore" });
  return status === 0 ? "fitted" : `refused with ${status}`;
}

/** What is wrong in `folder`, a sentence each. */
function faults(folder, before, after) {
  const now = contents(folder);
  const wrong = [];
  for (const name of Object.keys(before)) {
    if (!(name in now)) wrong.push(`${name} is gone`);
  }
  for (const [name, hash] of Object.entries(now)) {
    if (isLeftover(name) || hash === before[name]) continue;
    // Cards and reports tell how long a run took.
    if (name.endsWith(".md") && name in after) continue;
    if (hash !== after[name]) wrong.push(`${name} is neither old nor new`);
  }
  const list = join(folder, "bundle.json");
  if (existsSync(list)) {
    const bundle = JSON.parse(readFileSync(list, "utf8"));
    for (const { file, sha256 } of [bundle.predictor, bundle.decoder, bundle.body]) {
      if (sha256Of(join(folder, file)) !== sha256)
        wrong.push(`${file} is not the one that bundle.json names`);
    }
  }
  return wrong;
}

async function tryCommand(program, work, name, { before, command, prepare }) {
  const first = prepare ?? join(work, `${name} before`);
  mkdirSync(first, { recursive: true });
  await finish(program, before(first));
  const reference = join(work, `${name} after`);
  cpSync(first, reference, { recursive: true });
  const began = performance.now();
  await finish(program, command(reference));
  const ms = performance.now() - began;
  const old = contents(first);
  const expected = contents(reference);
  const largest = Math.max(
    ...readdirSync(reference, { recursive: true, withFileTypes: true })
      .filter((entry) => entry.isFile())
      .map((entry) => readFileSync(join(entry.parentPath, entry.name)).length),
  );
  const situations = [
    ...Array.from({ length: KILLS }, () => ({ kind: "killed", at: ms * random() })),
    ...Array.from({ length: FULL_DISKS }, () => ({ kind: "full", at: largest * random() })),
  ];
  let count = 0;
  for (const { kind, at } of situations) {
    const out = join(work, "out");
    rmSync(out, { recursive: true, force: true });
    cpSync(first, out, { recursive: true });
    const how =
      kind === "killed"
        ? await kill(program, command(out), at)
        : fillDisk(program, command(out), at);
    const wrong = faults(out, old, expected);
    await finish(program, command(out));
    wrong.push(...faults(out, expected, expected).map((fault) => `${fault}, after a second run`));
    const left = Object.keys(contents(out)).filter((file) => file.endsWith(".part"));
    wrong.push(...left.map((file) => `${file} is left after a second run`));
    const place =
      kind === "killed" ? `after ${Math.round(at)} ms` : `${Math.round(at)} bytes a file`;
    say(`${name}, ${place}: ${how}${wrong.length > 0 ? red(`; ${wrong.join("; ")}`) : ""}`);
    count += wrong.length > 0 ? 1 : 0;
  }
  return [situations.length, count];
}

main(async () => {
  let program = process.argv[2];
  if (!program) {
    await run("cargo", ["build", "-p", "dynaskin-cli"], { cwd: ROOT });
    program = join(cargoTargetDir(), "debug", "dynaskin");
  }
  const work = mkdtempSync(join(tmpdir(), "dynaskin-kills-"));
  const data = join(work, "data");
  await finish(program, [
    ...["simulate", "--procedural", "--shapes", "1", "--no-mirror", "--limit-frames", "20"],
    ...["--body", BODY, "--out", data],
  ]);
  let [all, lost] = [0, 0];
  for (const [name, command] of Object.entries(commands(work, data))) {
    const [situations, faulty] = await tryCommand(program, work, name, command);
    all += situations;
    lost += faulty;
  }
  rmSync(work, { recursive: true, force: true });
  say(bold(`${all} kills and full disks: ${lost} with anything lost`));
  process.exitCode = lost > 0 ? 1 : 0;
});
