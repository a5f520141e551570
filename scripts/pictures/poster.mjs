// What the demo shows before its renderer is there: the first body of the story in its first pose, without a
// background, so that it suits light and dark.
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { DEMO } from "../lib/paths.mjs";
import { open } from "./open.mjs";

/**
 * A picture as high as a screen, and one as wide as a phone's, whose camera stands further away. Of sizes at which no
 * control covers a part of the picture, which would shift the body.
 */
const POSTERS = {
  wide: { width: 1600, height: 720, scale: 1 },
  tall: { width: 910, height: 1820, scale: 0.7 },
};
const QUALITY = 0.7;

/** Writes web/demo/src/poster-wide.webp and poster-tall.webp. */
export async function makePoster(browser, url) {
  const paths = [];
  for (const [name, { scale, ...viewport }] of Object.entries(POSTERS)) {
    const page = await open(browser, url, "chapter=look", viewport);
    await page.addStyleTag({
      content: "body > *:not(.stage), .wipe, .names { display: none !important }",
    });
    const path = join(DEMO, "src", `poster-${name}.webp`);
    writeFileSync(
      path,
      Buffer.from(await page.evaluate(cutOut, [...(await shoot(page)), scale, QUALITY]), "base64"),
    );
    await page.close();
    paths.push(path);
  }
  return paths.join(", ");
}

/** The body before black and before white. */
async function shoot(page) {
  await page.evaluate(() => window.dynaskinDemo.restartStory());
  const shots = [];
  for (const grey of [0, 1]) {
    await page.evaluate((level) => {
      const { view } = window.dynaskinDemo;
      const colour = [level, level, level];
      view.renderer.setBackground({ center: colour, edge: colour });
      view.setLeftShare(0);
      window.dynaskinDemo.draw();
    }, grey);
    await page.waitForTimeout(2500);
    shots.push((await page.screenshot()).toString("base64"));
  }
  return shots;
}

/** Runs in the page: what is the same before black and before white is the body; WebP in base64. */
async function cutOut([onBlack, onWhite, scale, quality]) {
  const FAINT = 0.12;
  const read = async (base64) => {
    const image = await createImageBitmap(
      await (await fetch(`data:image/png;base64,${base64}`)).blob(),
    );
    const [width, height] = [Math.round(scale * image.width), Math.round(scale * image.height)];
    const canvas = new OffscreenCanvas(width, height);
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(image, 0, 0, width, height);
    return { canvas, context, pixels: context.getImageData(0, 0, width, height) };
  };
  const [black, white] = [await read(onBlack), await read(onWhite)];
  const from = white.pixels.data;
  const to = black.pixels.data;
  for (let at = 0; at < to.length; at += 4) {
    const gap = Math.max(
      from[at] - to[at],
      from[at + 1] - to[at + 1],
      from[at + 2] - to[at + 2],
      0,
    );
    // The floor hardly shows, and takes as many bytes as the body.
    const share = (1 - gap / 255 - FAINT) / (1 - 2 * FAINT);
    const opacity = Math.min(1, Math.max(0, share));
    for (let idx = 0; idx < 3; idx += 1)
      to[at + idx] = opacity > 0 ? Math.min(255, to[at + idx] / (1 - gap / 255)) : 0;
    to[at + 3] = 255 * opacity;
  }
  black.context.putImageData(black.pixels, 0, 0);
  const blob = await black.canvas.convertToBlob({ type: "image/webp", quality });
  const bytes = new Uint8Array(await blob.arrayBuffer());
  return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
}
