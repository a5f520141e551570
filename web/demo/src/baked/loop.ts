import { CLOSE_UP, JUMP, LANDING } from "../chapters.js";
import { byId } from "../dom.js";
import { lessMotion } from "../less-motion.js";
import type { PageStore } from "../state.js";
import { closeUpFraming } from "../view.js";
import { readBaked } from "./file.js";
import { BakedPicture } from "./picture.js";

/** How long the live picture takes to come through. */
const FADE_MS = 240;
/** As on the live canvases. */
const MAX_PIXEL_RATIO = 2;
/** A longer pause is a hidden tab. */
const LONGEST_FRAME_SECONDS = 0.25;
/** What the browser's timeline calls the second picture; `npm run bench:first-view` looks for it. */
const MOVES = "dynaskin: the body moves";
/** Screens on which the camera stands further away, as for the poster in index.html. */
const TALL = matchMedia("(max-aspect-ratio: 78/100)");
const DARK = matchMedia("(prefers-color-scheme: dark)");

/**
 * What the page plays until its renderer, body and networks are there: the story's jump, drawn from a small file that
 * `npm run pictures -- baked` makes of the live picture. It is no part of what the page says works: without it the
 * poster stays.
 */
export class BakedLoop {
  readonly #store: PageStore;
  readonly #canvas = byId<HTMLCanvasElement>("baked");
  #picture: BakedPicture | null = null;
  #timeSeconds = lessMotion.matches ? LANDING.peakSeconds : JUMP.fromSeconds;
  #lastMs: number | null = null;
  #hasMoved = false;
  #isOver = false;
  /** The live motion's clock, once the live picture lies beneath. */
  #live: (() => number) | null = null;

  /** Begins at once where the page begins with the story, and otherwise does nothing. */
  constructor(store: PageStore) {
    this.#store = store;
    if (!document.documentElement.classList.contains("first-view")) {
      this.#isOver = true;
      return;
    }
    // A browser without WebGL2, or a file that was not sent: the poster stays until the body comes.
    this.#open().catch(() => this.end());
    // Whoever turns the camera, or leaves what the loop shows, wants the live body.
    byId("view").addEventListener("pointerdown", () => this.end());
    byId("view").addEventListener("keydown", () => this.end());
    this.#canvas.addEventListener("webglcontextlost", () => this.end());
    store.show(() => {
      const { chapter, sex, held, hasFailed } = store.state;
      if (chapter !== "look" || sex !== "female" || held !== null || hasFailed) this.end();
    });
  }

  /** Whether it is what the visitor sees, and the live picture need not be drawn yet. */
  get isShown(): boolean {
    return this.#picture !== null && !this.#isOver && this.#live === null;
  }

  /** The moment of the motion that it shows, in seconds; null: nothing has been shown. */
  get timeSeconds(): number | null {
    return this.#picture && !this.#isOver ? this.#timeSeconds : null;
  }

  /** Fades, with the clock of the live motion, whose picture has been drawn beneath. */
  handOver(liveSeconds: () => number): void {
    if (this.#isOver || this.#live) return;
    if (!this.#picture) {
      this.end();
      return;
    }
    this.#live = liveSeconds;
    this.#canvas.style.transition = `opacity ${FADE_MS}ms linear`;
    this.#canvas.style.opacity = "0";
    setTimeout(() => this.end(), FADE_MS);
  }

  /** Takes it away. */
  end(): void {
    if (this.#isOver) return;
    this.#isOver = true;
    document.documentElement.classList.remove("baked-on");
    this.#picture?.dispose();
    this.#canvas.remove();
  }

  async #open(): Promise<void> {
    const name = TALL.matches ? "tall" : "wide";
    const answer = await fetch(FILES[name]);
    if (!answer.ok) throw new Error(`${answer.url} was answered with ${answer.status}.`);
    const file = readBaked(new Uint8Array(await answer.arrayBuffer()));
    // The live body was faster.
    if (!document.documentElement.classList.contains("first-view")) this.end();
    if (this.#isOver) return;
    this.#picture = new BakedPicture(this.#canvas, file);
    requestAnimationFrame((now) => this.#frame(now));
  }

  #frame(nowMs: number): void {
    if (this.#isOver || !this.#picture) return;
    requestAnimationFrame((next) => this.#frame(next));
    const elapsed = this.#lastMs === null ? 0 : (nowMs - this.#lastMs) / 1000;
    this.#lastMs = nowMs;
    const { paused, split } = this.#store.state;
    if (!paused) this.#timeSeconds += Math.min(elapsed, LONGEST_FRAME_SECONDS);
    const { fromSeconds, periodSeconds } = JUMP;
    if (this.#timeSeconds >= fromSeconds + periodSeconds) this.#timeSeconds -= periodSeconds;
    if (this.#live) this.#timeSeconds = this.#live();
    const moment = (this.#timeSeconds - fromSeconds) / periodSeconds;
    const [, , distanceM] = CLOSE_UP;
    const pixelRatio = Math.min(devicePixelRatio, MAX_PIXEL_RATIO);
    const framing = closeUpFraming(this.#canvas, distanceM);
    this.#picture.draw(moment, split, framing, pixelRatio, DARK.matches);
    document.documentElement.classList.add("baked-on");
    if (elapsed > 0 && !paused && !this.#hasMoved) performance.mark(MOVES);
    this.#hasMoved ||= elapsed > 0;
  }
}

const FILES = {
  wide: new URL("./loop-wide.bin", import.meta.url).href,
  tall: new URL("./loop-tall.bin", import.meta.url).href,
};
