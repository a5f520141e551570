// npm run bench:actors: what four actors cost the page's main thread a frame in Chromium, drawn by
// dynaskin/renderer: steps, uploads, and the calls that draw. Run `npm run build` before. What the
// graphics card needs for a frame is not measured here; docs/renderer.md estimates it.
import { launchFor } from "./lib/bench-page.mjs";
import { main, say, step } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { findChromium } from "./toolchain.mjs";

const GROUPS = [
  ["dynaskin", "dynaskin", "dynaskin", "dynaskin"],
  ["linear", "spring-bones", "dsnet", "dynaskin"],
];
/** Small, so that a graphics card in software does not take the processor from the page. */
const SIZE = [64, 36];

async function measure(backend, executablePath, url) {
  const browser = await launchFor(backend, executablePath);
  try {
    const results = [];
    for (const kinds of GROUPS) {
      const page = await browser.newPage();
      await page.goto(`${url}/blank`);
      const what = { model: "/models/female/", kinds, backend, size: SIZE };
      results.push(
        await page.evaluate(
          async (given) => (await import("/scripts/bench/actors.mjs")).measureActors(given),
          what,
        ),
      );
      await page.close();
    }
    return results;
  } finally {
    await browser.close();
  }
}

function print(result) {
  const ms = (value) => `${value.toFixed(2)} ms`;
  say(result.steps.map(([kind, stepMs]) => `${kind} ${ms(stepMs)}`).join(", "));
  say(
    `  steps ${ms(result.stepMs)}, uploads ${ms(result.uploadMs)}, drawing calls ${ms(result.renderMs)}; ` +
      `together ${ms(result.frameMs)}, 95 % within ${ms(result.slowMs)}`,
  );
}

main(async () => {
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  const server = await serve();
  try {
    for (const backend of ["webgl2", "webgpu"]) {
      if (backend === "webgpu" && !process.env.DISPLAY) {
        say("WebGPU needs a display: run this under xvfb-run.");
        continue;
      }
      const title = `Four actors with ${backend}: ms a frame of the main thread, medians of 90`;
      const results = await step(title, () => measure(backend, executablePath, server.url));
      results.forEach(print);
    }
  } finally {
    server.close();
  }
});
