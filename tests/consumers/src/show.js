/** Hops for two seconds and writes the largest offset into the title, for the test to read. */
export async function show({ load, Motion }, options = {}) {
  try {
    const model = await load({ model: "/models/female/", ...options });
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

/** Watches an avatar that a page moves by itself. */
export async function showLargest(avatar) {
  let largestM = 0;
  for (let frame = 0; frame < 600 && largestM < 0.002; frame += 1) {
    await new Promise(requestAnimationFrame);
    for (const value of avatar.offsets) largestM = Math.max(largestM, Math.abs(value));
  }
  document.title = `offset ${(largestM * 1000).toFixed(2)} mm`;
}
