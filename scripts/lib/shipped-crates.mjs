// The crates whose code is in the WebAssembly files, and the list of them that ships with the package.
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { ROOT, SDK } from "./paths.mjs";
import { run } from "./run.mjs";

/** What the package says of others' code: texts of their licences, and a bill of materials (CycloneDX). */
export const NOTICES = join(SDK, "THIRD_PARTY_NOTICES.txt");
export const SBOM = join(SDK, "sbom.cdx.json");

/** The crates of the WebAssembly files, and the target they are compiled for. */
export const WASM_CRATES = ["dynaskin-wasm", "dynaskin-wasm-bind", "dynaskin-wasm-render"];
export const WASM_TARGET = "wasm32-unknown-unknown";

/**
 * Name, version and licence of every crate of others that is compiled in, sorted. Macros run while it is
 * compiled and are left out.
 *
 * @returns {Promise<{ name: string, version: string, license: string }[]>}
 */
export async function shippedCrates() {
  const packages = WASM_CRATES.flatMap((name) => ["-p", name]);
  const format = ["--prefix", "none", "--format", "{p}|{l}"];
  const features = ["--features", "dynaskin-wasm/guests"];
  const { output } = await run(
    "cargo",
    [
      "tree",
      "--locked",
      ...packages,
      ...features,
      "--target",
      WASM_TARGET,
      "-e",
      "normal,no-proc-macro",
      ...format,
    ],
    { quiet: true },
  );
  const found = new Map();
  for (const line of output.split("\n")) {
    const [, name, version, rest, license] =
      /^(\S+) v(\S+)((?: \([^)]*\))*)\|(.*?)(?: \(\*\))?$/.exec(line.trim()) ?? [];
    // Crates of this repository stand with their folder.
    if (name === undefined || rest !== "") continue;
    found.set(`${name} ${version}`, { name, version, license });
  }
  const order = (a, b) => (a < b ? -1 : 1);
  return [...found.values()].toSorted((a, b) =>
    order(`${a.name} ${a.version}`, `${b.name} ${b.version}`),
  );
}

/** The crates that the notices name, as `name version`. */
export function namedInNotices() {
  if (!existsSync(NOTICES)) return [];
  const list = readFileSync(NOTICES, "utf8").split("\n\n\n")[1] ?? "";
  return list.split("\n").flatMap((line) => /^ {2}(\S+ \S+) {2}/.exec(line)?.[1] ?? []);
}

/** The crates that the bill of materials names, as `name version`. */
export function namedInSbom() {
  if (!existsSync(SBOM)) return [];
  const { components } = JSON.parse(readFileSync(SBOM, "utf8"));
  return components.map(({ name, version }) => `${name} ${version}`).toSorted();
}

/** Throws where notices or bill of materials are of other crates than those that are compiled in. */
export async function checkNotices() {
  const shipped = (await shippedCrates()).map(({ name, version }) => `${name} ${version}`);
  for (const [what, named] of [
    ["THIRD_PARTY_NOTICES.txt", namedInNotices()],
    ["sbom.cdx.json", namedInSbom()],
  ]) {
    const missing = shipped.filter((crate) => !named.includes(crate));
    const gone = named.filter((crate) => !shipped.includes(crate));
    if (missing.length + gone.length === 0) continue;
    throw new Error(
      `web/sdk/${what} is not of what ships: missing are ${missing.join(", ") || "none"}, gone are ` +
        `${gone.join(", ") || "none"}. Run \`npm run notices\`.`,
    );
  }
}

/** The checksums of crates that Cargo.lock names: SHA-256 in hexadecimal, by `name version`. */
export function lockedHashes() {
  const lock = readFileSync(join(ROOT, "Cargo.lock"), "utf8");
  const entries = lock.matchAll(
    /name = "([^"]+)"\nversion = "([^"]+)"\nsource = [^\n]*\nchecksum = "([0-9a-f]{64})"/g,
  );
  return new Map([...entries].map(([, name, version, hash]) => [`${name} ${version}`, hash]));
}
