import {
  CHAPTER_TEXTS,
  CHAPTERS,
  type Chapter,
  chapterSettings,
  isLoop,
  JUMP,
  LANDING,
  stillShare,
  storyFigure,
  storySpeed,
} from "./chapters.js";
import { byId } from "./dom.js";
import type { Ghost } from "./ghost.js";
import { lessMotion } from "./less-motion.js";
import type { Playback } from "./playing.js";
import { isDivided, type PageStore } from "./state.js";
import type { View } from "./view.js";
import { coefficientsOf } from "./words.js";

/** How far from the body's middle the divider goes, in metres. */
const WIPE_M = 0.17;
/** And at most, as a share of the picture's width. */
const WIPE_SHARE = 0.4;
/** How much of the body's rise and fall the camera follows, so that a jump stays in a close picture. */
const FOLLOW_SHARE: Readonly<Record<Chapter, number>> = {
  look: 0.85,
  ghost: 0.85,
  bodies: 0,
  grab: 0,
};

/** What the page begins with: chapters that play by themselves until the visitor takes over. */
export class Story {
  readonly #store: PageStore;
  readonly #view: View;
  readonly #ghost: Ghost;
  /** Whether the divider moves by itself. */
  #isDirected = true;
  /** Whether the visitor has let it play. */
  #hasBegun = false;

  constructor(store: PageStore, view: View, ghost: Ghost) {
    this.#store = store;
    this.#view = view;
    this.#ghost = ghost;
    for (const chapter of CHAPTERS) {
      byId(`chapter-${chapter}`).addEventListener("click", () => this.go(chapter));
    }
    // On phones the names stand over the text, whose height depends on what it says.
    const text = byId("story-title").parentElement;
    new ResizeObserver(() => {
      const topPx = text?.getBoundingClientRect().top ?? 0;
      if (topPx > 0) byId("wipe").style.setProperty("--above-text", `${innerHeight - topPx}px`);
    }).observe(text ?? document.body);
    byId("story-lab").addEventListener("click", () => this.leave());
    byId("lab-leave").addEventListener("click", () => this.go("look"));
    byId("story-play").addEventListener("click", () => {
      this.#isDirected = true;
      this.#hasBegun = true;
      store.change({ paused: !store.state.paused });
    });
    // Whoever touches the picture or the divider has it from then on.
    for (const id of ["view", "divider"]) {
      for (const type of ["pointerdown", "keydown"]) {
        byId(id).addEventListener(type, (event) => this.#takeOver(event));
      }
    }
    store.show(() => this.#show());
    if (store.state.chapter) this.#placeCamera();
  }

  #placeCamera(): void {
    const { camera } = this.#view;
    camera.home = this.#store.state.camera;
    camera.reset();
  }

  /** Goes to a chapter. */
  go(chapter: Chapter): void {
    this.#isDirected = true;
    this.#store.change({
      held: null,
      file: null,
      fileBefore: null,
      ...chapterSettings(chapter),
    });
    this.#placeCamera();
    if (scrollY > 0) scrollTo({ top: 0 });
  }

  /** Opens the Lab with what the story shows. */
  leave(): void {
    const { chapter, layout, cast } = this.#store.state;
    if (!chapter) return;
    this.#view.camera.home = null;
    this.#view.camera.reset();
    this.#store.change({
      ...{ chapter: null, camera: null, split: 0.5, speed: 1, caption: false },
      layout: layout === "one" ? "one" : "side",
      ...(cast && { shape: coefficientsOf(cast.body, storyFigure(cast.sex)) }),
    });
    scrollTo({ top: 0 });
  }

  /** Sets the clock for the chapter's next picture. */
  direct(playback: Playback): void {
    const { chapter, speed } = this.#store.state;
    playback.loop = isLoop(chapter) ? JUMP : null;
    playback.speed = isLoop(chapter) ? storySpeed(playback.timeSeconds, playback.rounds) : speed;
  }

  /** Moves the camera to where the body is now, and the divider if time passes. */
  follow(playback: Playback, timePasses = !playback.paused): void {
    const { chapter } = this.#store.state;
    const { camera } = this.#view;
    camera.riseM = chapter ? FOLLOW_SHARE[chapter] * (playback.pose[1] ?? 0) : 0;
    if (chapter !== "look" || !this.#isDirected || !timePasses) return;
    if (!isDivided(this.#store.state)) return;
    const share = playback.rounds === 0 ? 0 : stillShare(playback.timeSeconds);
    const { metresPerPixel } = this.#view.project(camera.targetWorldM);
    const reach = Math.min(WIPE_SHARE, WIPE_M / (metresPerPixel * Math.max(1, innerWidth)));
    this.#store.change({ split: 0.5 - reach * Math.sin(2 * Math.PI * share) });
  }

  /** Draws what lies over the picture. */
  draw(playback: Playback): void {
    const { chapter, cast, shown } = this.#store.state;
    const [plain, moved] = playback.avatars;
    if (chapter !== "ghost" || !cast || !plain || !moved || shown.length !== 2) {
      this.#ghost.clear();
      return;
    }
    this.#ghost.draw(cast.body, plain, moved);
  }

  /** Where the motion begins: so that the first landing comes at once, or stands still. */
  get startSeconds(): number {
    return lessMotion.matches && !this.#hasBegun ? LANDING.peakSeconds : JUMP.fromSeconds;
  }

  #takeOver(event: Event): void {
    if (event instanceof KeyboardEvent && !/^(Arrow|Page|Home|End|[+-]$)/.test(event.key)) return;
    this.#isDirected = false;
  }

  #show(): void {
    const { chapter, paused, isComplete } = this.#store.state;
    document.documentElement.classList.toggle("story-on", chapter !== null);
    document.documentElement.dataset.chapter = chapter ?? "lab";
    for (const each of CHAPTERS) {
      const button = byId(`chapter-${each}`);
      if (each === chapter) button.setAttribute("aria-current", "step");
      else button.removeAttribute("aria-current");
    }
    const play = byId("story-play");
    play.classList.toggle("paused", paused);
    play.setAttribute("aria-label", paused ? "Play" : "Pause");
    byId("story-still").hidden = !(paused && lessMotion.matches);
    if (!chapter) return;
    const { title, line } = CHAPTER_TEXTS[chapter];
    byId("story-title").textContent = title;
    byId("story-line").textContent = isComplete ? line : `${line} The tissue is being loaded.`;
  }
}
