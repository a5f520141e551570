// npm run notices: writes web/sdk/THIRD_PARTY_NOTICES.txt and web/sdk/sbom.cdx.json, which ship with the
// package and the demo. npm test checks that they are of the crates that are compiled in.
import { readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import * as CDX from "@cyclonedx/cyclonedx-library";
import { ROOT, SDK } from "./lib/paths.mjs";
import { main, run, say, step } from "./lib/run.mjs";
import { checkNotices, lockedHashes, NOTICES, SBOM, shippedCrates } from "./lib/shipped-crates.mjs";
import { ensureNodePackages, ensureRust } from "./toolchain.mjs";

/** Files of a crate that say under what licence it is. */
const LICENCE_FILE = /^(licen[cs]e|copying|copyright|notice|unlicense)/i;

/** Of several licences to choose from, the text of the first of these is given. */
const PREFERRED = [/mit/i, /apache/i, /zlib/i];

/** Folder and authors of each crate, by `name version`. */
async function sources() {
  const { output } = await run("cargo", ["metadata", "--locked", "--format-version", "1"], {
    quiet: true,
  });
  const { packages } = JSON.parse(output);
  return new Map(
    packages.map(({ name, version, manifest_path: path, authors }) => [
      `${name} ${version}`,
      { folder: dirname(path), authors },
    ]),
  );
}

/** The texts that one crate gives; notices always, of licences to choose from one. */
function textsOf(folder, license) {
  const names = readdirSync(folder).filter((name) => LICENCE_FILE.test(name));
  const notices = names.filter((name) => /^notice/i.test(name));
  let texts = names.filter((name) => !/^notice/i.test(name));
  if (/ OR |\//.test(license)) {
    const chosen = PREFERRED.map((wanted) => texts.find((name) => wanted.test(name)));
    const first = chosen.find((name) => name !== undefined);
    if (first) texts = [first];
  }
  return [...texts, ...notices]
    .map((name) => join(folder, name))
    .filter((path) => statSync(path).isFile())
    .map((path) => readFileSync(path, "utf8").replaceAll("\r\n", "\n").trim());
}

async function writeNotices() {
  const crates = await shippedCrates();
  const sourceOf = await sources();
  // The same text is given once, however its lines are broken.
  const sections = new Map();
  for (const { name, version, license } of crates) {
    const crate = `${name} ${version}`;
    const source = sourceOf.get(crate);
    if (!source) throw new Error(`cargo metadata does not know ${crate}.`);
    const { folder, authors } = source;
    let texts = textsOf(folder, license);
    if (texts.length === 0) texts = [standardText(crate, license, authors)];
    for (const text of texts) {
      const key = text.replace(/\s+/g, " ");
      const section = sections.get(key) ?? { text, of: [] };
      section.of.push(crate);
      sections.set(key, section);
    }
  }
  const rule = "-".repeat(80);
  const text = [
    "The WebAssembly files of dynaskin contain code of the Rust crates below, under their licences, of\n" +
      "which one is chosen where there are several. Written by `npm run notices`.",
    crates.map(({ name, version, license }) => `  ${name} ${version}  ${license}`).join("\n"),
    ...[...sections.values()].map(({ of, text }) => `${rule}\n${of.join(", ")}\n\n${text}`),
  ].join("\n\n\n");
  writeFileSync(NOTICES, `${text}\n`);
  say(`  ${crates.length} crates, ${sections.size} texts`);
}

/** For a crate that comes without a text: that of the licence it names, if we have it ourselves. */
function standardText(crate, license, authors) {
  const own = (name) => readFileSync(join(ROOT, name), "utf8").trim();
  if (/Apache-2\.0/.test(license)) return own("LICENSE-APACHE");
  if (/MIT/.test(license)) {
    const holders = authors.length > 0 ? authors.join(", ") : `the authors of ${crate}`;
    return own("LICENSE-MIT").replace(/^Copyright .*$/m, `Copyright (c) ${holders}`);
  }
  throw new Error(`${crate} (${license}) comes without the text of its licence.`);
}

/** No date and no serial number: the same crates give the same file. */
async function writeSbom() {
  const { name, version, license } = JSON.parse(readFileSync(join(SDK, "package.json"), "utf8"));
  const { Application, Library } = CDX.Enums.ComponentType;
  const of = (text) => new CDX.Models.LicenseExpression(text.replaceAll("/", " OR "));
  const own = new CDX.Models.Component(Library ?? Application, name, {
    version,
    bomRef: `${name}@${version}`,
    purl: `pkg:npm/${name}@${version}`,
  });
  own.licenses.add(of(license));
  const bom = new CDX.Models.Bom({ metadata: new CDX.Models.Metadata({ component: own }) });
  const hashes = lockedHashes();
  for (const crate of await shippedCrates()) {
    const purl = `pkg:cargo/${crate.name}@${crate.version}`;
    const component = new CDX.Models.Component(Library, crate.name, {
      version: crate.version,
      bomRef: purl,
      purl,
    });
    component.licenses.add(of(crate.license));
    const hash = hashes.get(`${crate.name} ${crate.version}`);
    if (hash) component.hashes.set(CDX.Enums.HashAlgorithm["SHA-256"], hash);
    own.dependencies.add(component.bomRef);
    bom.components.add(component);
  }
  const spec = CDX.Spec.Spec1dot6;
  const serializer = new CDX.Serialize.JsonSerializer(
    new CDX.Serialize.JSON.Normalize.Factory(spec),
  );
  const text = serializer.serialize(bom, { sortLists: true, space: 2 });
  writeFileSync(SBOM, `${text}\n`);
}

main(async () => {
  await step("Rust", ensureRust);
  await step("npm packages", ensureNodePackages);
  await step("Notices", writeNotices);
  await step("Bill of materials", writeSbom);
  await step("Check", checkNotices);
});
