// Runs in a page: what a crowd costs its main thread a frame, decoded by the CPU and by the graphics card.

import { median, watchGraphicsCard } from "./actors.mjs";

const WARM_UP_FRAMES = 10;
const FRAMES = 60;
const STEP_SECONDS = 1 / 60;

/**
 * Steps and draws two crowds of `count` hopping avatars of five shapes in turns, each in a renderer of its own.
 * Before each frame it waits until the graphics card is done.
 *
 * @param {{ model: string, count: number, backend: "webgpu" | "webgl2" }} what
 * @returns for `cpu` and `card`, medians in milliseconds
 */
export async function measureDecoding({ model, count, backend }) {
  const { load } = await import("/web/sdk/dist/index.js");
  const loaded = await load({ model });
  const crowds = [];
  for (const decoding of ["cpu", "card"]) {
    crowds.push(await makeCrowd(loaded, count, backend, decoding));
  }
  const { Motion } = await import("/web/sdk/dist/index.js");
  const motion = Motion.procedural("hop", crowds[0].bodies[0].avatar);
  const poses = crowds[0].bodies.map(() => new Float64Array(99));
  for (let frame = 0; frame < WARM_UP_FRAMES + FRAMES; frame += 1) {
    for (const [idx, pose] of poses.entries()) {
      motion.poseAt((frame * STEP_SECONDS + 0.37 * idx) % motion.durationSeconds, pose);
    }
    for (const made of frame % 2 ? crowds : crowds.toReversed()) {
      const { crowd, bodies, renderer, times, idle } = made;
      const startMs = performance.now();
      crowd.stepAll(poses, STEP_SECONDS);
      const steppedMs = performance.now();
      for (const { avatar, body } of bodies) body.update(avatar);
      const updatedMs = performance.now();
      renderer.render();
      const renderedMs = performance.now();
      if (frame >= WARM_UP_FRAMES) {
        times.stepMs.push(steppedMs - startMs);
        times.updateMs.push(updatedMs - steppedMs);
        times.renderMs.push(renderedMs - updatedMs);
        times.frameMs.push(renderedMs - startMs);
      }
      await idle();
    }
  }
  const results = crowds.map(({ decoding, times, bodies }) => ({
    decoding,
    onCard: bodies.filter(({ body }) => body.isDecodedOnCard).length,
    ...Object.fromEntries(Object.entries(times).map(([key, values]) => [key, median(values)])),
  }));
  for (const { renderer, canvas } of crowds) {
    renderer.dispose();
    canvas.remove();
  }
  return results;
}

async function makeCrowd(model, count, backend, decoding) {
  const { createRenderer } = await import("/web/sdk/dist/renderer.js");
  const canvas = document.body.appendChild(document.createElement("canvas"));
  const idle = watchGraphicsCard(canvas, backend);
  const renderer = await createRenderer(canvas, { backend });
  // Small, so that a graphics card in software does not take the processor from the page.
  renderer.resize(32, 32, 1);
  const crowd = model.createCrowd();
  crowd.decoding = decoding;
  const bodies = Array.from({ length: count }, (_, idx) => {
    const avatar = model.createAvatar({ shape: [0, (idx % 5) - 2, 0, 0, 0, 0, 0, 0, 0, 0] });
    crowd.add(avatar);
    return { avatar, body: renderer.addBody(model.body) };
  });
  const times = { stepMs: [], updateMs: [], renderMs: [], frameMs: [] };
  return { decoding, canvas, idle, renderer, crowd, bodies, times };
}
