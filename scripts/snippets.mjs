// Type-checks the code of README and docs; a step of npm test. TypeScript is checked as strictly as the package itself;
// JavaScript, also that of HTML, for what is there and what is not: its parameters have no types.
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
import { join, relative } from "node:path";
import { pagesOf } from "./lib/doc-links.mjs";
import { PACKAGES, writeModelPackages } from "./lib/model-packages.mjs";
import { ROOT } from "./lib/paths.mjs";
import { main, run, say } from "./lib/run.mjs";
import { moduleIn, snippetsOf } from "./lib/snippets.mjs";
import { tscProgram } from "./sdk.mjs";

const FOLDER = join(ROOT, "test-results", "snippets");

const SHARED = {
  target: "ES2022",
  module: "ESNext",
  moduleResolution: "Bundler",
  moduleDetection: "force",
  lib: ["ES2023", "DOM", "DOM.Iterable"],
  types: [],
  jsx: "react-jsx",
  // The declarations of three.js and Babylon.js disagree about WebXR.
  skipLibCheck: true,
  noEmit: true,
  paths: Object.fromEntries(
    ["female", "male"].flatMap((name) =>
      ["index", "inline"].map((entry) => [
        `dynaskin-${name}${entry === "index" ? "" : `/${entry}`}`,
        [join(PACKAGES, `dynaskin-${name}`, `${entry}.d.ts`)],
      ]),
    ),
  ),
};
const STRICT = {
  strict: true,
  exactOptionalPropertyTypes: true,
  noUncheckedIndexedAccess: true,
};

/** Throws where a page's code does not fit the package. */
export async function checkSnippets() {
  rmSync(FOLDER, { recursive: true, force: true });
  writeModelPackages();
  const count = { typescript: 0, javascript: 0 };
  for (const page of pagesOf(ROOT)) {
    for (const snippet of await snippetsOf(page)) {
      const kind = snippet.language.startsWith("ts") ? "typescript" : "javascript";
      count[kind] += 1;
      write(kind, page, snippet);
    }
  }
  for (const [kind, options] of [
    ["typescript", STRICT],
    ["javascript", { allowJs: true, checkJs: true, strict: false }],
  ]) {
    const config = { compilerOptions: { ...SHARED, ...options }, include: ["."] };
    writeFileSync(join(FOLDER, kind, "tsconfig.json"), JSON.stringify(config));
    await run(process.execPath, [tscProgram(), "-p", join(FOLDER, kind)]);
  }
  say(`  ${count.typescript} pieces of TypeScript, ${count.javascript} of JavaScript`);
}

/** A file whose name says page and line, and which has what it needs before it. */
function write(kind, page, { line, language, code, before }) {
  const folder = join(FOLDER, kind);
  mkdirSync(folder, { recursive: true });
  const name = `${relative(ROOT, page).replaceAll(/[\\/]/g, "-").replace(/\.md$/, "")}-${line}`;
  const body = language === "html" ? moduleIn(code) : code;
  if (kind === "javascript" && before) {
    throw new Error(`${relative(ROOT, page)}:${line}: only TypeScript can need what is not shown.`);
  }
  const ending = kind === "typescript" ? language : "js";
  writeFileSync(join(folder, `${name}.${ending}`), `${before}${body}`);
}

if (process.argv[1] === import.meta.filename) main(checkSnippets);
