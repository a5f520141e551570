// The npm packages of the models, made from `models/`: `dynaskin-female` and `dynaskin-male`.
import { copyFileSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { MODELS, ROOT, SDK } from "./paths.mjs";

/** Where packages and tarballs go. */
export const PACKAGES = join(ROOT, "artifacts", "packages");

const NAMES = ["female", "male"];

/** The files that `load` reads, by their names in `ModelFiles`. */
const FILES = {
  bundle: "bundle.json",
  body: "body.glb",
  predictor: "predictor.onnx",
  decoder: "decoder.onnx",
};
const CARD = "MODEL_CARD.md";

/**
 * Writes the packages' folders.
 *
 * @returns {string[]} the folders
 */
export function writeModelPackages() {
  return NAMES.map((name) => {
    const folder = join(PACKAGES, `dynaskin-${name}`);
    rmSync(folder, { recursive: true, force: true });
    mkdirSync(folder, { recursive: true });
    for (const file of [...Object.values(FILES), CARD]) {
      copyFileSync(join(MODELS, name, file), join(folder, file));
    }
    for (const file of ["LICENSE-MIT", "LICENSE-APACHE"]) {
      copyFileSync(join(ROOT, file), join(folder, file));
    }
    for (const [file, text] of Object.entries(textsOf(name))) {
      writeFileSync(join(folder, file), text);
    }
    return folder;
  });
}

/** The files that are made. */
function textsOf(name) {
  return {
    "package.json": `${JSON.stringify(manifestOf(name), null, 2)}\n`,
    "index.js": addresses(name),
    "index.d.ts": declarations(name, "URL", "Addresses of the model's files beside this module."),
    "inline.js": bytes(name),
    "inline.d.ts": declarations(name, "Uint8Array<ArrayBuffer>", "The bytes of the model's files."),
    "README.md": readme(name),
  };
}

function manifestOf(name) {
  const { version, license, engines } = JSON.parse(readFileSync(join(SDK, "package.json"), "utf8"));
  const entry = (file) => ({ types: `./${file}.d.ts`, default: `./${file}.js` });
  return {
    name: `dynaskin-${name}`,
    version,
    description: `The ${name} body of dynaskin and the networks that move its soft tissue.`,
    license,
    type: "module",
    sideEffects: false,
    keywords: ["avatar", "soft-tissue", "dynaskin"],
    engines,
    files: [...Object.values(FILES), CARD, "*.js", "*.d.ts", "LICENSE-*"],
    exports: {
      ".": entry("index"),
      "./inline": entry("inline"),
      ...Object.fromEntries(Object.values(FILES).map((file) => [`./${file}`, `./${file}`])),
    },
  };
}

/** In one piece each, because bundlers look for exactly this. */
function addresses(name) {
  const lines = Object.entries(FILES).map(
    ([key, file]) => `  ${key}: new URL("./${file}", import.meta.url),`,
  );
  return `export const ${name} = {\n${lines.join("\n")}\n};\n`;
}

/** Decoded when they are asked for, so that who needs the body alone does not decode the networks. */
function bytes(name) {
  const lines = Object.entries(FILES).map(([key, file]) => {
    const base64 = readFileSync(join(MODELS, name, file)).toString("base64");
    return `  get ${key}() {\n    return decoded("${base64}");\n  },`;
  });
  return (
    "const decoded = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));\n\n" +
    `export const ${name} = {\n${lines.join("\n")}\n};\n`
  );
}

function declarations(name, type, what) {
  const lines = Object.keys(FILES).map((key) => `  readonly ${key}: ${type};`);
  return (
    `/** ${what} Give it to \`load({ model: ${name} })\` of dynaskin. */\n` +
    `export declare const ${name}: {\n${lines.join("\n")}\n};\n`
  );
}

function readme(name) {
  return `# dynaskin-${name}

The ${name} body of the package dynaskin, an adult in sportswear, and the networks that
move its soft tissue.

\`\`\`js
import { load } from "dynaskin";
import { ${name} } from "dynaskin-${name}";

const model = await load({ model: ${name} });
\`\`\`

\`${name}.body\` is the address of the body as GLB, for the loader of an engine. \`dynaskin-${name}/inline\` has the same
files inside the JavaScript, for bundlers that copy no files (esbuild) and for single-file pages; it is a third larger.

The model card, ${CARD}, says what the networks learned from and how well they do. MIT or Apache-2.0, at your option.
The body is built from CC0 data of the MakeHuman community.
`;
}
