// npm run bench:worker: how far behind the page an avatar in a worker is, in Chromium: milliseconds
// from step to answer, and how many display frames the surface lies behind the pose.

import { main, say } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { findChromium } from "./toolchain.mjs";

const FRAMES = 300;

/** Runs in the page. Each pose stands a millimetre further on, so a surface tells whose it is. */
async function measure([model, frames]) {
  const { createWorkerAvatar } = await import("/web/sdk/dist/worker/index.js");
  const { restPose } = await import("/web/sdk/dist/index.js");
  const avatar = await createWorkerAvatar({ model });
  const pose = restPose();
  const give = (frame, dtSeconds) => {
    pose[0] = frame / 1000;
    avatar.step(pose, dtSeconds);
  };
  give(0, 0);
  await avatar.whenAnswered();
  const behindFrames = [];
  let lastMs = performance.now();
  for (let frame = 1; frame <= frames; frame += 1) {
    const nowMs = await new Promise(requestAnimationFrame);
    give(frame, Math.max(0, nowMs - lastMs) / 1000);
    lastMs = nowMs;
    // What this frame draws: the surface is there at once, the pose is the frame's own.
    behindFrames.push(frame - Math.round(avatar.skinMatrices[12] * 1000));
  }
  await avatar.whenAnswered();
  const answerMs = [];
  for (let frame = frames; frame < 2 * frames; frame += 1) {
    const startMs = performance.now();
    give(frame, 1 / 60);
    await avatar.whenAnswered();
    answerMs.push(performance.now() - startMs);
  }
  avatar.dispose();
  return { behindFrames, answerMs };
}

main(async () => {
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  const { chromium } = await import("@playwright/test");
  const server = await serve();
  const args = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"];
  const browser = await chromium.launch({ executablePath, args });
  try {
    const page = await browser.newPage();
    await page.goto(`${server.url}/blank`);
    const { behindFrames, answerMs } = await page.evaluate(measure, ["/models/female/", FRAMES]);
    const counts = new Map();
    for (const frames of behindFrames) counts.set(frames, (counts.get(frames) ?? 0) + 1);
    for (const [frames, count] of [...counts].sort(([a], [b]) => a - b)) {
      const share = ((100 * count) / behindFrames.length).toFixed(1);
      say(`surface ${frames} display frames behind the pose: ${share} % of ${FRAMES} frames`);
    }
    answerMs.sort((a, b) => a - b);
    const at = (share) => answerMs[Math.floor(share * (answerMs.length - 1))].toFixed(2);
    say(`step to answer: median ${at(0.5)} ms, 95 % within ${at(0.95)} ms`);
  } finally {
    await browser.close();
    server.close();
  }
});
