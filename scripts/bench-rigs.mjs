// npm run bench:rigs: the networks beside the simulator on rigs that turn their collars, as Markdown tables.
// Simulates what it compares with, which takes minutes; what was simulated is kept in target/rigs.
import { spawnSync } from "node:child_process";
import { existsSync } from "node:fs";
import { join } from "node:path";
import { cargoTargetDir, ROOT, sharedDir } from "./lib/paths.mjs";
import { main, say } from "./lib/run.mjs";

/** Captures that the networks did not learn from. */
const CAPTURES = ["05_18.bvh", "09_01.bvh", "14_20a.bvh", "16_05.bvh"];

main(async () => {
  const folder = join(sharedDir(), "mocap", "train");
  const clips = CAPTURES.map((name) => join(folder, name)).filter((path) => existsSync(path));
  if (clips.length === 0) say(`skipped: captures need ${folder}; procedural motions stand in`);
  const example = ["run", "--release", "--package", "dynaskin-runtime", "--example", "rigs"];
  const kept = ["--kept", join(cargoTargetDir(), "rigs")];
  const args = [...example, "--", ...kept, ...process.argv.slice(2), ...clips];
  const { status, error } = spawnSync("cargo", args, { cwd: ROOT, stdio: "inherit" });
  if (error) throw error;
  process.exitCode = status ?? 1;
});
