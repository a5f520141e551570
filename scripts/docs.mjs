// Whether the paths and links that the Markdown pages name lead somewhere; a step of npm test.
import { brokenIn, pagesOf } from "./lib/doc-links.mjs";
import { ROOT } from "./lib/paths.mjs";
import { main, run, say } from "./lib/run.mjs";

/** Throws where a page names what is not there. */
export async function checkDocs() {
  await run(process.execPath, ["--test", "scripts/lib/doc-links.test.mjs"], {
    cwd: ROOT,
    quiet: true,
  });
  const pages = pagesOf(ROOT);
  const problems = (await Promise.all(pages.map((page) => brokenIn(ROOT, page)))).flat();
  for (const problem of problems) say(`  ${problem}`);
  if (problems.length > 0) throw new Error(`${problems.length} paths or links lead nowhere.`);
  say(`  ${pages.length} pages`);
}

if (process.argv[1] === import.meta.filename) main(checkDocs);
