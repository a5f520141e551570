import type { Address } from "./address.js";
import type { Capture } from "./capture.js";
import type { Hud } from "./hud.js";
import type { PageStore } from "./state.js";
import { showError } from "./toast.js";
import type { Traces } from "./traces.js";
import type { View } from "./view.js";

/** How long a picture has not changed before it counts as one that stands. */
const STANDS_AFTER_MS = 300;

/** What the loop looks at between pictures. */
export interface LoopParts {
  store: PageStore;
  view: View;
  hud: Hud;
  traces: Traces;
  capture: Capture;
  address: Address;
  /** Whether something else lies over the whole picture. */
  isCovered: () => boolean;
  /** Whether the clock of what plays stands still. */
  isPaused: () => boolean;
  /** Advances by so many seconds of real time and draws. */
  draw: (elapsedSeconds: number) => void;
}

/** Draws in every frame of the display in which there is something new to see. */
export class FrameLoop {
  readonly #parts: LoopParts;
  /** When the frame before began; null where the time since then does not count. */
  #lastFrame: number | null = null;
  /** When the picture last changed, in milliseconds. */
  #changedAt = 0;
  /** The store's revision that the picture shows. */
  #drawnRevision = -1;

  constructor(parts: LoopParts) {
    this.#parts = parts;
    document.addEventListener("visibilitychange", () => this.skip());
    requestAnimationFrame((now) => this.#frame(now));
  }

  /** The time until the next frame does not count. */
  skip(): void {
    this.#lastFrame = null;
  }

  /** The next frame draws, even where nothing moves. */
  forgetPicture(): void {
    this.#drawnRevision = -1;
  }

  /** The picture that is being drawn shows the store as it is. */
  noteDrawn(): void {
    this.#drawnRevision = this.#parts.store.revision;
  }

  #frame(now: number): void {
    requestAnimationFrame((next) => this.#frame(next));
    const elapsed = this.#lastFrame === null ? 0 : now - this.#lastFrame;
    this.#lastFrame = now;
    const { store, view, hud, traces, capture, address } = this.#parts;
    const { state } = store;
    if (document.hidden || state.hasFailed || state.isMeasuring) return;
    hud.setFact("picture", view.resolution);
    hud.show(now);
    traces.show(now);
    address.rememberCamera(now);
    if (capture.isFilming || this.#parts.isCovered()) return;
    const isStill = this.#parts.isPaused() && !this.#isStale && !view.isStale;
    if (isStill && !capture.isRecording) {
      this.#stand(now);
      return;
    }
    this.#changedAt = now;
    // Below the story nobody sees the picture.
    if (state.chapter && scrollY > innerHeight) return;
    if (elapsed > 0) hud.addInterval(elapsed);
    try {
      this.#parts.draw(elapsed / 1000);
    } catch (error) {
      store.change({ hasFailed: true });
      showError("The picture stopped; reload the page to start again", error);
    }
  }

  /** Gives a picture that stands still all its pixels, once nothing has changed for a moment. */
  #stand(now: number): void {
    const { view } = this.#parts;
    if (now - this.#changedAt < STANDS_AFTER_MS || !view.isCoarse) return;
    view.draw(true);
  }

  /** Whether the picture is no longer what the store says; a paused page draws only then. */
  get #isStale(): boolean {
    return this.#drawnRevision !== this.#parts.store.revision;
  }
}
