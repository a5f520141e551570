import type { Avatar, Model } from "dynaskin";
import type { App } from "./app.js";
import { JUMP } from "./chapters.js";
import type { Extent } from "./extent.js";
import type { Sample } from "./traces.js";
import type { View } from "./view.js";

/**
 * `window.dynaskinDemo`: what tests and curious readers of the console look at.
 *
 * It shows the page's own objects; the methods do what the transport bar does, at exact moments.
 */
export interface DemoHook {
  /** True once the networks are loaded and the avatar plays with them. */
  readonly ready: boolean;
  /** The graphics interface in use. */
  readonly backend: string;
  /** The avatar on the screen; of several, the right one of a divider or the second. */
  readonly avatar: Avatar | null;
  /** The avatar left of the divider, or the first of several; null where there is one alone. */
  readonly leftAvatar: Avatar | null;
  /** dynaskin's own model of the body, once it is there. */
  readonly model: Model | null;
  /** What the plots show: moments in millimetres. */
  readonly samples: readonly Sample[];
  /** Where the bodies are in the picture, in the order of the actors, in CSS pixels. */
  readonly bodiesPx: readonly Extent[];
  /** Seconds into the motion. */
  readonly timeSeconds: number;
  /** The moment of the motion that the baked loop shows; null before and after it. */
  readonly bakedSeconds: number | null;
  /** Length of the motion in seconds. */
  readonly durationSeconds: number;
  /** How often the motion has been played to its end. */
  readonly rounds: number;
  /** The canvas with its camera and renderer. */
  readonly view: View;
  /** Goes on with the settings of a link (`?motion=hop`), but for its graphics; resolves when they are shown. */
  open(search: string): Promise<void>;
  /** Pauses, and shows the motion at this moment with the tissue stepped from its beginning. */
  seek(timeSeconds: number): void;
  /** Pauses, and goes to the beginning of the story's first jump. */
  restartStory(): void;
  /** Pauses, and lets so many seconds of the story pass: at its own speed, with slow motion. */
  advanceStory(seconds: number): void;
  /** The part of the jump that the story plays over and over, in seconds of the motion. */
  readonly jump: { readonly fromSeconds: number; readonly periodSeconds: number };
  /** Draws now. */
  draw(): void;
  /** Largest distance in the picture between the same point of the first two actors, in CSS pixels. */
  readonly gapPx: number;
  /** Pauses, and advances by one tick, 1/60 s. */
  step(): void;
  /** Pauses, and lets one tick pass in the present pose: a body that stands still settles. */
  hold(): void;
  /** Pauses, goes over into the rest pose within a second, and stands in it for `seconds`. */
  standAtRest(seconds: number): void;
}

declare global {
  interface Window {
    dynaskinDemo?: DemoHook;
  }
}

/** Puts the hook in place. */
export function installHook(app: App, view: View): void {
  const pause = () => {
    if (!app.store.state.paused) document.getElementById("play")?.click();
  };
  window.dynaskinDemo = {
    get ready() {
      return app.store.state.isComplete;
    },
    get backend() {
      return view.renderer.backend;
    },
    get avatar() {
      return app.mainAvatar;
    },
    get leftAvatar() {
      return app.avatarAt("left");
    },
    get model() {
      return app.store.state.cast?.model ?? null;
    },
    get samples() {
      return app.stage.traces.samples;
    },
    get bodiesPx() {
      return app.bodiesPx;
    },
    get timeSeconds() {
      return app.playback?.timeSeconds ?? 0;
    },
    get bakedSeconds() {
      return app.bakedSeconds;
    },
    get durationSeconds() {
      return app.playback?.motion.durationSeconds ?? 0;
    },
    get rounds() {
      return app.playback?.rounds ?? 0;
    },
    view,
    open: (search) => app.openLink(search),
    seek(timeSeconds) {
      pause();
      app.applyChanges();
      app.playback?.seek(timeSeconds, 0);
      app.draw(0);
    },
    jump: JUMP,
    draw: () => app.draw(0),
    get gapPx() {
      return app.gapPx;
    },
    restartStory() {
      pause();
      app.restartStory();
    },
    advanceStory(seconds) {
      pause();
      app.advanceStory(seconds);
    },
    step() {
      pause();
      app.playback?.step();
    },
    hold() {
      pause();
      app.playback?.hold();
    },
    standAtRest(seconds) {
      pause();
      app.playback?.standAtRest(seconds);
    },
  };
}
