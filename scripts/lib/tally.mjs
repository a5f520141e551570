// Adds up passed, failed and skipped over runners that each report in their own way.
import { existsSync, readFileSync } from "node:fs";

/** A sum of test results, with the names of what was skipped. */
export class Tally {
  passed = 0;
  failed = 0;
  skipped = 0;
  /** @type {string[]} */
  skippedNames = [];

  add({ passed = 0, failed = 0, skipped = 0, skippedNames = [] }) {
    this.passed += passed;
    this.failed += failed;
    this.skipped += skipped;
    this.skippedNames.push(...skippedNames);
  }

  get line() {
    return `${this.passed} passed, ${this.failed} failed, ${this.skipped} skipped`;
  }
}

/**
 * Reads `cargo test -- --show-output` or `cargo nextest run` line by line. A Rust test that lacks
 * its input prints `skipped: NAME needs ...` and returns, which both count as passed; here it counts
 * as skipped.
 */
export class CargoTally extends Tally {
  read(line) {
    const result = /^test result: \w+\. (\d+) passed; (\d+) failed; (\d+) ignored/.exec(line);
    if (result) {
      this.add({ passed: +result[1], failed: +result[2], skipped: +result[3] });
    }
    const summary =
      /^ *Summary \[.*\] (?:\d+\/)?(\d+) tests? run: (\d+) passed.*?, (\d+) skipped$/.exec(line);
    if (summary) {
      const [run, passed, ignored] = summary.slice(1).map(Number);
      // Failed, timed out or not started at all.
      this.add({ passed, failed: run - passed, skipped: ignored });
    }
    // On one thread and uncaptured, as under nextest, the test's name stands before it.
    const skip = /^(?:test \S+ \.\.\. )?skipped: (.+)$/.exec(line.trim());
    if (skip) this.add({ passed: -1, skipped: 1, skippedNames: [skip[1]] });
  }
}

/** vitest's `--reporter=json` file. */
export function vitestResults(path) {
  const report = readReport(path);
  const tests = report.testResults.flatMap((file) => file.assertionResults);
  const skipped = tests.filter((test) => ["skipped", "pending", "todo"].includes(test.status));
  const failed = tests.filter((test) => test.status === "failed").length;
  // A file that cannot even be imported has no tests, only a status.
  const broken = report.testResults.filter(
    (file) => file.status === "failed" && file.assertionResults.length === 0,
  ).length;
  return {
    passed: tests.filter((test) => test.status === "passed").length,
    failed: failed + broken,
    skipped: skipped.length,
    skippedNames: skipped.map((test) => test.fullName),
  };
}

/** Playwright's JSON reporter file. */
export function playwrightResults(path) {
  const report = readReport(path);
  const names = [];
  const visit = (suite) => {
    for (const spec of suite.specs ?? []) {
      for (const test of spec.tests) {
        if (test.status !== "skipped") continue;
        const reason = test.annotations.find((note) => note.type === "skip")?.description;
        names.push(reason ? `${spec.title} (${reason})` : spec.title);
      }
    }
    for (const inner of suite.suites ?? []) visit(inner);
  };
  for (const suite of report.suites) visit(suite);
  const { expected, unexpected, flaky, skipped } = report.stats;
  // A file that fails to load appears only among the errors.
  const broken = unexpected === 0 ? report.errors.length : 0;
  return {
    passed: expected,
    failed: unexpected + flaky + broken,
    skipped,
    skippedNames: names,
  };
}

function readReport(path) {
  if (!existsSync(path)) throw new Error(`The test runner wrote no report at ${path}.`);
  return JSON.parse(readFileSync(path, "utf8"));
}
