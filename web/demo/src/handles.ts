import { GRIPS, type Grip } from "dynaskin";
import type { ByHand } from "./by-hand.js";
import { byId } from "./dom.js";
import type { Place } from "./layer.js";
import type { View } from "./view.js";

/** How far an arrow key pulls, in metres. */
const KEY_PULL_M = 0.16;
/** What each arrow key pulls to: the picture's right and up. */
const ARROWS: Readonly<Record<string, readonly [right: number, up: number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/** A hold by pointer: where it began, and what a pixel is at the body. */
interface PointerHold {
  grip: Grip;
  pointerId: number;
  fromX: number;
  fromY: number;
  metresPerPixel: number;
}

/**
 * The rings on pelvis and chest by which the body is dragged: with the pointer, or with the arrow keys
 * for as long as they are held.
 */
export class Handles {
  readonly #view: View;
  readonly #onHold: () => void;
  #hand: ByHand | null = null;
  #pointer: PointerHold | null = null;
  readonly #arrows = new Set<string>();
  /** Whether the visitor has ever taken hold of the body. */
  #isKnown = false;
  #placeM: Place = [0, 0];
  /** How far right of where the camera looks the body is drawn, in pixels. */
  #asidePx = 0;

  /** `onHold` is called when the visitor takes hold of the body. */
  constructor(view: View, onHold: () => void) {
    this.#view = view;
    this.#onHold = onHold;
    for (const grip of GRIPS) this.#bind(grip, byId(`grip-${grip}`));
    addEventListener("blur", () => this.#release());
  }

  /** Gives the rings a body to move; null hides them. */
  attach(hand: ByHand | null): void {
    if (hand === this.#hand) return;
    this.#pointer = null;
    this.#arrows.clear();
    this.#hand = hand;
    byId("grips").hidden = hand === null;
    byId("hand-tip").hidden = hand === null || this.#isKnown;
    document.body.classList.toggle("by-hand", hand !== null);
  }

  /** Puts the keyboard's focus on the pelvis. */
  focus(): void {
    byId("grip-pelvis").focus({ preventScroll: true });
  }

  /** Puts the rings where their parts are in the picture of a body that stands away from its pose. */
  show(placeM: Place, asidePx: number): void {
    this.#placeM = placeM;
    this.#asidePx = asidePx;
    if (!this.#hand) return;
    for (const grip of GRIPS) {
      const { xPx, yPx } = this.#project(this.#hand, grip);
      byId(`grip-${grip}`).style.translate =
        `${(xPx + this.#asidePx).toFixed(1)}px ${yPx.toFixed(1)}px`;
    }
  }

  #project(hand: ByHand, grip: Grip): ReturnType<View["project"]> {
    const [x, y, z] = hand.placeOf(grip);
    return this.#view.project([x + this.#placeM[0], y, z + this.#placeM[1]]);
  }

  #bind(grip: Grip, ring: HTMLElement): void {
    ring.addEventListener("pointerdown", (event) => {
      if (this.#pointer || !this.#hand || event.button !== 0) return;
      event.preventDefault();
      ring.setPointerCapture(event.pointerId);
      ring.focus({ preventScroll: true });
      const { metresPerPixel } = this.#project(this.#hand, grip);
      const { pointerId, clientX: fromX, clientY: fromY } = event;
      this.#pointer = { grip, pointerId, fromX, fromY, metresPerPixel };
      this.#pull(grip, 0, 0);
      this.#onHold();
    });
    ring.addEventListener("pointermove", (event) => {
      const hold = this.#pointer;
      if (hold?.pointerId !== event.pointerId) return;
      const [dx, dy] = [event.clientX - hold.fromX, event.clientY - hold.fromY];
      this.#pull(hold.grip, dx * hold.metresPerPixel, -dy * hold.metresPerPixel);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      ring.addEventListener(end, (event) => {
        if (this.#pointer?.pointerId === event.pointerId) this.#release();
      });
    }
    ring.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.#release();
      if (!(event.key in ARROWS)) return;
      event.preventDefault();
      if (this.#arrows.has(event.key)) return;
      this.#arrows.add(event.key);
      this.#pullByKeys(grip);
      this.#onHold();
    });
    ring.addEventListener("keyup", (event) => {
      if (!this.#arrows.delete(event.key)) return;
      if (this.#arrows.size === 0) this.#release();
      else this.#pullByKeys(grip);
    });
    ring.addEventListener("blur", () => this.#release());
    ring.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  #pullByKeys(grip: Grip): void {
    let [right, up] = [0, 0];
    for (const key of this.#arrows) {
      right += ARROWS[key]?.[0] ?? 0;
      up += ARROWS[key]?.[1] ?? 0;
    }
    this.#pull(grip, right * KEY_PULL_M, up * KEY_PULL_M);
  }

  #pull(grip: Grip, rightM: number, upM: number): void {
    this.#hand?.hold(grip, this.#view.camera.shiftM(rightM, upM));
    this.#isKnown = true;
    byId("hand-tip").hidden = true;
    for (const name of GRIPS) byId(`grip-${name}`).classList.toggle("held", name === grip);
  }

  #release(): void {
    this.#pointer = null;
    this.#arrows.clear();
    this.#hand?.release();
    for (const grip of GRIPS) byId(`grip-${grip}`).classList.remove("held");
  }
}
