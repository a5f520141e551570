// Where things lie. Everything expensive to rebuild lives outside the clone, so that a fresh clone
// on the same machine starts warm.
import { homedir } from "node:os";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

export const ROOT = resolve(fileURLToPath(new URL("../..", import.meta.url)));
export const CACHE = join(process.env.XDG_CACHE_HOME || join(homedir(), ".cache"), "dynaskin");
export const SDK = join(ROOT, "web", "sdk");
export const DEMO = join(ROOT, "web", "demo");
export const EXAMPLES = join(ROOT, "web", "examples");
export const MODELS = join(ROOT, "models");

/** Cargo's output folder, as cargo itself would choose it. */
export function cargoTargetDir() {
  return resolve(ROOT, process.env.CARGO_TARGET_DIR || "target");
}

/** The mocap folder beside the clone, which tests may use and must not need. */
export function sharedDir() {
  return process.env.DYNASKIN_SHARED || resolve(ROOT, "..", "shared");
}
