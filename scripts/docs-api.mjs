// npm run docs:api: the reference of the package's entries as pages in artifacts/api, made by typedoc
// from the declarations that users get. Fails where an exported name has no description.
import { createHash } from "node:crypto";
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { CACHE, ROOT } from "./lib/paths.mjs";
import { main, run, say, step } from "./lib/run.mjs";
import { buildSdk } from "./sdk.mjs";

const SETTINGS = join(ROOT, "scripts", "docs-api");
const TOOLS = join(CACHE, "docs-api");
const OUT = join(ROOT, "artifacts", "api");

/** typedoc and its TypeScript, in the cache, once per lock file. */
async function install() {
  const lock = readFileSync(join(SETTINGS, "package-lock.json"));
  const key = createHash("sha256").update(lock).digest("hex");
  const stamp = join(TOOLS, "installed");
  if (existsSync(stamp) && readFileSync(stamp, "utf8") === key) return;
  mkdirSync(TOOLS, { recursive: true });
  for (const name of ["package.json", "package-lock.json"]) {
    cpSync(join(SETTINGS, name), join(TOOLS, name));
  }
  await run("npm", ["ci", "--no-audit", "--no-fund"], { cwd: TOOLS, quiet: true });
  writeFileSync(stamp, key);
}

async function write() {
  rmSync(OUT, { recursive: true, force: true });
  await run(process.execPath, [
    join(TOOLS, "node_modules", "typedoc", "bin", "typedoc"),
    ...["--options", join(SETTINGS, "typedoc.json"), "--tsconfig", join(SETTINGS, "tsconfig.json")],
    ...["--out", OUT],
  ]);
}

main(async () => {
  await step("SDK", buildSdk);
  await step("typedoc", install);
  await step("API reference", write);
  say("\nOpen artifacts/api/index.html.");
});
