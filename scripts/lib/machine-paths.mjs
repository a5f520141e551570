// Folders of the machine that builds, which what ships must not name.
import { existsSync, readdirSync } from "node:fs";
import { homedir } from "node:os";
import { isAbsolute, join, relative } from "node:path";
import { cargoTargetDir, ROOT } from "./paths.mjs";
import { run } from "./run.mjs";

/** Where cargo keeps the sources of crates. */
function cargoHome() {
  return process.env.CARGO_HOME || join(homedir(), ".cargo");
}

/** The folders of crates' sources, one a registry, with the registry's host in their names. */
async function registries() {
  const sources = join(cargoHome(), "registry", "src");
  if (!existsSync(sources)) await run("cargo", ["fetch", "--locked"], { quiet: true });
  return existsSync(sources) ? readdirSync(sources).map((name) => join(sources, name)) : [];
}

/**
 * The clone's own folder, where generated sources lie in it. Other sources of ours are compiled by relative paths.
 * Flags that named the clone needlessly would make cargo compile every crate again for each clone that shares a cache.
 */
function clone() {
  const target = relative(ROOT, cargoTargetDir());
  const inside = !target.startsWith("..") && !isAbsolute(target);
  return inside ? [[ROOT, "/dynaskin"]] : [];
}

/** Flags for rustc: panics name their places in crates, in Rust's library and here without the machine's folders. */
export async function remapFlags() {
  const { output } = await run("rustc", ["--print", "sysroot"], { quiet: true });
  // Of several that fit, rustc takes the last.
  const places = [
    [homedir(), "/home"],
    ...clone(),
    [cargoHome(), "/cargo"],
    ...(await registries()).map((folder) => [folder, "/crates"]),
    [join(output.trim(), "lib", "rustlib", "src", "rust"), "/rust"],
  ];
  return places.map(([from, to]) => `--remap-path-prefix=${from}=${to}`);
}

/** The places in a file that name a folder of this machine, such as those of crates' sources. */
export function machinePaths(bytes) {
  const text = Buffer.from(bytes).toString("latin1");
  const folders = [ROOT, cargoHome(), join(homedir(), "")].filter((folder) => folder.length > 3);
  const escaped = folders.map((folder) => folder.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
  const named = new RegExp(`(?:${escaped.join("|")}|index\\.crates\\.io-)[ -~]{0,120}`, "g");
  return text.match(named) ?? [];
}
