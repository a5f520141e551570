// npm run bench:decoding: what crowds cost the page's main thread a frame in Chromium, drawn by
// dynaskin/renderer, three.js and Babylon.js, decoded by the CPU and by the graphics card in turns. Run
// `npm run build` before. `npm run bench:decoding -- three 100` measures one of them, with that many avatars.
import { launchFor } from "./lib/bench-page.mjs";
import { main, say, step } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { findChromium } from "./toolchain.mjs";

const COUNTS = [1, 10, 50, 100];

/** Who draws: its backend, and the engine if it is one. */
const DRAWERS = {
  webgl2: { backend: "webgl2" },
  webgpu: { backend: "webgpu" },
  three: { backend: "webgl2", engine: "three" },
  babylon: { backend: "webgl2", engine: "babylon" },
  "three-webgpu": { backend: "webgpu", engine: "three" },
  "babylon-webgpu": { backend: "webgpu", engine: "babylon" },
};

/** What pages of engines find by name. */
const IMPORTS = {
  "@babylonjs/core/": "/node_modules/@babylonjs/core/",
  "@babylonjs/loaders/": "/node_modules/@babylonjs/loaders/",
  dynaskin: "/web/sdk/dist/index.js",
  "dynaskin/babylon": "/web/sdk/dist/babylon/index.js",
  "dynaskin/three": "/web/sdk/dist/three/index.js",
  three: "/node_modules/three/build/three.module.js",
  "three/addons/": "/node_modules/three/examples/jsm/",
  "three/webgpu": "/node_modules/three/build/three.webgpu.js",
};

async function measure({ backend, engine }, counts, executablePath, url) {
  const browser = await launchFor(backend, executablePath);
  try {
    for (const count of counts) {
      const page = await browser.newPage();
      await page.goto(`${url}/blank`);
      await page.evaluate((imports) => {
        const map = document.createElement("script");
        map.type = "importmap";
        map.textContent = JSON.stringify({ imports });
        document.head.append(map);
      }, IMPORTS);
      const what = { model: "/models/female/", count, backend, engine };
      const results = await page.evaluate(
        async (given) => (await import("/scripts/bench/decoding.mjs")).measureDecoding(given),
        what,
      );
      for (const result of results) print(count, result);
      await page.close();
    }
  } finally {
    await browser.close();
  }
}

function print(count, { decoding, onCard, stepMs, updateMs, renderMs, frameMs }) {
  const ms = (value) => `${value.toFixed(2)} ms`;
  say(
    `${count} avatars, decoding ${decoding} (${onCard} on the card): steps ${ms(stepMs)}, updates ` +
      `${ms(updateMs)}, drawing calls ${ms(renderMs)}; together ${ms(frameMs)}`,
  );
}

main(async () => {
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  const [name, count] = process.argv.slice(2);
  if (name && !(name in DRAWERS)) {
    throw new Error(`There is no ${name}; there are ${Object.keys(DRAWERS).join(", ")}.`);
  }
  const counts = count ? [Number(count)] : COUNTS;
  const server = await serve();
  try {
    for (const [title, drawer] of Object.entries(DRAWERS)) {
      if (name && name !== title) continue;
      if (drawer.backend === "webgpu" && !process.env.DISPLAY) {
        say("WebGPU needs a display: run this under xvfb-run.");
        continue;
      }
      await step(`Crowds with ${title}: ms a frame of the main thread, medians of 60`, () =>
        measure(drawer, counts, executablePath, server.url),
      );
    }
  } finally {
    server.close();
  }
});
