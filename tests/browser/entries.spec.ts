// Entries of the package that only a browser can show: the worker, and a content security policy.
import { expect, test } from "@playwright/test";
import { REPOSITORY_URL } from "./places.js";

test("an avatar in a worker gives the bits of one in the page", async ({ page }) => {
  await page.goto(`${REPOSITORY_URL}/blank`);
  const { largestM, differing, ahead } = await page.evaluate(async () => {
    const { load, Motion } = await import(`${location.origin}/web/sdk/dist/index.js`);
    const { createWorkerAvatar } = await import(`${location.origin}/web/sdk/dist/worker/index.js`);
    const model = "/models/female/";
    const shape = [0.5, 1.5, 0, 0, 0, 0, 0, 0, 0, 0];
    const here = (await load({ model })).createAvatar({ shape });
    const there = await createWorkerAvatar({ model, shape });
    const motion = Motion.procedural("hop", here);
    for (const avatar of [here, there]) avatar.setControls("calm-clothes");
    let [largestM, differing, ahead] = [0, 0, 0];
    for (let tick = 0; tick < 120; tick += 1) {
      const pose = motion.poseAt(tick / 60);
      here.step(pose, 1 / 60);
      there.step(pose, 1 / 60);
      if (there.pending) ahead += 1;
      await there.whenAnswered();
      const offsets = here.offsets as Float32Array;
      offsets.forEach((value, idx) => {
        largestM = Math.max(largestM, Math.abs(value));
        if (value !== there.offsets[idx]) differing += 1;
      });
    }
    there.dispose();
    there.dispose();
    return { largestM, differing, ahead };
  });
  console.log(`offsets in the worker to ${(largestM * 1000).toFixed(1)} mm`);
  expect(largestM).toBeGreaterThan(1e-3);
  expect(differing).toBe(0);
  expect(ahead).toBe(120);
});

test("a worker hands back errors, and goes on", async ({ page }) => {
  await page.goto(`${REPOSITORY_URL}/blank`);
  const codes = await page.evaluate(async () => {
    const { createWorkerAvatar } = await import(`${location.origin}/web/sdk/dist/worker/index.js`);
    const { restPose } = await import(`${location.origin}/web/sdk/dist/index.js`);
    const codeOf = async (work: () => unknown) => {
      try {
        await work();
        return "none";
      } catch (error) {
        return (error as { code?: string }).code ?? String(error);
      }
    };
    const missing = await codeOf(() => createWorkerAvatar({ model: "/models/nobody/" }));
    const reason = Object.assign(new Error("left"), { code: "left" });
    const aborted = await codeOf(() => {
      const abort = new AbortController();
      const loading = createWorkerAvatar({ model: "/models/female/", signal: abort.signal });
      abort.abort(reason);
      return loading;
    });
    const avatar = await createWorkerAvatar({ model: "/models/female/" });
    avatar.step(restPose().fill(Number.NaN), 1 / 60);
    const bad = await codeOf(() => avatar.whenAnswered());
    avatar.step(restPose(), 1 / 60);
    await avatar.whenAnswered();
    const good = await codeOf(() => avatar.step(restPose(), 1 / 60));
    avatar.dispose();
    const after = await codeOf(() => avatar.step(restPose(), 1 / 60));
    return { missing, aborted, bad, good, after };
  });
  expect(codes).toEqual({
    missing: "fetch",
    aborted: "left",
    bad: "pose",
    good: "none",
    after: "disposed",
  });
});

for (const [policy, expected] of [
  ["script-src 'self'", "wasm"],
  ["script-src 'self' 'wasm-unsafe-eval'", "none"],
] as const) {
  test(`content security policy ${policy}`, async ({ page }) => {
    await page.route("**/csp", (route) =>
      route.fulfill({
        contentType: "text/html",
        headers: { "Content-Security-Policy": policy },
        body: '<!doctype html><title>csp</title><script type="module" src="/csp.js"></script>',
      }),
    );
    await page.route("**/csp.js", (route) =>
      route.fulfill({
        contentType: "text/javascript",
        body: `import { load } from "/web/sdk/dist/index.js";
          load({ model: "/models/female/" }).then(
            () => { document.title = "none"; },
            (error) => { document.title = error.code + " " + error.message; },
          );`,
      }),
    );
    await page.goto(`${REPOSITORY_URL}/csp`);
    await expect(page).toHaveTitle(new RegExp(`^${expected}`));
    if (expected === "wasm") await expect(page).toHaveTitle(/'wasm-unsafe-eval'/);
  });
}
