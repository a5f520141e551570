// npm run docs:api: the reference of the package's entries as pages in artifacts/api, made by typedoc
// from the declarations that users get. Fails where an exported name has no description.
import { rmSync } from "node:fs";
import { join } from "node:path";
import { ROOT } from "./lib/paths.mjs";
import { main, run, say, step } from "./lib/run.mjs";
import { installTools } from "./lib/tools.mjs";
import { buildSdk } from "./sdk.mjs";

const SETTINGS = join(ROOT, "scripts", "docs-api");
const OUT = join(ROOT, "artifacts", "api");

/** Writes the pages with the typedoc in a folder of node_modules. */
async function write(tools) {
  rmSync(OUT, { recursive: true, force: true });
  await run(process.execPath, [
    join(tools, "node_modules", "typedoc", "bin", "typedoc"),
    ...["--options", join(SETTINGS, "typedoc.json"), "--tsconfig", join(SETTINGS, "tsconfig.json")],
    ...["--out", OUT],
  ]);
}

main(async () => {
  await step("SDK", buildSdk);
  let tools = "";
  await step("typedoc", async () => {
    tools = await installTools(SETTINGS, "docs-api");
  });
  await step("API reference", () => write(tools));
  say("\nOpen artifacts/api/index.html.");
});
