// npm packages that one script alone needs: in the cache, installed when that script runs.
import { createHash } from "node:crypto";
import { cpSync, existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { CACHE } from "./paths.mjs";
import { run } from "./run.mjs";

/** Installs what the lock file of `folder` names, once; the folder that holds its node_modules. */
export async function installTools(folder, name) {
  const tools = join(CACHE, name);
  const lock = readFileSync(join(folder, "package-lock.json"));
  const key = createHash("sha256").update(lock).digest("hex");
  const stamp = join(tools, "installed");
  if (existsSync(stamp) && readFileSync(stamp, "utf8") === key) return tools;
  mkdirSync(tools, { recursive: true });
  for (const file of ["package.json", "package-lock.json"]) {
    cpSync(join(folder, file), join(tools, file));
  }
  await run("npm", ["ci", "--no-audit", "--no-fund"], { cwd: tools, quiet: true });
  writeFileSync(stamp, key);
  return tools;
}
