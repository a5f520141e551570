// dynaskin/renderer as a page uses it: what it throws where there is no graphics card, after its end,
// and of bodies that were taken away.
import { expect, type Page, test } from "@playwright/test";
import { REPOSITORY_URL } from "./places.js";

/**
 * Opens an empty page with the SDK, a body and an avatar in it, and what the tests below use:
 * `codeOf` tells the code of what a call throws, `pixels` draws and reads the canvas.
 */
async function openStudio(page: Page): Promise<string[]> {
  const problems: string[] = [];
  page.on("pageerror", (error) => problems.push(error.message));
  await page.goto(`${REPOSITORY_URL}/blank`);
  await page.addScriptTag({ type: "module", content: STUDIO });
  await page.waitForFunction(() => "studio" in window);
  return problems;
}

const STUDIO = `
  import { load, restPose } from "/web/sdk/dist/index.js";
  import { createRenderer } from "/web/sdk/dist/renderer.js";
  const model = await load({ model: "/models/female/" });
  const avatar = model.createAvatar();
  avatar.step(restPose(), 0);
  const newCanvas = () => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [160, 200];
    document.body.append(canvas);
    return canvas;
  };
  const codeOf = async (call) => {
    try {
      await call();
      return "none";
    } catch (error) {
      return error.code ?? String(error);
    }
  };
  const start = async (options) => {
    const canvas = newCanvas();
    const renderer = await createRenderer(canvas, { backend: "webgl2", ...options });
    renderer.resize(160, 200);
    return { canvas, renderer };
  };
  const pixels = ({ canvas, renderer }) => {
    renderer.render();
    const copy = new OffscreenCanvas(160, 200).getContext("2d");
    copy.drawImage(canvas, 0, 0);
    return copy.getImageData(0, 0, 160, 200).data;
  };
  const differing = (a, b) => a.filter((value, at) => Math.abs(value - b[at]) > 4).length / a.length;
  window.studio = { avatar, codeOf, createRenderer, differing, model, newCanvas, pixels, start };
`;

// What STUDIO makes has no types here.
// biome-ignore lint/suspicious/noExplicitAny: see above
type Studio = any;
const inStudio = <T>(page: Page, work: (studio: Studio) => Promise<T>): Promise<T> =>
  page.evaluate(`(${work})(window.studio)`) as Promise<T>;

test("no-adapter, where the browser has neither WebGPU nor WebGL2", async ({ page }) => {
  await page.addInitScript(() => {
    const original = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string) {
      return kind === "webgl2" ? null : original.call(this, kind);
    } as typeof original;
    Object.defineProperty(navigator, "gpu", { value: undefined });
  });
  const problems = await openStudio(page);
  const codes = await inStudio(page, async ({ codeOf, createRenderer, newCanvas }) => [
    await codeOf(() => createRenderer(newCanvas())),
    await codeOf(() => createRenderer(newCanvas(), { backend: "webgl2" })),
    await codeOf(() => createRenderer(newCanvas(), { backend: "webgpu" })),
    await codeOf(() => createRenderer(newCanvas(), { backend: "vulkan" })),
  ]);
  expect(codes).toEqual(["no-adapter", "no-adapter", "no-adapter", "argument"]);
  expect(problems).toEqual([]);
});

test("where WebGPU was asked for in vain, the canvas can still have WebGL2", async ({ page }) => {
  await page.addInitScript(() => {
    Object.defineProperty(navigator, "gpu", { value: undefined });
  });
  const problems = await openStudio(page);
  const result = await inStudio(page, async ({ codeOf, createRenderer, newCanvas }) => {
    const canvas = newCanvas();
    const refused = await codeOf(() => createRenderer(canvas, { backend: "webgpu" }));
    const { backend } = await createRenderer(canvas);
    return [refused, backend];
  });
  expect(result).toEqual(["no-adapter", "webgl2"]);
  expect(problems).toEqual([]);
});

test("disposed, after the renderer's end", async ({ page }) => {
  const problems = await openStudio(page);
  const result = await inStudio(page, async ({ avatar, codeOf, model, start }) => {
    const { renderer } = await start();
    const body = renderer.addBody(model.body);
    body.update(avatar);
    const { lost } = renderer;
    renderer.dispose();
    renderer.dispose();
    body.remove();
    const camera = { eyeWorldM: [0, 1, 4], targetWorldM: [0, 1, 0], fovYRadians: 0.5 };
    const codes = [
      await codeOf(() => renderer.render()),
      await codeOf(() => renderer.resize(10, 10)),
      await codeOf(() => renderer.setCamera(camera)),
      await codeOf(() => renderer.setHeatMap(20)),
      await codeOf(() => renderer.addBody(model.body)),
      await codeOf(() => renderer.recover()),
      await codeOf(() => body.update(avatar)),
    ];
    return { codes, lost: await lost, vertices: avatar.positions.length };
  });
  expect(result.codes).toEqual(Array(7).fill("disposed"));
  // No loss, and the avatar is the page's own.
  expect(result.lost).toBeNull();
  expect(result.vertices).toBeGreaterThan(0);
  expect(problems).toEqual([]);
});

test("a body that is removed leaves the picture, and the others stay", async ({ page }) => {
  const problems = await openStudio(page);
  const result = await inStudio(
    page,
    async ({ avatar, codeOf, differing, model, pixels, start }) => {
      const stage = await start();
      const { renderer } = stage;
      const empty = pixels(stage);
      const first = renderer.addBody(model.body);
      first.update(avatar);
      const alone = pixels(stage);
      const second = renderer.addBody(model.body);
      second.setPlacement({ positionM: [0.7, 0, 0] });
      second.update(avatar);
      const both = pixels(stage);
      second.remove();
      second.remove();
      const left = pixels(stage);
      const codes = [
        await codeOf(() => second.update(avatar)),
        await codeOf(() => second.setVisible(true)),
        await codeOf(() => second.setPlacement({})),
        await codeOf(() => second.readSkinnedPositions()),
        await codeOf(() => first.update(avatar)),
      ];
      first.remove();
      return {
        codes,
        shown: differing(empty, alone),
        added: differing(alone, both),
        left: differing(alone, left),
        gone: differing(empty, pixels(stage)),
      };
    },
  );
  console.log(result);
  expect(result.codes).toEqual(["disposed", "disposed", "disposed", "disposed", "none"]);
  expect(result.shown).toBeGreaterThan(0.03);
  expect(result.added).toBeGreaterThan(0.03);
  expect(result.left).toBe(0);
  expect(result.gone).toBe(0);
  expect(problems).toEqual([]);
});

test("a body that is removed during a loss does not come back with the picture", async ({
  page,
}) => {
  const problems = await openStudio(page);
  const result = await inStudio(page, async ({ avatar, differing, model, pixels, start }) => {
    const stage = await start();
    const { canvas, renderer } = stage;
    const empty = pixels(stage);
    const [stays, goes] = [renderer.addBody(model.body), renderer.addBody(model.body)];
    stays.update(avatar);
    const one = pixels(stage);
    goes.setPlacement({ positionM: [0.7, 0, 0] });
    goes.update(avatar);
    const two = pixels(stage);
    const extension = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
    extension.loseContext();
    const reason = await renderer.lost;
    goes.remove();
    setTimeout(() => extension.restoreContext());
    await renderer.recover();
    return {
      reason,
      two: differing(one, two),
      after: differing(one, pixels(stage)),
      shown: differing(empty, pixels(stage)),
    };
  });
  expect(result.reason).toContain("WebGL2");
  expect(result.two).toBeGreaterThan(0.03);
  expect(result.after).toBeLessThan(0.002);
  expect(result.shown).toBeGreaterThan(0.03);
  expect(problems).toEqual([]);
});
