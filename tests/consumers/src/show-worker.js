import { load, Motion } from "dynaskin";
import { createWorkerAvatar } from "dynaskin/worker";

/**
 * As `show`, in a worker: its file and its WebAssembly must be found by the bundler too, or be named in
 * `options`.
 */
export async function showWorker(options) {
  try {
    const { model = "/models/female/", wasm } = options ?? {};
    const motion = Motion.procedural("hop", (await load({ model, wasm })).createAvatar());
    const avatar = await createWorkerAvatar({ ...options, model });
    let largestM = 0;
    for (let tick = 0; tick < 120; tick += 1) {
      avatar.step(motion.poseAt(tick / 60), 1 / 60);
      await avatar.whenAnswered();
      for (const value of avatar.offsets) largestM = Math.max(largestM, Math.abs(value));
    }
    avatar.dispose();
    document.title = `offset ${(largestM * 1000).toFixed(2)} mm`;
  } catch (error) {
    document.title = `failed: ${error.code} ${error.message}`;
  }
}
