// What the published wasm files weigh with brotli, held against web/wasm-sizes.json; a part of npm test.
// `npm run sizes` prints it, `npm run sizes -- --write` records it.
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { join, relative } from "node:path";
import { parseArgs } from "node:util";
import { ROOT } from "./lib/paths.mjs";
import { main, say } from "./lib/run.mjs";
import { overRecorded } from "./lib/sizes.mjs";
import { isPublished, PUBLISHED, WASM_FILES, WASM_OUT, wasmSizes } from "./wasm.mjs";

const RECORD = join(ROOT, "web", "wasm-sizes.json");

/** Bytes of each file with brotli, by name. */
function measure() {
  const size = ({ name }) => wasmSizes(readFileSync(join(WASM_OUT, `${name}_bg.wasm`))).brotli;
  return Object.fromEntries(WASM_FILES.map((file) => [file.name, size(file)]));
}

/** Throws where a file weighs over two hundredths more than is recorded, or where none is. */
export function checkWasmSizes() {
  const recorded = existsSync(RECORD) ? JSON.parse(readFileSync(RECORD, "utf8")) : {};
  const sizes = measure();
  for (const [name, bytes] of Object.entries(sizes)) {
    const share = recorded[name] ? `, ${((100 * bytes) / recorded[name]).toFixed(1)} %` : "";
    say(`  ${name}_bg.wasm: ${bytes} bytes with brotli${share}`);
  }
  const problems = overRecorded(sizes, recorded);
  if (problems.length === 0) return;
  throw new Error(
    `${problems.join("; ")}. Make it smaller, or record the size with \`npm run sizes -- --write\` ` +
      `(${relative(ROOT, RECORD)}) and say why in the change.`,
  );
}

if (process.argv[1] === import.meta.filename) {
  main(async () => {
    const { values } = parseArgs({ options: { write: { type: "boolean" } } });
    if (!isPublished()) {
      throw new Error(`The wasm files are not of the profile ${PUBLISHED}: run \`npm run build\`.`);
    }
    if (!values.write) return checkWasmSizes();
    writeFileSync(RECORD, `${JSON.stringify(measure(), null, 2)}\n`);
    say(`Written to ${relative(ROOT, RECORD)}.`);
  });
}
