/**
 * Hops for two seconds and writes the largest offset into the title, for the test to read. The model comes
 * from a package, or from a folder if none is given.
 */
export async function show({ load, Motion }, source = "/models/female/") {
  try {
    const model = await load({ model: source });
    const avatar = model.createAvatar();
    const motion = Motion.procedural("hop", avatar);
    let largestM = 0;
    for (let tick = 0; tick < 120; tick += 1) {
      avatar.step(motion.poseAt(tick / 60), 1 / 60);
      for (const value of avatar.offsets) largestM = Math.max(largestM, Math.abs(value));
    }
    document.title = `offset ${(largestM * 1000).toFixed(2)} mm`;
  } catch (error) {
    document.title = `failed: ${error.code} ${error.message}`;
  }
}

/** Watches a canvas that a page draws to by itself; an empty one hardly varies. */
export async function showDrawn(canvas) {
  let variation = 0;
  for (let frame = 0; frame < 120 && variation < 15; frame += 1) {
    // After the page's own frame, before the browser has taken the picture away.
    await new Promise(requestAnimationFrame);
    variation = variationOf(canvas);
  }
  document.title = `variation ${variation.toFixed(1)}`;
}

/** Standard deviation of the green of a canvas, 0 to 255. */
function variationOf(canvas) {
  const copy = new OffscreenCanvas(100, 125).getContext("2d", { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0, 100, 125);
  const values = copy.getImageData(0, 0, 100, 125).data.filter((_, at) => at % 4 === 1);
  const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
  const squares = values.reduce((sum, value) => sum + (value - mean) ** 2, 0);
  return Math.sqrt(squares / values.length);
}

/** Watches an avatar that a page moves by itself. */
export async function showLargest(avatar) {
  let largestM = 0;
  for (let frame = 0; frame < 600 && largestM < 0.002; frame += 1) {
    await new Promise(requestAnimationFrame);
    for (const value of avatar.offsets) largestM = Math.max(largestM, Math.abs(value));
  }
  document.title = `offset ${(largestM * 1000).toFixed(2)} mm`;
}
