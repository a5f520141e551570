// dynaskin's own renderer: a studio on WebGPU, or on WebGL2 where there is none, without an engine or
// a shader of one's own. ?backend=webgl2 asks for the latter.
import { load, Motion } from "dynaskin";
import { createRenderer, type Renderer } from "dynaskin/renderer";
import { showError, showNote } from "../src/shared/note.js";
import "../src/shared/hook.js";

const MODEL = new URL("../female/", location.href);
const SHAPE = [0, 1.5, 0, 0, 0, 0, 0, 0, 0, 0];

const BACKEND =
  new URLSearchParams(location.search).get("backend") === "webgl2" ? "webgl2" : "auto";

const canvas = document.querySelector("canvas") as HTMLCanvasElement;

function showLoss(isLost: boolean): void {
  (document.getElementById("lost") as HTMLElement).hidden = !isLost;
}

async function keepDrawing(renderer: Renderer): Promise<void> {
  while ((await renderer.lost) !== null) {
    showLoss(true);
    await renderer.recover(); // waits until the browser gives a WebGL2 context back
    showLoss(false);
  }
}

async function main() {
  const [renderer, model] = await Promise.all([
    createRenderer(canvas, { backend: BACKEND }),
    load({ model: MODEL }),
  ]);
  keepDrawing(renderer).catch(showError);
  const avatar = model.createAvatar({ shape: SHAPE });
  const motion = Motion.procedural("hop", avatar);
  const body = renderer.addBody(model.body);
  renderer.setCamera({ eyeWorldM: [1.6, 1.5, 4.6], targetWorldM: [0, 1, 0], fovYRadians: 0.42 });

  // Sharper than two pixels a CSS pixel costs more than it shows.
  function fit() {
    const { clientWidth, clientHeight } = canvas;
    renderer.resize(clientWidth, clientHeight, Math.min(devicePixelRatio, 2));
  }
  const sizes = new ResizeObserver(fit);
  sizes.observe(canvas);
  // Another screen has other pixels, though the canvas keeps its size.
  addEventListener("resize", fit);

  const pose = new Float64Array(99);
  let timeSeconds = 0;

  function animate(deltaSeconds: number) {
    timeSeconds = (timeSeconds + deltaSeconds) % motion.durationSeconds;
    avatar.step(motion.poseAt(timeSeconds, pose), deltaSeconds);
  }

  let playing = true;
  let lastMs = performance.now();
  let nextFrame = 0;
  function frame(nowMs: number) {
    if (playing) animate(Math.max(0, nowMs - lastMs) / 1000);
    lastMs = nowMs;
    body.update(avatar);
    renderer.render();
    nextFrame = requestAnimationFrame(frame);
  }
  nextFrame = requestAnimationFrame(frame);
  showNote(`dynaskin/renderer with ${renderer.backend}`, avatar);

  function dispose() {
    cancelAnimationFrame(nextFrame);
    sizes.disconnect();
    removeEventListener("resize", fit);
    renderer.dispose();
    avatar.dispose();
    model.dispose();
  }
  // A page that is only put aside (`persisted`) may come back and goes on.
  addEventListener("pagehide", ({ persisted }) => {
    if (!persisted) dispose();
  });

  window.dynaskinExample = {
    avatar,
    showMoment(seconds) {
      playing = false;
      timeSeconds = 0;
      avatar.reset();
      for (let tick = 0; tick < seconds * 60; tick += 1) animate(1 / 60);
    },
    dispose,
  };
}

main().catch(showError);
