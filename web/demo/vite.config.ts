import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { defineConfig, type Plugin } from "vite";

// An isolated page's performance.now() steps by 5 µs instead of 100 µs. Nothing else needs it.
const ISOLATION = {
  "Cross-Origin-Opener-Policy": "same-origin",
  "Cross-Origin-Embedder-Policy": "require-corp",
};

const MODELS = join(import.meta.dirname, "..", "..", "models");

const namesIn = (folder: string) => (existsSync(folder) ? readdirSync(folder).toSorted() : []);

/** Names of the methods whose bundles lie under `models/BODY/methods`, by body. */
function findMethods(): Record<string, string[]> {
  const methodsOf = (body: string) =>
    namesIn(join(MODELS, body, "methods")).filter((name) =>
      existsSync(join(MODELS, body, "methods", name, "bundle.json")),
    );
  return Object.fromEntries(namesIn(MODELS).map((body) => [body, methodsOf(body)]));
}

/** What people call each body's shape by: its `traits.json`. */
function readTraits(): Record<string, unknown> {
  const read = (body: string) =>
    JSON.parse(readFileSync(join(MODELS, body, "traits.json"), "utf8")) as unknown;
  return Object.fromEntries(["female", "male"].map((body) => [body, read(body)]));
}

/** A module whose default export is made when the page is built. */
function virtualModule(name: string, make: () => unknown): Plugin {
  const id = `\0${name}`;
  return {
    name,
    resolveId: (wanted) => (wanted === name ? id : null),
    load: (wanted) => (wanted === id ? `export default ${JSON.stringify(make())};` : null),
  };
}

export default defineConfig({
  // Relative, so that the built page works from any folder of any web server.
  base: "./",
  // The models as they lie in the repository: female/bundle.json, male/bundle.json, ...
  publicDir: "../../models",
  plugins: [
    virtualModule("virtual:methods", findMethods),
    virtualModule("virtual:traits", readTraits),
  ],
  server: { port: 5180, open: false, headers: ISOLATION },
  preview: { headers: ISOLATION },
  build: { target: "es2022", chunkSizeWarningLimit: 1000 },
});
