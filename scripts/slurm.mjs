// node scripts/slurm.mjs [PROGRAM [CAPTURES BODY]]: runs the recipes of docs/many-machines.md for real, as job arrays on
// this one machine, and compares the files with those of runs without Slurm. It needs Debian's slurm-wlm and munge,
// and root. Takes the dynaskin that it compiles, or PROGRAM; fits only where it has CAPTURES of a BODY.
import { spawn, spawnSync } from "node:child_process";
import { createHash, randomBytes } from "node:crypto";
import {
  chmodSync,
  mkdirSync,
  mkdtempSync,
  readdirSync,
  readFileSync,
  rmSync,
  writeFileSync,
} from "node:fs";
import { cpus, hostname, tmpdir, totalmem } from "node:os";
import { join, relative } from "node:path";
import { setTimeout as pause } from "node:timers/promises";
import { cargoTargetDir, MODELS, ROOT } from "./lib/paths.mjs";
import { bold, main, run, say } from "./lib/run.mjs";

const PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "sinfo"];
/** The data set of the test, small enough for a minute: instead of the recipe's own. */
const SMALL = "--procedural --shapes 1 --no-mirror --limit-frames 40";
/** Parts of the job array, and the clips of each at most two at a time. */
const PARTS = 4;

/** The commands of the recipes, as they stand in the documentation, as words: of `simulate`, then of `fit-all`. */
function recipes() {
  const text = readFileSync(join(ROOT, "docs", "many-machines.md"), "utf8");
  const [, block = ""] = /```sh\n(sbatch [\s\S]*?)```/.exec(text) ?? [];
  const lines = block.replaceAll("\\\n", " ").trim().split("\n");
  return ["simulate", "fit-all"].map((command) => {
    const line = lines.find((line) => line.includes(` dynaskin ${command} `));
    if (!line) throw new Error(`docs/many-machines.md has no recipe for ${command}`);
    return line.split(/\s+/);
  });
}

/** A recipe with other words; each of `replaced` has to be there. */
function changed(words, replaced) {
  return replaced.reduce((words, [from, ...to]) => {
    const place = words.indexOf(from);
    if (place < 0) throw new Error(`the recipe no longer holds ${from}`);
    return words.toSpliced(place, 1, ...to);
  }, words);
}

/** Starts Slurm on this machine; `stop` ends it. */
async function slurm(folder) {
  const key = join(folder, "munge.key");
  writeFileSync(key, randomBytes(128));
  chmodSync(key, 0o400);
  const host = hostname().split(".")[0];
  const socket = join(folder, "munge.socket");
  for (const name of ["state", "spool"]) mkdirSync(join(folder, name));
  const config = join(folder, "slurm.conf");
  const memory = Math.floor(totalmem() / 2 ** 20 / 2);
  writeFileSync(
    config,
    `${[
      "ClusterName=one",
      `SlurmctldHost=${host}(127.0.0.1)`,
      "SlurmUser=root",
      "SlurmctldPort=16817",
      "SlurmdPort=16818",
      `AuthInfo=socket=${socket}`,
      "ProctrackType=proctrack/linuxproc",
      "TaskPlugin=task/none",
      "JobAcctGatherType=jobacct_gather/none",
      "SelectType=select/cons_tres",
      "SelectTypeParameters=CR_Core_Memory",
      "MpiDefault=none",
      "ReturnToService=2",
      `StateSaveLocation=${join(folder, "state")}`,
      `SlurmdSpoolDir=${join(folder, "spool")}`,
      `SlurmctldPidFile=${join(folder, "slurmctld.pid")}`,
      `SlurmdPidFile=${join(folder, "slurmd.pid")}`,
      `NodeName=${host} NodeAddr=127.0.0.1 CPUs=${cpus().length} RealMemory=${memory} State=UNKNOWN`,
      `PartitionName=all Nodes=${host} Default=YES MaxTime=INFINITE State=UP`,
    ].join("\n")}\n`,
  );
  const env = { ...process.env, SLURM_CONF: config };
  const started = [];
  const start = (program, args) => {
    const child = spawn(program, args, { env, stdio: ["ignore", "ignore", "pipe"] });
    let said = "";
    child.stderr.on("data", (text) => {
      said += text;
    });
    started.push({ child, program, said: () => said.trim().split("\n").slice(-5).join("\n") });
  };
  const files = (name) => [`--${name}=${join(folder, name)}`];
  start("munged", [
    ...["--foreground", "--force", `--key-file=${key}`, `--socket=${socket}`, "--num-threads=2"],
    ...[...files("pid-file"), ...files("seed-file")],
  ]);
  await pause(1000);
  start("slurmctld", ["-D", "-c"]);
  start("slurmd", ["-D", "-N", host]);
  const stop = async () => {
    for (const { child } of started.reverse()) {
      if (child.exitCode === null) {
        const ended = new Promise((done) => child.once("exit", done));
        child.kill("SIGTERM");
        await Promise.race([ended, pause(5000)]);
      }
    }
  };
  for (let second = 0; second < 40; second += 1) {
    const ended = started.find(({ child }) => child.exitCode !== null);
    if (ended) {
      await stop();
      throw new Error(`${ended.program} ended:\n${ended.said()}`);
    }
    const state = spawnSync("sinfo", ["-h", "-o", "%t"], { env, encoding: "utf8" }).stdout.trim();
    if (state === "idle") return { env, stop };
    await pause(1000);
  }
  const said = started.map(({ program, said }) => `${program}: ${said()}`).join("\n");
  await stop();
  throw new Error(`Slurm has no idle node after 40 s\n${said}`);
}

/** Hash of each file of a folder and the folders in it. */
function files(folder) {
  const found = readdirSync(folder, { recursive: true, withFileTypes: true });
  const paths = found
    .filter((entry) => entry.isFile())
    .map((entry) => join(entry.parentPath, entry.name));
  return paths.sort().map((path) => {
    const name = relative(folder, path);
    const hash = createHash("sha256").update(readFileSync(path)).digest("hex");
    return `${name} ${hash}`;
  });
}

/** Submits a recipe and waits; gives the seconds. */
function submit(words, cluster, folder) {
  const log = join(folder, "part-%A-%a.log");
  const began = performance.now();
  const [sbatch, ...rest] = words;
  const job = spawnSync(sbatch, ["--wait", `--output=${log}`, `--array=1-${PARTS}`, ...rest], {
    env: cluster.env,
    cwd: ROOT,
    encoding: "utf8",
    timeout: 600_000,
  });
  if (job.status !== 0) {
    const logs = readdirSync(folder).filter((name) => name.startsWith("part-"));
    const told = logs.map((name) => `${name}:\n${readFileSync(join(folder, name), "utf8")}`);
    throw new Error(`sbatch: ${job.stderr}${job.stdout}\n${told.join("\n")}`);
  }
  return ((performance.now() - began) / 1000).toFixed(0);
}

/** Throws where parts did not leave what one run leaves. */
function compare(what, seconds, parts, whole) {
  if (parts.length === 0 || parts.join() !== whole.join()) {
    throw new Error(
      `${what}: ${parts.length} files by Slurm, ${whole.length} without, or other bytes`,
    );
  }
  say(
    bold(
      `${what}: ${parts.length} files in ${PARTS} parts by Slurm in ${seconds} s, the same bytes as without`,
    ),
  );
}

await main(async () => {
  const missing = PROGRAMS.filter((program) => spawnSync("which", [program]).status !== 0);
  if (missing.length > 0) {
    throw new Error(`${missing.join(", ")} not found: apt-get install slurm-wlm munge`);
  }
  let [program, captures, fitted] = process.argv.slice(2);
  if (!program) {
    await run("cargo", ["build", "--release", "-p", "dynaskin-cli"]);
    program = join(cargoTargetDir(), "release", "dynaskin");
  }
  const folder = mkdtempSync(join(tmpdir(), "dynaskin-slurm-"));
  const at = (name) => join(folder, name);
  const cluster = await slurm(folder);
  try {
    const [simulate, fit] = recipes();
    const small = ["--cpus-per-task=1", "--mem=500M", "scripts/part.sh"];
    const body = join(MODELS, "female", "body.glb");
    const changes = [
      ["scripts/part.sh", ...small],
      ["dynaskin", program],
      ["--preset", ...SMALL.split(" ")],
      ["full"],
      ["female.glb", body],
      ["--mocap"],
      ["captures"],
      ["/shared/data/female", at("clips")],
    ];
    let seconds = submit(changed(simulate, changes), cluster, folder);
    const words = SMALL.split(" ");
    await run(program, ["simulate", ...words, "--body", body, "--out", at("alone")], {
      quiet: true,
    });
    compare("simulate", seconds, files(at("clips")), files(at("alone")));
    if (!captures) return;
    const asked = fit.filter((word) => !/^--(array|mem)=/.test(word));
    const fitChanges = [
      ["scripts/part.sh", ...small],
      ["dynaskin", program],
      ["my-body/body.glb", fitted],
      ["captures.hdf5", captures],
      ["/shared/my-fits", at("fits")],
    ];
    seconds = submit(changed(asked, fitChanges), cluster, folder);
    const whole = ["--body", fitted, "--scans", captures, "--rate", "60", "--out"];
    for (const out of ["fits", "fitted-alone"]) {
      await run(program, ["fit-all", ...whole, at(out)], { quiet: true });
    }
    compare("fit-all", seconds, files(at("fits")), files(at("fitted-alone")));
  } finally {
    await cluster.stop();
    rmSync(folder, { recursive: true, force: true });
  }
});
