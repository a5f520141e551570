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

test("a worker holds two avatars and a crowd, with the bits of those in the page", async ({
  page,
}) => {
  await page.goto(`${REPOSITORY_URL}/blank`);
  const seen = await page.evaluate(async () => {
    const { load, Motion } = await import(`${location.origin}/web/sdk/dist/index.js`);
    const { createWorkerModel } = await import(`${location.origin}/web/sdk/dist/worker/index.js`);
    const model = "/models/female/";
    const shapes = [new Array(10).fill(0), [0.5, 1.5, 0, 0, 0, 0, 0, 0, 0, 0]];
    const [inPage, inWorker] = [await load({ model }), await createWorkerModel({ model })];
    const sides = [];
    for (const side of [inPage, inWorker]) {
      const crowd = await side.createCrowd();
      for (const shape of shapes) crowd.add(await side.createAvatar({ shape }));
      sides.push({ crowd, alone: await side.createAvatar() });
    }
    const [here, there] = sides as [(typeof sides)[0], (typeof sides)[0]];
    const motion = Motion.procedural("hop", here.alone);
    let [largestM, differing] = [0, 0];
    for (let tick = 0; tick < 90; tick += 1) {
      const poses = [0, 0.25].map((later) => motion.poseAt(tick / 60 + later));
      if (tick === 60) {
        for (const { crowd } of sides) {
          crowd.avatars[1].setControls("sportswear");
          crowd.avatars[1].distanceM = 20;
          crowd.levelOfDetail = {};
        }
      }
      for (const { crowd, alone } of sides) {
        crowd.stepAll(poses, 1 / 60);
        alone.step(poses[0], 1 / 60);
      }
      await Promise.all([there.crowd, there.alone].map((part) => part.whenAnswered()));
      const avatars = [...here.crowd.avatars, here.alone];
      for (const [idx, avatar] of [...there.crowd.avatars, there.alone].entries()) {
        const expected = avatars[idx].positions as Float32Array;
        expected.forEach((value, at) => {
          if (value !== avatar.positions[at]) differing += 1;
        });
        for (const value of avatar.offsets) largestM = Math.max(largestM, Math.abs(value));
      }
    }
    const { full, half, asleep } = there.crowd.report;
    inWorker.dispose();
    return { largestM, differing, details: { full, half, asleep } };
  });
  console.log(`offsets in the worker's crowd to ${(seen.largestM * 1000).toFixed(1)} mm`);
  expect(seen.largestM).toBeGreaterThan(1e-3);
  expect(seen.differing).toBe(0);
  expect(seen.details).toEqual({ full: 1, half: 1, asleep: 0 });
});

test("a worker that is silent, or is ended while a call waits, is an error", async ({ page }) => {
  await page.route("**/silent.js", (route) =>
    route.fulfill({ contentType: "text/javascript", body: "onmessage = () => {};" }),
  );
  await page.goto(`${REPOSITORY_URL}/blank`);
  const codes = await page.evaluate(async () => {
    const { createWorkerModel } = await import(`${location.origin}/web/sdk/dist/worker/index.js`);
    const { restPose } = await import(`${location.origin}/web/sdk/dist/index.js`);
    const codeOf = (promise: Promise<unknown>) =>
      promise.then(
        () => "none",
        (error) => error.code,
      );
    const model = "/models/female/";
    const createWorker = () => new Worker("/silent.js", { type: "module" });
    const silent = await codeOf(createWorkerModel({ model, createWorker, timeoutMs: 500 }));
    let worker: Worker | undefined;
    const lost = await createWorkerModel({
      model,
      createWorker: () => {
        worker = new Worker("/web/sdk/dist/worker/thread.js", { type: "module" });
        return worker;
      },
      timeoutMs: 3000,
    });
    const avatar = await lost.createAvatar();
    avatar.step(restPose(), 1 / 60);
    worker?.terminate();
    const waiting = [avatar.save(), avatar.whenAnswered(), lost.createCrowd()];
    const ended = await Promise.all(waiting.map(codeOf));
    lost.dispose();
    return { silent, ended };
  });
  expect(codes).toEqual({ silent: "worker", ended: ["worker", "worker", "worker"] });
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

test("a page with Trusted Types starts its worker by its own policy", async ({ page }) => {
  await page.route("**/trusted", (route) =>
    route.fulfill({
      contentType: "text/html",
      headers: {
        "Content-Security-Policy":
          "script-src 'self' 'wasm-unsafe-eval'; require-trusted-types-for 'script'",
      },
      body: '<!doctype html><title>trusted</title><script type="module" src="/trusted.js"></script>',
    }),
  );
  await page.route("**/trusted.js", (route) =>
    route.fulfill({
      contentType: "text/javascript",
      body: `import { createWorkerModel } from "/web/sdk/dist/worker/index.js";
        const model = "/models/female/";
        const policy = trustedTypes.createPolicy("page", { createScriptURL: (url) => url });
        const thread = policy.createScriptURL("/web/sdk/dist/worker/thread.js");
        const outcome = (options) => createWorkerModel({ model, ...options }).then(
          (made) => { made.dispose(); return made.name; },
          (error) => error.code + " " + error.message,
        );
        const createWorker = () => new Worker(thread, { type: "module" });
        const outcomes = [
          await outcome({ workerScript: thread }),
          await outcome({ createWorker }),
          await outcome({}),
        ];
        document.title = outcomes.join("; ");`,
    }),
  );
  await page.goto(`${REPOSITORY_URL}/trusted`);
  await expect(page).toHaveTitle(/^female; female; worker .*workerScript/);
});
