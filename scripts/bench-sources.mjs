// npm run bench:sources: what the source of poses does to the tissue, as a Markdown table: each source of
// docs/pose-sources.md without conditioning and under each preset, beside what is aimed at.
import { spawnSync } from "node:child_process";
import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { ROOT, sharedDir } from "./lib/paths.mjs";
import { main, say } from "./lib/run.mjs";

const SECONDS = 4;
const RATE_HZ = 60;

/** Captures that the networks did not learn from: of each trial the first that is long enough. */
function heldOut(folder) {
  const split = JSON.parse(
    readFileSync(join(ROOT, "crates", "train", "config", "split.json"), "utf8"),
  );
  const seen = new Set();
  return readdirSync(folder)
    .toSorted()
    .map((name) => ({ name, parts: /^(\d+)_(\d+)[a-z]*\.bvh$/.exec(name) }))
    .filter(({ name, parts }) => {
      if (!parts) return false;
      const [, subject, number] = parts;
      const trial = `${subject}_${number}`;
      const unseen = split.test_subjects.includes(subject) || split.test_trials.includes(trial);
      if (!unseen || seen.has(trial) || frames(join(folder, name)) < SECONDS * RATE_HZ)
        return false;
      seen.add(trial);
      return true;
    })
    .map(({ name }) => join(folder, name));
}

function frames(path) {
  return Number(/^Frames:\s*(\d+)/m.exec(readFileSync(path, "latin1"))?.[1] ?? 0);
}

main(async () => {
  const folder = join(sharedDir(), "mocap", "train");
  const clips = existsSync(folder) ? heldOut(folder) : [];
  if (clips.length === 0) say(`skipped: captures need ${folder}; procedural motions stand in`);
  const example = [
    "run",
    "--release",
    "--package",
    "dynaskin-runtime",
    "--example",
    "pose_sources",
  ];
  const args = [...example, "--", ...process.argv.slice(2), ...clips];
  const { status, error } = spawnSync("cargo", args, { cwd: ROOT, stdio: "inherit" });
  if (error) throw error;
  process.exitCode = status ?? 1;
});
