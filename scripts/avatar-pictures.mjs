// node scripts/avatar-pictures.mjs [FILE ...]: binds avatars, those of the demo and of ../shared/avatars, and
// draws each plain, with tissue (both from front and back) and by how far its vertices move, and one landing in six
// instants. Open them afterwards: a picture can be wrong in ways that no test sees.
import { existsSync, mkdirSync } from "node:fs";
import { basename, join, resolve } from "node:path";
import { ROOT } from "./lib/paths.mjs";
import { main, say, step } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { buildSdk } from "./sdk.mjs";
import { findChromium } from "./toolchain.mjs";

const OUT = join(ROOT, "test-results", "pictures");
const SHARED = join(process.env.DYNASKIN_SHARED ?? resolve(ROOT, "..", "shared"), "avatars");
const OWN = join(ROOT, "web", "demo", "avatars");
/** Avatars and the bodies that are bound to them. */
const AVATARS = [
  [join(OWN, "runner.vrm"), "female"],
  [join(OWN, "lifter.glb"), "male"],
  [join(SHARED, "valid-black-f-2-casual.glb"), "female"],
  [join(SHARED, "valid-hispanic-f-2-busi.glb"), "female"],
  [join(SHARED, "valid-white-m-2-casual.glb"), "male"],
  [join(SHARED, "mesh2motion-human-female.glb"), "female"],
  [join(SHARED, "vrm0-t-pose.vrm"), "female"],
  [join(SHARED, "vrm1-t-pose.vrm"), "female"],
];
const IMPORTS = {
  dynaskin: "/web/sdk/dist/index.js",
  "dynaskin/three": "/web/sdk/dist/three/index.js",
  three: "/node_modules/three/build/three.module.js",
  "three/addons/": "/node_modules/three/examples/jsm/",
};
const ARGUMENTS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--enable-unsafe-swiftshader",
];
const STYLE = `body { margin: 0; display: inline-block; background: #fff; font: 600 13px system-ui }
  figure { display: inline-block; margin: 3px; width: 240px; vertical-align: top } img { display: block; width: 240px } div { white-space: nowrap }
  figcaption { padding: 3px; height: 2.8em; white-space: normal; color: #1d2027 }`;

/** An empty page that finds three.js and the package by name. */
async function openPage(browser, url, files) {
  const page = await browser.newPage();
  page.on("pageerror", (error) => say(`  ${error.message}`));
  await page.route("**/avatars", (route) =>
    route.fulfill({
      contentType: "text/html",
      body: `<!doctype html><script type="importmap">${JSON.stringify({ imports: IMPORTS })}</script>`,
    }),
  );
  await page.route("**/avatar-files/*", (route) => {
    const at = Number(basename(new URL(route.request().url()).pathname));
    return route.fulfill({ path: files[at], contentType: "model/gltf-binary" });
  });
  await page.goto(`${url}/avatars`);
  return page;
}

/** Rows of pictures with their captions as one picture. */
async function sheet(browser, rows, name) {
  const page = await browser.newPage({ viewport: { width: 1600, height: 1000 } });
  const figure = ({ picture, caption }) =>
    `<figure><img src="${picture}"><figcaption>${caption}</figcaption></figure>`;
  const body = rows.map((row) => `<div>${row.map(figure).join("")}</div>`).join("");
  await page.setContent(`<style>${STYLE}</style>${body}`);
  const path = join(OUT, `${name}.png`);
  await page.locator("body").screenshot({ path });
  await page.close();
  say(`  ${path}`);
}

async function takeAll(browser, url, avatars) {
  const page = await openPage(
    browser,
    url,
    avatars.map(([file]) => file),
  );
  const taken = [];
  for (const [at, [file, body]] of avatars.entries()) {
    const found = await page.evaluate(
      async ([address, own]) => {
        const { takePictures } = await import(`${location.origin}/scripts/avatars/stage.js`);
        return takePictures(address, own);
      },
      [`/avatar-files/${at}`, body],
    );
    const { shareClose, moving, vertices } = found;
    say(
      `  ${basename(file)}: ${(100 * shareClose).toFixed(1)} % within 2 cm, ${moving} of ${vertices} vertices move, ` +
        `offsets to ${(1000 * found.largestM).toFixed(0)} mm`,
    );
    taken.push({ name: basename(file), ...found });
  }
  return taken;
}

main(async () => {
  const chosen = process.argv.slice(2);
  const isChosen = ([file]) => chosen.length === 0 || chosen.includes(basename(file));
  const avatars = AVATARS.filter(isChosen).filter(([file]) => {
    if (!existsSync(file)) say(`  skipped: ${basename(file)} is not there`);
    return existsSync(file);
  });
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  await step("SDK", buildSdk);
  const { chromium } = await import("@playwright/test");
  const server = await serve();
  const browser = await chromium.launch({ executablePath, args: ARGUMENTS });
  mkdirSync(OUT, { recursive: true });
  try {
    const taken = await takeAll(browser, server.url, avatars);
    const look = (kind) =>
      taken.map(({ name, pictures }) => ({ picture: pictures[kind], caption: `${name}, ${kind}` }));
    const kinds = ["plain", "tissue", "coverage", "plain, back", "tissue, back"];
    await sheet(browser, kinds.map(look), "avatars");
    for (const { name, landing } of taken.slice(0, 1)) {
      const row = (kind) =>
        landing.map(({ seconds, ...pictures }) => ({
          picture: pictures[kind],
          caption: `${name}, ${kind}, ${seconds.toFixed(2)} s`,
        }));
      await sheet(browser, ["plain", "tissue"].map(row), "avatar-landing");
    }
  } finally {
    await browser.close();
    server.close();
  }
});
