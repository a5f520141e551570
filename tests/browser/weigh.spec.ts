// The step of `npm run build` and `npm test` that holds the built demo against its budget.
import { spawnSync } from "node:child_process";
import { mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "@playwright/test";
import { ROOT } from "./places.js";

const DIST = join(ROOT, "test-results", "weigh");
const BUDGET = JSON.parse(readFileSync(join(ROOT, "web", "demo", "budget.json"), "utf8"));

/** Weighs the folder as the build does. */
function weigh(budget: Record<string, number>): { status: number | null; said: string } {
  const file = join(ROOT, "test-results", "weigh-budget.json");
  writeFileSync(file, JSON.stringify(budget));
  const { status, stdout, stderr } = spawnSync(
    process.execPath,
    [join(ROOT, "scripts", "weigh.mjs"), DIST, file],
    { encoding: "utf8" },
  );
  return { status, said: stdout + stderr };
}

test("a build with a part over its budget fails and names the part", () => {
  rmSync(DIST, { recursive: true, force: true });
  mkdirSync(join(DIST, "assets"), { recursive: true });
  writeFileSync(join(DIST, "index.html"), "<!doctype html><title>small</title>");
  // Digits of a number that does not repeat: brotli halves them at most.
  const noise = Array.from({ length: 4_000 }, (_, idx) => `${Math.sin(idx)}`.slice(4)).join("");
  writeFileSync(join(DIST, "assets", "index.js"), noise);

  const light = weigh(BUDGET);
  expect(light.said).toContain("core wasm");
  expect(light.status, light.said).toBe(0);

  const heavy = weigh({ ...BUDGET, js: 10 });
  expect(heavy.status).not.toBe(0);
  expect(heavy.said).toMatch(/over its budget .*: js has \d+ kB, the budget is 10 kB\./);
});
