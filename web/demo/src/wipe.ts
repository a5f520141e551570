import { byId } from "./dom.js";
import { bindHold } from "./hold.js";
import { coveredPixels } from "./view.js";

const KEY_STEP = 0.02;

/** What the divider tells the page. */
export interface WipeActions {
  /** The left actor now has this share of the canvas, from its left edge. */
  setLeftShare(share: number): void;
  /** The visitor has moved the divider: share of the picture's free width. */
  setSplit(split: number): void;
  /** A name is held, or let go: to show this actor alone, or both again. */
  hold(side: "left" | "right" | null): void;
}

/**
 * The divider between two actors, dragged or moved with the arrow keys, and their names, which show
 * one actor alone for as long as they are held.
 */
export class Wipe {
  readonly #actions: WipeActions;
  readonly #divider = byId("divider");
  #split: number;
  #on = false;
  #held: "left" | "right" | null = null;

  constructor(split: number, actions: WipeActions) {
    this.#split = split;
    this.#actions = actions;
    this.#bindDivider();
    this.#bindName("left");
    this.#bindName("right");
    addEventListener("resize", () => this.#show());
  }

  /** Shows the divider, or one actor alone. */
  setOn(on: boolean): void {
    this.#on = on;
    this.#held = null;
    byId("wipe").hidden = !on;
    this.#show();
  }

  /** Names the actors. */
  setNames(left: string, right: string): void {
    byId("name-left-text").textContent = left;
    byId("name-right-text").textContent = right;
  }

  /** Shows one actor alone; null: both again. */
  hold(side: "left" | "right" | null): void {
    if (!this.#on || side === this.#held) return;
    this.#held = side;
    for (const name of ["left", "right"] as const) {
      byId(`name-${name}`).setAttribute("aria-pressed", `${name === side}`);
    }
    this.#show();
  }

  /** Width of the picture that nothing covers, in pixels. */
  get #freeWidthPx(): number {
    return innerWidth - coveredPixels().right;
  }

  #show(): void {
    const split = this.#held === "left" ? 1 : this.#held === "right" ? 0 : this.#split;
    const x = split * this.#freeWidthPx;
    byId("wipe").style.setProperty("--x", `${x.toFixed(1)}px`);
    byId("wipe").classList.toggle("held", this.#held !== null);
    const percent = Math.round(this.#split * 100);
    this.#divider.setAttribute("aria-valuenow", `${percent}`);
    this.#divider.setAttribute("aria-valuetext", `${percent} % of the picture is the left actor`);
    // What the panel covers belongs to the side that is shown alone.
    const share = this.#held === "left" ? 1 : x / innerWidth;
    this.#actions.setLeftShare(this.#on ? share : 0);
  }

  #move(split: number): void {
    this.#split = Math.max(0, Math.min(1, split));
    this.#show();
    this.#actions.setSplit(this.#split);
  }

  #bindDivider(): void {
    const divider = this.#divider;
    divider.addEventListener("pointerdown", (event) => {
      divider.setPointerCapture(event.pointerId);
      event.preventDefault();
      divider.focus({ preventScroll: true });
    });
    divider.addEventListener("pointermove", (event) => {
      if (!divider.hasPointerCapture(event.pointerId)) return;
      this.#move(event.clientX / this.#freeWidthPx);
    });
    divider.addEventListener("dblclick", () => this.#move(0.5));
    divider.addEventListener("keydown", (event) => {
      const moves: Record<string, number> = {
        ArrowLeft: this.#split - KEY_STEP,
        ArrowRight: this.#split + KEY_STEP,
        Home: 0,
        End: 1,
      };
      const split = moves[event.key];
      if (split === undefined) return;
      event.preventDefault();
      this.#move(split);
    });
  }

  #bindName(side: "left" | "right"): void {
    bindHold(byId(`name-${side}`), (held) => this.#actions.hold(held ? side : null));
  }
}
