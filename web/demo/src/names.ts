import { nameOf } from "./actors.js";
import { byId, create } from "./dom.js";
import { bindHold } from "./hold.js";
import type { Place } from "./layer.js";
import type { Shown } from "./state.js";
import { coveredPixels, type View } from "./view.js";

/** How high over the top of a head its name hangs, in metres. */
const OVER_HEAD_M = 0.1;
/** Share of the way down to the head that a name covers per second; up it goes at once. */
const SINK_PER_SECOND = 1.2;
/** Names of neighbours do not touch; a long one takes two lines. */
const GAP_PX = 6;
const LEAST_WIDTH_PX = 64;
const MOST_WIDTH_PX = 240;
/** A narrower name is shown without its key: "dynaskin" beside one would be cut off. */
const WITH_KEY_PX = 112;
/** Letters get no smaller than this where a word is wider than its name. */
const LEAST_LETTERS_PX = 9;
/** From the page's title, or the top of the window, to the lower edge of a name. */
const BELOW_EDGE_PX = 38;

/** How far below its place over a head a name may hang, in pixels. */
const LOST_PX = 24;

/** The keys that show an actor alone, where one does. */
const KEYS: Partial<Record<Shown["slot"], string>> = { left: "A", right: "B" };

/** The names over the actors; one that is held shows its actor alone. */
export class Names {
  readonly #view: View;
  readonly #hold: (slot: Shown["slot"] | null) => void;
  #shown: readonly Shown[] = [];
  /** Heights of the names over the floor, in metres. */
  #heightsM: number[] = [];
  #isAlone = false;
  /** Where the page's title ends, in pixels. */
  #title = { right: 0, bottom: 0 };

  constructor(view: View, hold: (slot: Shown["slot"] | null) => void) {
    this.#view = view;
    this.#hold = hold;
    const brand = document.querySelector<HTMLElement>(".brand");
    new ResizeObserver(() => {
      if (brand) this.#title = brand.getBoundingClientRect();
    }).observe(brand ?? document.body);
  }

  /** Names these actors; none hides the names. */
  set(shown: readonly Shown[]): void {
    this.#shown = shown;
    this.#heightsM = [];
    byId("names").replaceChildren(...shown.map((actor) => this.#create(actor)));
  }

  #create({ slot }: Shown): HTMLElement {
    const key = shownKey(slot, this.#shown.length);
    const name = create("button", { className: `name over of-${slot}`, type: "button" }, [
      ...(key ? [create("kbd", { textContent: key })] : []),
      create("span"),
    ]);
    name.setAttribute("aria-pressed", "false");
    name.setAttribute("aria-describedby", "name-note");
    bindHold(name, (held) => this.#hold(held ? slot : null));
    return name;
  }

  /** Writes the names; `isMoved`: whether anything moves the skin of the actors. */
  label(isMoved: boolean): void {
    for (const [idx, { kind, label }] of this.#shown.entries()) {
      const text = this.#element(idx)?.querySelector("span");
      if (text) text.textContent = label ?? nameOf(kind, isMoved);
    }
  }

  /** Shows the name of the one that is held only, pressed; null: all. */
  setHeld(slot: Shown["slot"] | null, isAlone: boolean): void {
    this.#isAlone = isAlone;
    for (const [idx, actor] of this.#shown.entries()) {
      const element = this.#element(idx);
      element?.setAttribute("aria-pressed", `${actor.slot === slot}`);
      element?.classList.toggle("away", isAlone && actor.slot !== slot);
    }
  }

  /**
   * Hangs the names over heads, whose tops are at `crownsM` and which stand so far from there; for a
   * frame of so many seconds, 0 after a jump in time.
   */
  show(
    crownsM: readonly (readonly [number, number, number])[],
    placesM: readonly Place[],
    elapsedSeconds: number,
  ): void {
    const share = elapsedSeconds === 0 ? 1 : 1 - Math.exp(-SINK_PER_SECOND * elapsedSeconds);
    const over = this.#shown.map((_, idx) => {
      const [x, y, z] = crownsM[idx] ?? [0, 0, 0];
      const [asideM, aheadM] = placesM[idx] ?? [0, 0];
      // A name that went up and down with a body that hops could not be read.
      const before = this.#heightsM[idx] ?? y;
      const heightM = y > before ? y : before + (y - before) * share;
      this.#heightsM[idx] = heightM;
      const head = this.#view.project([x + asideM, heightM + OVER_HEAD_M, z + aheadM]);
      return { ...head, xPx: head.xPx + this.#view.asidePx(idx === 0 ? "left" : "right") };
    });
    const apartPx = over.slice(1).map(({ xPx }, idx) => Math.abs(xPx - (over[idx]?.xPx ?? 0)));
    const roomPx = this.#isAlone ? MOST_WIDTH_PX : Math.min(MOST_WIDTH_PX, ...apartPx);
    const widthPx = Math.max(LEAST_WIDTH_PX, roomPx - GAP_PX);
    const isBelowTitle = over.some(({ xPx }) => xPx - widthPx / 2 < this.#title.right);
    const highestPx = (isBelowTitle ? this.#title.bottom : 0) + BELOW_EDGE_PX;
    const leastPx = this.#shown.length > 1 ? this.#view.coveredLeftPx : 0;
    const freePx = innerWidth - Math.max(0, coveredPixels().right);
    for (const [idx, { xPx: headPx, yPx }] of over.entries()) {
      const element = this.#element(idx);
      if (!element) continue;
      fit(element, Math.floor(widthPx));
      // Not under the panel, as far as there is room beside it.
      const half = element.offsetWidth / 2;
      const xPx = Math.max(leastPx + half, Math.min(headPx, freePx - half));
      const bottomPx = Math.max(highestPx, yPx);
      // Where it has no room over the head, the name of one alone would cover the face for nothing.
      const isLost = this.#shown.length === 1 && bottomPx > yPx + LOST_PX;
      element.style.visibility = isLost ? "hidden" : "";
      element.style.translate = `calc(${xPx.toFixed(1)}px - 50%) calc(${bottomPx.toFixed(1)}px - 100%)`;
    }
  }

  #element(idx: number): HTMLElement | undefined {
    return byId("names").children[idx] as HTMLElement | undefined;
  }
}

/**
 * Gives a name its room. Fonts differ from machine to machine, so a word that is wider than the room is measured and
 * gets smaller letters.
 */
function fit(element: HTMLElement, roomPx: number): void {
  const text = element.querySelector("span");
  const fitted = `${roomPx} ${text?.textContent}`;
  if (!text || element.dataset.fitted === fitted) return;
  element.style.maxWidth = `${roomPx}px`;
  element.style.fontSize = "";
  element.classList.toggle("tight", roomPx < WITH_KEY_PX);
  const wordPx = text.scrollWidth;
  if (wordPx > text.clientWidth) {
    // Widths are whole pixels: one less, and nothing is cut.
    const share = (text.clientWidth - 1) / wordPx;
    const lettersPx = share * Number.parseFloat(getComputedStyle(element).fontSize);
    element.style.fontSize = `${Math.max(LEAST_LETTERS_PX, lettersPx).toFixed(2)}px`;
  }
  // Where nothing is laid out there is no width to go by.
  if (wordPx > 0) element.dataset.fitted = fitted;
}

/** The key beside a name: of the first two of a row, and of one alone the key that takes its tissue away. */
function shownKey(slot: Shown["slot"], count: number): string | undefined {
  return count === 1 ? KEYS.left : KEYS[slot];
}
