// Runs in a page: what a crowd costs its main thread a frame, decoded by the CPU and by the graphics card.

import { median, watchGraphicsCard } from "./actors.mjs";

const WARM_UP_FRAMES = 10;
const FRAMES = 60;
const STEP_SECONDS = 1 / 60;

/**
 * Steps and draws two crowds of `count` hopping avatars of five shapes in turns, each in a renderer of its own.
 * Before each frame it waits until the graphics card is done.
 *
 * @param {{ model: string, count: number, backend: "webgpu" | "webgl2", engine?: "three" | "babylon" }} what
 *   `engine` draws in place of dynaskin/renderer
 * @returns for `cpu` and `card`, medians in milliseconds
 */
export async function measureDecoding({ model, count, backend, engine }) {
  const { load, Motion } = await import("/web/sdk/dist/index.js");
  const loaded = await load({ model: new URL(model, location.href).href });
  const crowds = [];
  for (const decoding of ["cpu", "card"]) {
    const crowd = loaded.createCrowd();
    crowd.decoding = decoding;
    const avatars = Array.from({ length: count }, (_, idx) => {
      const avatar = loaded.createAvatar({ shape: [0, (idx % 5) - 2, 0, 0, 0, 0, 0, 0, 0, 0] });
      crowd.add(avatar);
      return avatar;
    });
    const drawn = engine
      ? await inEngine(engine, avatars, model, backend)
      : await inRenderer(loaded, avatars, backend);
    const times = { stepMs: [], updateMs: [], renderMs: [], frameMs: [] };
    crowds.push({ decoding, crowd, times, ...drawn });
  }
  const motion = Motion.procedural("hop", crowds[0].crowd.avatars[0]);
  const poses = Array.from({ length: count }, () => new Float64Array(99));
  for (let frame = 0; frame < WARM_UP_FRAMES + FRAMES; frame += 1) {
    for (const [idx, pose] of poses.entries()) {
      motion.poseAt((frame * STEP_SECONDS + 0.37 * idx) % motion.durationSeconds, pose);
    }
    for (const made of frame % 2 ? crowds : crowds.toReversed()) {
      const { crowd, pose, update, render, times, idle } = made;
      const own = pose(poses);
      const startMs = performance.now();
      crowd.stepAll(own, STEP_SECONDS);
      const steppedMs = performance.now();
      update();
      const updatedMs = performance.now();
      render();
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
  const results = crowds.map(({ decoding, times, onCard }) => ({
    decoding,
    onCard: onCard(),
    ...Object.fromEntries(Object.entries(times).map(([key, values]) => [key, median(values)])),
  }));
  for (const { dispose } of crowds) dispose();
  return results;
}

async function inRenderer(model, avatars, backend) {
  const { createRenderer } = await import("/web/sdk/dist/renderer.js");
  const canvas = document.body.appendChild(document.createElement("canvas"));
  const idle = watchGraphicsCard(canvas, backend);
  const renderer = await createRenderer(canvas, { backend });
  // Small, so that a graphics card in software does not take the processor from the page.
  renderer.resize(32, 32, 1);
  const bodies = avatars.map((avatar) => ({ avatar, body: renderer.addBody(model.body) }));
  return {
    idle,
    pose: (poses) => poses,
    update: () => {
      for (const { avatar, body } of bodies) body.update(avatar);
    },
    render: () => renderer.render(),
    onCard: () => bodies.filter(({ body }) => body.isDecodedOnCard).length,
    dispose: () => {
      renderer.dispose();
      canvas.remove();
    },
  };
}

async function inEngine(engine, avatars, model, backend) {
  const { crowdInBabylon, crowdInThree } = await import("./engine-decoding.mjs");
  const make = engine === "three" ? crowdInThree : crowdInBabylon;
  const canvas = document.createElement("canvas");
  const idle = watchGraphicsCard(canvas, backend);
  const { skins, render, dispose } = await make(avatars, model, canvas, backend);
  return {
    idle,
    pose: (poses) => {
      for (const [idx, skin] of skins.entries()) skin.writePose(poses[idx]);
      return skins.map((skin) => skin.readPose());
    },
    update: () => {
      for (const skin of skins) skin.show();
    },
    render,
    onCard: () => skins.filter(({ isDecodedOnCard }) => isDecodedOnCard).length,
    dispose: () => {
      for (const skin of skins) skin.dispose();
      dispose();
    },
  };
}
