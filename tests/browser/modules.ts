import type { Page } from "@playwright/test";
import { REPOSITORY_URL } from "./places.js";

const MTOON = "/node_modules/@pixiv/three-vrm-materials-mtoon/lib";
const IMPORTS = {
  "@babylonjs/core/": "/node_modules/@babylonjs/core/",
  "@babylonjs/loaders/": "/node_modules/@babylonjs/loaders/",
  "@pixiv/three-vrm-materials-mtoon": `${MTOON}/three-vrm-materials-mtoon.module.js`,
  "@pixiv/three-vrm-materials-mtoon/nodes": `${MTOON}/nodes/index.module.js`,
  dynaskin: "/web/sdk/dist/index.js",
  "dynaskin/babylon": "/web/sdk/dist/babylon/index.js",
  "dynaskin/renderer": "/web/sdk/dist/renderer.js",
  "dynaskin/three": "/web/sdk/dist/three/index.js",
  three: "/node_modules/three/build/three.module.js",
  "three/tsl": "/node_modules/three/build/three.tsl.js",
  "three/webgpu": "/node_modules/three/build/three.webgpu.js",
  "three/addons/": "/node_modules/three/examples/jsm/",
};

/** Opens an empty page that finds engines and the package by name; gives the list of its errors. `others` replaces modules. */
export async function openModules(
  page: Page,
  name: string,
  others: Readonly<Record<string, string>> = {},
): Promise<string[]> {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => {
    // Engines go on without what the graphics card refuses.
    if (/GPUValidationError|Render pipeline creation failed/.test(message.text())) {
      problems.push(message.text());
    }
  });
  await page.route(`**/${name}`, (route) =>
    route.fulfill({
      contentType: "text/html",
      body: `<!doctype html><title>${name}</title><link rel="icon" href="data:,">
        <script type="importmap">${JSON.stringify({ imports: { ...IMPORTS, ...others } })}</script>`,
    }),
  );
  await page.goto(`${REPOSITORY_URL}/${name}`);
  return problems;
}
