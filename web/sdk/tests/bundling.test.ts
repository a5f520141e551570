// Bundlers leave out modules that package.json says have no side effects.
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { build, type Rolldown } from "vite";
import { afterAll, describe, expect, it } from "vitest";

// Inside the package, so that `dynaskin` resolves to it.
const folder = mkdtempSync(join(fileURLToPath(new URL(".", import.meta.url)), ".bundling-"));
afterAll(() => rmSync(folder, { recursive: true, force: true }));

/** The JavaScript that Vite makes of `program`. */
async function bundled(name: string, program: string): Promise<string> {
  const input = join(folder, `${name}.js`);
  writeFileSync(input, program);
  const output = (await build({
    root: folder,
    configFile: false,
    logLevel: "silent",
    build: { write: false, minify: false, rolldownOptions: { input } },
  })) as Rolldown.RolldownOutput;
  return output.output.map((file) => (file.type === "chunk" ? file.code : "")).join("\n");
}

describe("a bundler", () => {
  it("keeps the worker's side, which is imported for what it does", async () => {
    const code = await bundled("worker", 'import "dynaskin/worker/thread";');
    expect(code).toContain('addEventListener("message"');
  });

  it("leaves out what a page imports and does not use", async () => {
    const code = await bundled("page", 'import { load } from "dynaskin";\nconsole.log(1);');
    expect(code).toContain("console.log(1)");
    expect(code).not.toContain("WebAssembly");
  });
});
