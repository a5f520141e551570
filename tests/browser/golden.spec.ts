// The WebAssembly gives the native runtime's offsets, in the browser's engine as well.
import { expect, test } from "@playwright/test";
import { REPOSITORY_URL } from "./places.js";

for (const name of ["female", "male"]) {
  test(`${name} hops as the native runtime makes it hop`, { tag: "@published" }, async ({
    page,
  }) => {
    await page.goto(`${REPOSITORY_URL}/blank`);
    const { largestUm, worstUm, frames } = await page.evaluate(async (name) => {
      const [sdk, { replay }] = await Promise.all([
        import(`${location.origin}/web/sdk/dist/index.js`),
        import(`${location.origin}/tests/golden/replay.js`),
      ]);
      const golden = await (await fetch(`/tests/golden/${name}-hop.json`)).json();
      const model = await sdk.load({ model: `${location.origin}/models/${name}/` });
      return replay(sdk, model, golden) as { largestUm: number; worstUm: number; frames: number };
    }, name);
    console.log(`${name}: offsets to ${largestUm.toFixed(0)} µm, off by ${worstUm.toFixed(2)} µm`);
    expect(frames).toBe(300);
    expect(largestUm).toBeGreaterThan(2000);
    expect(worstUm).toBeLessThanOrEqual(10);
  });
}
