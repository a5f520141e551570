// Compiles web/sdk with tsc and puts the wasm files and their glue beside the result.
import { copyFileSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { ROOT, SDK } from "./lib/paths.mjs";
import { run } from "./lib/run.mjs";
import { WASM_OUT } from "./wasm.mjs";

/** Builds web/sdk/dist from scratch. */
export async function buildSdk() {
  const dist = join(SDK, "dist");
  rmSync(dist, { recursive: true, force: true });
  writeInlineCore();
  // What stands in the comments is for readers of the declarations; pages need not download it.
  const tsc = [tscProgram(), "-p", join(SDK, "tsconfig.json")];
  await run(process.execPath, [...tsc, "--emitDeclarationOnly"]);
  await run(process.execPath, [...tsc, "--declaration", "false", "--removeComments"]);
  mkdirSync(join(dist, "wasm"), { recursive: true });
  // The glue's own .d.ts files stay behind: the package's types are hand-written.
  for (const name of readdirSync(WASM_OUT)) {
    if (/^(core|core-inline|renderer|bind|slim)(\.js|_bg\.wasm)$/.test(name)) {
      copyFileSync(join(WASM_OUT, name), join(dist, "wasm", name));
    }
  }
  // npm packs nothing from outside the package's folder.
  for (const name of ["LICENSE-MIT", "LICENSE-APACHE"]) {
    copyFileSync(join(ROOT, name), join(SDK, name));
  }
}

/** The core as a JavaScript module, for the entry `inline`; packed, or it would be 9 MB. */
function writeInlineCore() {
  const packed = gzipSync(readFileSync(join(WASM_OUT, "core_bg.wasm")), { level: 9 });
  const module = join(WASM_OUT, "core-inline");
  writeFileSync(
    `${module}.js`,
    `export const CORE_GZIP_BASE64 = "${packed.toString("base64")}";\n`,
  );
  writeFileSync(`${module}.d.ts`, "export const CORE_GZIP_BASE64: string;\n");
}

/** The path of TypeScript's command line. */
export function tscProgram() {
  return join(ROOT, "node_modules", "typescript", "bin", "tsc");
}
