// Runs in a page: what several actors cost its main thread a frame.

const WARM_UP_FRAMES = 15;
const FRAMES = 90;
const STEP_SECONDS = 1 / 60;

/**
 * Moves and draws actors side by side through a hop, one per name: `linear`, `dynaskin`, or a folder
 * under the body's `methods`. Between frames it waits until the graphics card is done, so that the
 * times are those of calls and not of a queue that is full.
 *
 * @param {{ model: string, kinds: string[], backend: "webgpu" | "webgl2",
 *   size: [widthPx: number, heightPx: number] }} what
 * @returns medians in milliseconds
 */
export async function measureActors({ model, kinds, backend, size }) {
  const { load, Motion } = await import("/web/sdk/dist/index.js");
  const { createRenderer } = await import("/web/sdk/dist/renderer.js");
  const canvas = document.body.appendChild(document.createElement("canvas"));
  const idle = watchGraphicsCard(canvas, backend);
  const renderer = await createRenderer(canvas, { backend });
  renderer.resize(...size, 1);
  renderer.setCamera({ eyeWorldM: [0, 1.3, 6.5], targetWorldM: [0, 0.9, 0], fovYRadians: 0.45 });
  // The compared methods are in the demo's core alone.
  const wasm = "/web/demo/wasm/core_bg.wasm";
  const own = await load({ model, wasm });
  const actors = [];
  for (const [index, kind] of kinds.entries()) {
    const avatar = await createAvatar(load, model, own, kind);
    const body = renderer.addBody(own.body);
    body.setPlacement({ positionM: [index - (kinds.length - 1) / 2, 0, 0] });
    actors.push({ kind, avatar, body, stepMs: [] });
  }
  const motion = Motion.procedural("hop", actors[0].avatar);
  const pose = new Float64Array(99);
  const frames = { stepMs: [], uploadMs: [], renderMs: [], frameMs: [] };
  for (let frame = 0; frame < WARM_UP_FRAMES + FRAMES; frame += 1) {
    motion.poseAt((frame * STEP_SECONDS) % motion.durationSeconds, pose);
    const startMs = performance.now();
    let beforeMs = startMs;
    for (const { avatar, stepMs } of actors) {
      avatar.step(pose, STEP_SECONDS);
      const nowMs = performance.now();
      if (frame >= WARM_UP_FRAMES) stepMs.push(nowMs - beforeMs);
      beforeMs = nowMs;
    }
    const steppedMs = beforeMs;
    for (const { avatar, body } of actors) body.update(avatar);
    const uploadedMs = performance.now();
    renderer.render();
    const renderedMs = performance.now();
    if (frame >= WARM_UP_FRAMES) {
      frames.stepMs.push(steppedMs - startMs);
      frames.uploadMs.push(uploadedMs - steppedMs);
      frames.renderMs.push(renderedMs - uploadedMs);
      frames.frameMs.push(renderedMs - startMs);
    }
    await idle();
  }
  renderer.dispose();
  canvas.remove();
  return {
    backend,
    steps: actors.map(({ kind, stepMs }) => [kind, median(stepMs)]),
    ...Object.fromEntries(Object.entries(frames).map(([key, values]) => [key, median(values)])),
    slowMs: frames.frameMs.toSorted((a, b) => a - b)[Math.floor(0.95 * FRAMES)],
    vertices: own.body.vertexCount,
    triangles: own.body.faces.length / 3,
  };
}

/** An avatar whose skin is moved as `kind` says, on the body of `own`. */
async function createAvatar(load, model, own, kind) {
  if (kind === "dynaskin") return own.createAvatar();
  if (kind === "linear") return own.body.createAvatar();
  const method = await load({ model: `${model}methods/${kind}/`, body: own.body });
  return method.createAvatar();
}

/** Call before the renderer is made; gives a function that waits for what was submitted. */
export function watchGraphicsCard(canvas, backend) {
  if (backend === "webgl2") {
    return async () => {
      const gl = canvas.getContext("webgl2");
      // Reading is the one call that a browser cannot put off.
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      await new Promise((done) => setTimeout(done));
    };
  }
  let device;
  const ask = GPUAdapter.prototype.requestDevice;
  GPUAdapter.prototype.requestDevice = async function (...what) {
    // The next one may be somebody else's.
    GPUAdapter.prototype.requestDevice = ask;
    device = await ask.apply(this, what);
    return device;
  };
  return async () => {
    await device.queue.onSubmittedWorkDone();
    await new Promise((done) => setTimeout(done));
  };
}

export function median(values) {
  return values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];
}
