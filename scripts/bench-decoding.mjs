// npm run bench:decoding: what crowds cost the page's main thread a frame in Chromium, drawn by
// dynaskin/renderer, decoded by the CPU and by the graphics card in turns. Run `npm run build` before.
import { launchFor } from "./lib/bench-page.mjs";
import { main, say, step } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { findChromium } from "./toolchain.mjs";

const COUNTS = [1, 10, 50, 100];

async function measure(backend, executablePath, url) {
  const browser = await launchFor(backend, executablePath);
  try {
    for (const count of COUNTS) {
      const page = await browser.newPage();
      await page.goto(`${url}/blank`);
      const what = { model: "/models/female/", count, backend };
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
  const server = await serve();
  try {
    for (const backend of ["webgl2", "webgpu"]) {
      if (backend === "webgpu" && !process.env.DISPLAY) {
        say("WebGPU needs a display: run this under xvfb-run.");
        continue;
      }
      const title = `Crowds with ${backend}: ms a frame of the main thread, medians of 60`;
      await step(title, () => measure(backend, executablePath, server.url));
    }
  } finally {
    server.close();
  }
});
