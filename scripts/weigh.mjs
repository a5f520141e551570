// What the built demo weighs, by part, held against web/demo/budget.json; a step of npm run build and
// npm test. `node scripts/weigh.mjs DIST BUDGET.json` weighs another build against another budget.
import { readFileSync } from "node:fs";
import { join, relative } from "node:path";
import { DEMO, ROOT } from "./lib/paths.mjs";
import { main, say } from "./lib/run.mjs";
import { measureBuild, overBudget, sizeTable } from "./lib/sizes.mjs";
import { isPublished } from "./wasm.mjs";

/**
 * Prints what a built page weighs; throws where that is more than its budget allows.
 *
 * @param {string} dist the built page's folder
 * @param {string} budgetFile kilobytes with brotli, by part
 * @param {boolean} mustFit whether more is a failure
 */
export async function weighDemo(
  dist = join(DEMO, "dist"),
  budgetFile = join(DEMO, "budget.json"),
  mustFit = isPublished(),
) {
  const budget = JSON.parse(readFileSync(budgetFile, "utf8"));
  const sizes = await measureBuild(dist);
  for (const line of sizeTable(sizes, budget)) say(`  ${line}`);
  const problems = overBudget(sizes, budget);
  if (problems.length === 0) return;
  const sentence = `The page is over its budget (${relative(ROOT, budgetFile)}): ${problems.join("; ")}.`;
  if (mustFit) throw new Error(sentence);
  say(`  ${sentence} That is no failure here, where WebAssembly is built without optimisation.`);
}

if (process.argv[1] === import.meta.filename)
  main(() =>
    weighDemo(process.argv[2], process.argv[3], process.argv[2] !== undefined || isPublished()),
  );
