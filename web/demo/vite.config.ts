import { existsSync, readdirSync } from "node:fs";
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

/** `virtual:methods`: what {@link findMethods} finds when the page is built. */
function methodList(): Plugin {
  const name = "virtual:methods";
  return {
    name: "method-list",
    resolveId: (id) => (id === name ? `\0${name}` : null),
    load: (id) => (id === `\0${name}` ? `export default ${JSON.stringify(findMethods())};` : null),
  };
}

export default defineConfig({
  // Relative, so that the built page works from any folder of any web server.
  base: "./",
  // The models as they lie in the repository: female/bundle.json, male/bundle.json, ...
  publicDir: "../../models",
  plugins: [methodList()],
  server: { port: 5180, open: false, headers: ISOLATION },
  preview: { headers: ISOLATION },
  build: { target: "es2022", chunkSizeWarningLimit: 1000 },
});
