// docs/hosting.md: its code and headers on small servers, and what errors say where a header lacks.
import { mkdirSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { expect, type Page, test } from "@playwright/test";
import { build, type Rolldown } from "vite";
import { PACKAGES, writeModelPackages } from "../../scripts/lib/model-packages.mjs";
import { snippetsOf } from "../../scripts/lib/snippets.mjs";
import { type Host, type HostOptions, startHost } from "./hosts.js";
import { ROOT } from "./places.js";

const GUIDE = join(ROOT, "docs", "hosting.md");
const ANYBODY = { "Access-Control-Allow-Origin": "*" };
const ISOLATING = { "Cross-Origin-Embedder-Policy": "require-corp" };

/** Put after the code of the guide. */
const TELL = 'document.title = "stature " + avatar.figure.statureM;\n';

let hosts: Host[] = [];
test.afterEach(() => {
  for (const host of hosts) host.close();
  hosts = [];
});

async function host(options: HostOptions): Promise<string> {
  const started = await startHost(options);
  hosts.push(started);
  return started.origin;
}

/** A page that makes a worker and writes into its title how that went. */
function workerPage(options = "{}"): Record<string, string> {
  return {
    "/page": '<!doctype html><title>waiting</title><script type="module" src="/page.js"></script>',
    "/page.js": `import { createWorkerModel } from "/web/sdk/dist/worker/index.js";
      createWorkerModel({ model: "/models/female/", ...${options} }).then(
        (made) => { document.title = "made " + made.name; },
        (error) => { document.title = error.code + ": " + error.message; },
      );`,
  };
}

/** What the page's title says in the end. */
async function outcome(page: Page, address: string): Promise<string> {
  await page.goto(address);
  await page.waitForFunction(() => document.title !== "waiting", null, { timeout: 120_000 });
  return page.title();
}

test("a page takes package and model from another origin, and starts its worker", async ({
  page,
}) => {
  const cdn = await host({ headers: () => ANYBODY });
  const [snippet] = (await snippetsOf(GUIDE)).filter(({ language }) => language === "html");
  const html = (snippet?.code ?? "")
    .replaceAll("https://cdn.example/dynaskin-female/", `${cdn}/models/female/`)
    .replaceAll("https://cdn.example/dynaskin/", `${cdn}/web/sdk/`)
    .replace("From a CDN", "waiting")
    .replace(/<\/script>\s*$/, `${TELL}</script>`);
  const own = await host({ pages: { "/page": html } });
  expect(await outcome(page, `${own}/page`)).toMatch(/^stature 1\.(699|70)/);
});

test("a worker's script of another origin is refused with what to do", async ({ page }) => {
  const cdn = await host({ headers: () => ANYBODY });
  const script = JSON.stringify(`${cdn}/web/sdk/dist/worker/thread.js`);
  for (const options of [
    `{ createWorker: () => new Worker(${script}, { type: "module" }) }`,
    `{ workerScript: ${script} }`,
  ]) {
    const own = await host({ pages: workerPage(options) });
    expect(await outcome(page, `${own}/page`)).toMatch(/^worker: .*another origin.*createWorker/);
  }
});

test("a page from the disk needs nothing that is fetched", async ({ page }) => {
  writeModelPackages();
  const folder = join(ROOT, "test-results", "from-disk");
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(join(folder, "node_modules"), { recursive: true });
  symlinkSync(join(ROOT, "web", "sdk"), join(folder, "node_modules", "dynaskin"));
  symlinkSync(join(PACKAGES, "dynaskin-female"), join(folder, "node_modules", "dynaskin-female"));
  const [snippet] = (await snippetsOf(GUIDE)).filter(({ language }) => language === "js");
  const input = join(folder, "main.js");
  writeFileSync(input, `${snippet?.code}${TELL}`);
  const made = (await build({
    root: folder,
    configFile: false,
    logLevel: "error",
    build: { write: false, target: "es2022", rolldownOptions: { input } },
  })) as Rolldown.RolldownOutput;
  const [script] = made.output;
  const html = join(folder, "page.html");
  // A script must not end the element that holds it.
  const code = script.code.replaceAll("</script", "<\\/script");
  const head = '<!doctype html><meta charset="utf-8"><title>waiting</title>';
  writeFileSync(html, `${head}<script type="module">${code}</script>`);
  expect(await outcome(page, pathToFileURL(html).href)).toMatch(/^stature 1\.(699|70)/);
});

test("the policy of the guide is enough for a worker; without worker-src the error says so", async ({
  page,
}) => {
  const [, policy = ""] = /^Content-Security-Policy: (.*)$/m.exec(await textOfGuide()) ?? [];
  expect(policy).toContain("worker-src");
  const withPolicy = (text: string) =>
    host({
      pages: workerPage(),
      headers: (path) => (path === "/page" ? { "Content-Security-Policy": text } : {}),
    });
  expect(await outcome(page, `${await withPolicy(policy)}/page`)).toBe("made female");
  const forbidden = await withPolicy(policy.replace("worker-src 'self'", "worker-src 'none'"));
  expect(await outcome(page, `${forbidden}/page`)).toMatch(
    /^worker: .*security policy forbids it .*thread\.js.*worker-src/,
  );
});

test("an isolated page starts a worker whose script has the header, and else says so", async ({
  page,
}) => {
  const everywhere = await host({ pages: workerPage(), headers: () => ISOLATING });
  expect(await outcome(page, `${everywhere}/page`)).toBe("made female");
  const alone = await host({
    pages: workerPage(),
    headers: (path) => (path === "/page" ? ISOLATING : {}),
  });
  expect(await outcome(page, `${alone}/page`)).toMatch(
    /^worker: .*Cross-Origin-Embedder-Policy.*worker's script/,
  );
});

test("a worker's script that is not there is told from what is refused", async ({ page }) => {
  const named = await host({ pages: workerPage('{ workerScript: "/nowhere/thread.js" }') });
  expect(await outcome(page, `${named}/page`)).toMatch(/^worker: .*nowhere.*not there.*404/);
  const unnamed = await host({ pages: workerPage(), missing: /worker\/thread\.js$/ });
  expect(await outcome(page, `${unnamed}/page`)).toMatch(/^worker: .*did not say why/);
});

async function textOfGuide(): Promise<string> {
  const { readFile } = await import("node:fs/promises");
  return readFile(GUIDE, "utf8");
}
