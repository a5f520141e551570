// The moving picture of README: one round of the story, its end like its beginning.
import { createRequire } from "node:module";
import { join } from "node:path";
import { ROOT } from "../lib/paths.mjs";
import { advance, open } from "./open.mjs";

const FRAMES_PER_SECOND = 20;
const VIEWPORT = { width: 1000, height: 640 };
/** As wide as the names go, which the divider takes along. */
const CLIP = { x: 110, y: 0, width: 780, height: 560 };
/** Without what is there to be clicked: a picture answers no clicks. */
const STYLE =
  "body > *:not(.stage), kbd, .divider::after { display: none !important }" +
  ".wipe { --name-bottom: 96px !important }";
/** A round takes about three seconds; more than this is a fault. */
const MOST_FRAMES = 5 * FRAMES_PER_SECOND;
/** Less, and what moved before stays behind as blocks. */
const WEBP = { quality: 92, effort: 5, loop: 0 };

const roundOf = (page) => page.evaluate(() => window.dynaskinDemo.rounds);

/** Writes docs/loop.webp with the encoder in a folder of node_modules. */
export async function makeLoop(browser, url, tools) {
  // The folder is no parent of this one: its packages are found from there.
  const sharp = createRequire(join(tools, "package.json"))("sharp");
  const page = await open(browser, url, "chapter=look", VIEWPORT);
  await page.addStyleTag({ content: STYLE });
  await page.evaluate(() => window.dynaskinDemo.restartStory());
  // The first round is in real time: the tissue swings as in all later ones after it.
  while ((await roundOf(page)) < 2) await advance(page, 1 / FRAMES_PER_SECOND);
  const frames = [];
  while ((await roundOf(page)) < 3 && frames.length < MOST_FRAMES) {
    frames.push(await page.screenshot({ clip: CLIP }));
    await advance(page, 1 / FRAMES_PER_SECOND);
  }
  if (frames.length === MOST_FRAMES) throw new Error("The story's round does not end.");
  await page.close();
  const path = join(ROOT, "docs", "loop.webp");
  await sharp(frames, { join: { animated: true } })
    .webp({ ...WEBP, delay: frames.map(() => 1000 / FRAMES_PER_SECOND) })
    .toFile(path);
  return path;
}
