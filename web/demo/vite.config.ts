import { existsSync, readdirSync, readFileSync, statSync } from "node:fs";
import { join, relative } from "node:path";
import { defineConfig, normalizePath, type Plugin } from "vite";

// An isolated page's performance.now() steps by 5 µs instead of 100 µs. Nothing else needs it.
const ISOLATION = {
  "Cross-Origin-Opener-Policy": "same-origin",
  "Cross-Origin-Embedder-Policy": "require-corp",
};

const MODELS = join(import.meta.dirname, "..", "..", "models");
const CLIPS = join(import.meta.dirname, "clips");
const SDK = join(import.meta.dirname, "..", "sdk", "dist");
const WASM = join(SDK, "wasm");
/** The core with the code of the compared methods, which the package's is without. */
const GUESTS = join(import.meta.dirname, "wasm", "core_bg.wasm");

/** Where the page will be, with a slash at its end: links to it show its picture only from a full address. */
const SITE = process.env.DYNASKIN_SITE ?? "./";

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

/**
 * Bytes of the files that the page downloads after itself: `core`, `slim`, `renderer`, models by their path under
 * `models`, clips below `clips/`. Where a server packs, a bar can know its end only from these.
 */
function measureFiles(): Record<string, number> {
  const filesIn = (folder: string, pattern: RegExp) =>
    existsSync(folder)
      ? readdirSync(folder, { recursive: true, encoding: "utf8" })
          .map((name) => name.replaceAll("\\", "/"))
          .filter((name) => pattern.test(name))
          .map((name): [string, string] => [name, join(folder, name)])
      : [];
  const files = [
    ["core", GUESTS],
    ["slim", join(WASM, "slim_bg.wasm")],
    ["renderer", join(WASM, "renderer_bg.wasm")],
    ...filesIn(MODELS, /(\.onnx|\.lowered|body\.glb|bundle\.json)$/),
    ...filesIn(CLIPS, /\.safetensors$/).map(([name, path]) => [`clips/${name}`, path] as const),
  ] as const;
  return Object.fromEntries(files.map(([name, path]) => [name, statSync(path).size]));
}

/** The table of README's results as HTML: one place to keep numbers. */
function resultsTable(): string {
  const readme = readFileSync(join(import.meta.dirname, "..", "..", "README.md"), "utf8");
  const rows = readme
    .split("\n")
    .filter((line) => line.startsWith("|") && !/^\|[-:| ]+\|$/.test(line))
    .map((line) => line.slice(1, -1).split("|"));
  if (rows.length < 2) throw new Error("README.md has no table of results.");
  const escaped = (text: string) =>
    text.trim().replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll("**", "");
  const cells = (row: string[], tags: [first: string, other: string]) =>
    row
      .map((cell, idx) => {
        const tag = tags[idx === 0 ? 0 : 1];
        return `<${tag}>${escaped(cell)}</${tag.split(" ")[0]}>`;
      })
      .join("");
  const head = cells(rows[0] ?? [], ["td", 'th scope="col"']);
  const body = rows
    .slice(1)
    .map((row) => `<tr>${cells(row, ['th scope="row"', "td"])}</tr>`)
    .join("\n");
  const table = `<table class="results"><thead><tr>${head}</tr></thead><tbody>${body}</tbody></table>`;
  return `<div class="results-holder" tabindex="0" role="region" aria-label="Table of results">${table}</div>`;
}

/** Fills in what the page takes from other files. */
function filledPage(): Plugin {
  return {
    name: "filled-page",
    transformIndexHtml(html) {
      const { version } = JSON.parse(readFileSync(join(SDK, "..", "package.json"), "utf8")) as {
        version: string;
      };
      return html
        .replace("<!-- results -->", resultsTable())
        .replace("%VERSION%", version)
        .replaceAll("%SITE%", SITE);
    },
  };
}

/** Whether an address asks for methods whose networks another core runs: that is loaded by the script. */
const ASKS_FOR_METHODS = "/[?&](left|right|third|fourth)=(?!linear|dynaskin|truth)/";

/**
 * Asks for everything that the page begins with as soon as its HTML is there: the script that would ask comes later.
 * What is seen first has the line first: style, script, poster and the baked loop of the story; all else is of low
 * priority, in the order in which it takes long to start. Nothing waits for anything: between an answer and the next
 * question the line would be idle. Which files those are, the address says.
 */
function preloads(): Plugin {
  return {
    name: "preloads",
    apply: "build",
    transformIndexHtml: {
      order: "post",
      handler(_html, { bundle, filename }) {
        // The page for a visitor's own avatar loads nothing before there is one.
        if (!filename.endsWith("index.html")) return [];
        const files = Object.keys(bundle ?? {});
        const named = (pattern: RegExp) => {
          const name = files.find((file) => pattern.test(file));
          if (!name) throw new Error(`The page has no file like ${pattern}.`);
          return JSON.stringify(`./${name}`);
        };
        /* biome-ignore-start lint/suspicious/noTemplateCurlyInString: the page fills it in. */
        const children = [
          "{ const sex = /[?&]sex=male(&|$)/.test(location.search) ? 'male' : 'female';",
          "const ask = (href) => { const link = document.createElement('link');",
          "Object.assign(link, { rel: 'preload', as: 'fetch', crossOrigin: '', href });",
          "document.head.append(link); return link; };",
          "if (location.search === '') ask(matchMedia('(max-aspect-ratio: 78/100)').matches",
          `? ${named(/loop-tall[^/]*\.bin$/)} : ${named(/loop-wide[^/]*\.bin$/)}).fetchPriority = 'high';`,
          "const next = () => { ask(`./${sex}/body.glb`);",
          `if (!${ASKS_FOR_METHODS}.test(location.search)) ask(${named(/slim_bg[^/]*\.wasm$/)}); };`,
          `const renderer = ask(${named(/renderer_bg[^/]*\.wasm$/)});`,
          "renderer.onload = renderer.onerror = next;",
          "ask(`./${sex}/bundle.json`); }",
        ].join(" ");
        /* biome-ignore-end lint/suspicious/noTemplateCurlyInString: as above. */
        return [{ tag: "script", children, injectTo: "head-prepend" as const }];
      },
    },
  };
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

/** Puts the core with the compared methods in the place of the package's. Both have the same glue. */
function coreWithGuests(): Plugin {
  const importer = normalizePath(join(SDK, "core.js"));
  const own = '"./wasm/core_bg.wasm"';
  const guests = JSON.stringify(normalizePath(relative(SDK, GUESTS)));
  return {
    name: "core-with-guests",
    enforce: "pre",
    transform(code, id) {
      if (normalizePath(id.split("?")[0] ?? id) !== importer) return null;
      if (!code.includes(own)) throw new Error(`${importer} does not name ${own}.`);
      return code.replace(own, guests);
    },
  };
}

/** The licences of what is in the WebAssembly, and the picture that links to the page show, beside the page. */
function besidePage(): Plugin {
  const docs = join(import.meta.dirname, "..", "..", "docs");
  return {
    name: "beside-page",
    generateBundle() {
      const source = readFileSync(join(SDK, "..", "THIRD_PARTY_NOTICES.txt"), "utf8");
      this.emitFile({ type: "asset", fileName: "licences-wasm.txt", source });
      const picture = readFileSync(join(docs, "demo-first-view.jpg"));
      this.emitFile({ type: "asset", fileName: "poster.jpg", source: picture });
    },
  };
}

export default defineConfig({
  // Relative, so that the built page works from any folder of any web server.
  base: "./",
  // The models as they lie in the repository: female/bundle.json, male/bundle.json, ...
  publicDir: "../../models",
  plugins: [
    coreWithGuests(),
    virtualModule("virtual:methods", findMethods),
    virtualModule("virtual:traits", readTraits),
    virtualModule("virtual:sizes", measureFiles),
    besidePage(),
    filledPage(),
    preloads(),
  ],
  server: { port: 5180, open: false, headers: ISOLATION },
  preview: { headers: ISOLATION },
  // The thread that binds avatars takes the same core as the page.
  worker: { format: "es", plugins: () => [coreWithGuests()] },
  // `license` lists the npm packages in the page; the WebAssembly has its own list.
  build: {
    target: "es2022",
    chunkSizeWarningLimit: 1000,
    license: { fileName: "licences-npm.md" },
    rolldownOptions: {
      input: ["index.html", "own.html"].map((page) => join(import.meta.dirname, page)),
      output: {
        // What both pages take from the package is one file, whatever else takes parts of it later.
        codeSplitting: { groups: [{ name: "shared", test: /web.sdk.dist/, minShareCount: 2 }] },
        // What is asked for after the first view, by name.
        chunkFileNames: ({ isDynamicEntry }) =>
          `assets/${isDynamicEntry ? "later-" : ""}[name]-[hash].js`,
      },
    },
  },
});
