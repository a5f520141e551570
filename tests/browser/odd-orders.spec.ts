// What pages do that no example does: leaving in mid-step, two of everything, forbidden workers.
import { expect, test } from "@playwright/test";
import { REPOSITORY_URL } from "./places.js";

test("a page that leaves in the middle of everything sees only our errors", async ({ page }) => {
  const noise: string[] = [];
  page.on("pageerror", (error) => noise.push(String(error)));
  page.on("console", (message) => {
    // The browser asks for an icon by itself.
    if (!message.location().url.endsWith("/favicon.ico")) noise.push(message.text());
  });
  await page.goto(`${REPOSITORY_URL}/blank`);
  const codes = await page.evaluate(async () => {
    const { load, restPose } = await import(`${location.origin}/web/sdk/dist/index.js`);
    const { createWorkerAvatar } = await import(`${location.origin}/web/sdk/dist/worker/index.js`);
    const codeOf = (work: () => unknown) =>
      Promise.resolve()
        .then(work)
        .then(
          () => "none",
          (error) => (error as { code?: string }).code ?? String(error),
        );
    const model = "/models/female/";

    // A worker that is ended while it steps, saves and loads another shape.
    const there = await createWorkerAvatar({ model });
    there.step(restPose(), 1 / 60);
    there.step(restPose(), 1 / 60);
    there.setShape(new Float32Array(10).fill(1));
    const waiting = [there.save(), there.whenAnswered()];
    there.dispose();
    const ended = await Promise.all(waiting.map((promise) => codeOf(() => promise)));

    // A worker that is ended by whom it answers.
    const other = await createWorkerAvatar({ model });
    other.step(restPose(), 1 / 60);
    const inAnswer = await codeOf(() => other.whenAnswered().then(() => other.dispose()));
    const afterwards = await codeOf(() => other.step(restPose(), 1 / 60));

    // Two models at once, one given up as soon as its body is there.
    const abort = new AbortController();
    const gaveUp = codeOf(() =>
      load({
        model: "/models/male/",
        signal: abort.signal,
        onBody: () => abort.abort(Object.assign(new Error("left"), { code: "left" })),
      }),
    );
    const [female, male] = await Promise.all([load({ model }), load({ model: "/models/male/" })]);
    const crowds = [female.createCrowd(), male.createCrowd()];
    crowds[0].add(female.createAvatar());
    crowds[1].add(male.createAvatar());
    for (const crowd of crowds) crowd.stepAll([restPose()], 1 / 60);
    crowds[0].add(crowds[1].avatars[0]);
    const foreign = await codeOf(() => crowds[0].stepAll([restPose(), restPose()], 1 / 60));
    crowds[0].remove(crowds[1].avatars[0]);
    female.dispose();
    for (const crowd of crowds) crowd.stepAll([restPose()], 1 / 60);
    const gone = await codeOf(() => female.createAvatar());

    // Left inside of a frame that goes on.
    const [avatar] = crowds[1].avatars;
    const inFrame = await codeOf(
      () =>
        new Promise((_resolve, reject) => {
          requestAnimationFrame(() => {
            try {
              avatar.dispose();
              crowds[1].stepAll([restPose()], 1 / 60);
            } catch (error) {
              reject(error);
            }
          });
        }),
    );
    for (const crowd of crowds) crowd.dispose();
    return { ended, inAnswer, afterwards, gaveUp: await gaveUp, foreign, gone, inFrame };
  });
  expect(codes).toEqual({
    ended: ["disposed", "disposed"],
    inAnswer: "none",
    afterwards: "disposed",
    gaveUp: "left",
    foreign: "argument",
    gone: "disposed",
    inFrame: "disposed",
  });
  expect(noise).toEqual([]);
});

test("where workers are forbidden, createWorkerAvatar says so", async ({ page }) => {
  await page.route("**/csp", (route) =>
    route.fulfill({
      contentType: "text/html",
      headers: { "Content-Security-Policy": "script-src 'self'; worker-src 'none'" },
      body: '<!doctype html><title>csp</title><script type="module" src="/csp.js"></script>',
    }),
  );
  await page.route("**/csp.js", (route) =>
    route.fulfill({
      contentType: "text/javascript",
      body: `import { createWorkerAvatar } from "/web/sdk/dist/worker/index.js";
        createWorkerAvatar({ model: "/models/female/" }).then(
          () => { document.title = "none"; },
          (error) => { document.title = error.code + " " + error.message; },
        );`,
    }),
  );
  await page.goto(`${REPOSITORY_URL}/csp`);
  await expect(page).toHaveTitle(/^worker .*worker-src/);
});
