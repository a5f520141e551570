// node scripts/slurm.mjs [PROGRAM]: runs the Slurm recipe of docs/data-set.md for real, as a job array on this
// one machine, and compares the clips with those of a run without Slurm. It needs Debian's slurm-wlm and munge,
// and root. Takes the dynaskin that it compiles, or PROGRAM.
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
import { join } from "node:path";
import { setTimeout as pause } from "node:timers/promises";
import { cargoTargetDir, MODELS, ROOT } from "./lib/paths.mjs";
import { bold, main, run, say } from "./lib/run.mjs";

const PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "sinfo"];
/** The data set of the test, small enough for a minute: instead of the recipe's own. */
const SMALL = "--procedural --shapes 1 --no-mirror --limit-frames 40";
/** Parts of the job array, and the clips of each at most two at a time. */
const PARTS = 4;

/** The recipe as it stands in the documentation. */
function recipe() {
  const text = readFileSync(join(ROOT, "docs", "data-set.md"), "utf8");
  const blocks = [...text.matchAll(/```sh\n(#!\/bin\/sh\n[\s\S]*?)```/g)].map((match) => match[1]);
  const found = blocks.find((block) => block.includes("#SBATCH"));
  if (!found) throw new Error("docs/data-set.md has no recipe with #SBATCH");
  return found;
}

/** The recipe with this machine's paths and the small data set. */
function script(out, program) {
  const replaced = [
    [/--array=1-\d+/, `--array=1-${PARTS}`],
    [/--cpus-per-task=\d+/, "--cpus-per-task=1"],
    [/--mem=\S+/, "--mem=500M"],
    ["dynaskin simulate", `${program} simulate`],
    ["--preset full", SMALL],
    ["female.glb", join(MODELS, "female", "body.glb")],
    ["--mocap captures ", ""],
    ["/shared/data/female", out],
  ];
  let text = recipe();
  for (const [from, to] of replaced) {
    const next = text.replace(from, to);
    if (next === text) throw new Error(`the recipe no longer holds ${from}`);
    text = next;
  }
  return text;
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

/** Hash of each clip of a folder. */
function clips(folder) {
  const names = readdirSync(folder).sort();
  return names.map((name) => {
    const hash = createHash("sha256")
      .update(readFileSync(join(folder, name)))
      .digest("hex");
    return `${name} ${hash}`;
  });
}

await main(async () => {
  const missing = PROGRAMS.filter((program) => spawnSync("which", [program]).status !== 0);
  if (missing.length > 0) {
    throw new Error(`${missing.join(", ")} not found: apt-get install slurm-wlm munge`);
  }
  let [program] = process.argv.slice(2);
  if (!program) {
    await run("cargo", ["build", "--release", "-p", "dynaskin-cli"]);
    program = join(cargoTargetDir(), "release", "dynaskin");
  }
  const folder = mkdtempSync(join(tmpdir(), "dynaskin-slurm-"));
  const [shared, alone] = [join(folder, "shared"), join(folder, "alone")];
  const cluster = await slurm(folder);
  try {
    const file = join(folder, "simulate.sh");
    writeFileSync(file, script(shared, program));
    const log = join(folder, "part-%a.log");
    const began = performance.now();
    const job = spawnSync("sbatch", ["--wait", `--output=${log}`, file], {
      env: cluster.env,
      encoding: "utf8",
      timeout: 600_000,
    });
    if (job.status !== 0) {
      const logs = readdirSync(folder).filter((name) => name.startsWith("part-"));
      const told = logs.map((name) => `${name}:\n${readFileSync(join(folder, name), "utf8")}`);
      throw new Error(`sbatch: ${job.stderr}${job.stdout}\n${told.join("\n")}`);
    }
    const seconds = ((performance.now() - began) / 1000).toFixed(0);
    const [body, words] = [join(MODELS, "female", "body.glb"), SMALL.split(" ")];
    await run(program, ["simulate", ...words, "--body", body, "--out", alone], { quiet: true });
    const [parts, whole] = [clips(shared), clips(alone)];
    if (parts.length === 0 || parts.join() !== whole.join()) {
      throw new Error(`${parts.length} clips by Slurm, ${whole.length} without, or other bytes`);
    }
    say(
      bold(
        `${parts.length} clips in ${PARTS} parts by Slurm in ${seconds} s, the same bytes as without`,
      ),
    );
  } finally {
    await cluster.stop();
    rmSync(folder, { recursive: true, force: true });
  }
});
