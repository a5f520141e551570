// npm run pack: the npm packages as tarballs in artifacts/packages: the SDK, and each body with its networks.
import { mkdirSync, readdirSync, rmSync } from "node:fs";
import { join, relative } from "node:path";
import { buildAll } from "./build.mjs";
import { PACKAGES, writeModelPackages } from "./lib/model-packages.mjs";
import { SDK } from "./lib/paths.mjs";
import { main, run, say, step } from "./lib/run.mjs";

/**
 * Packs the built SDK and the models.
 *
 * @param {string} folder where the tarballs go
 * @returns {Promise<string[]>} their paths, the SDK's first
 */
export async function packAll(folder) {
  mkdirSync(folder, { recursive: true });
  for (const old of readdirSync(folder).filter((name) => name.endsWith(".tgz"))) {
    rmSync(join(folder, old));
  }
  const tarballs = [];
  for (const source of [SDK, ...writeModelPackages()]) {
    const { output } = await run("npm", ["pack", "--pack-destination", folder], {
      cwd: source,
      quiet: true,
    });
    tarballs.push(join(folder, output.trim().split("\n").at(-1)));
  }
  return tarballs;
}

if (process.argv[1] === import.meta.filename) {
  main(async () => {
    await buildAll();
    const tarballs = await step("Packages", () => packAll(PACKAGES));
    const paths = tarballs.map((path) => relative(process.cwd(), path));
    for (const path of paths) say(`  ${path}`);
    say(`\nInstall them in an application: npm install ${tarballs.join(" ")}`);
  });
}
