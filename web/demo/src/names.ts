import { actorLabel } from "./actors.js";
import { byId, create } from "./dom.js";
import type { Place } from "./layer.js";
import type { Shown } from "./lineup.js";
import type { View } from "./view.js";

/** How high over the floor the names hang: a head's height over a head. */
const HEIGHT_M = 1.98;
/** Names of neighbours do not touch; a long one takes two lines. */
const GAP_PX = 6;
const LEAST_WIDTH_PX = 64;
const MOST_WIDTH_PX = 240;
/** Where the page's title ends. */
const BELOW_TITLE_PX = 112;

/** The names over the actors that stand beside each other. */
export class Names {
  readonly #view: View;
  #shown: readonly Shown[] = [];

  constructor(view: View) {
    this.#view = view;
  }

  /** Names these actors; none hides the names. */
  set(shown: readonly Shown[]): void {
    this.#shown = shown;
    byId("names").replaceChildren(
      ...shown.map(({ slot, kind }) =>
        create("span", { className: `name over of-${slot}`, textContent: actorLabel(kind) }),
      ),
    );
  }

  /** Puts the names over the actors, which stand so far from the body that the camera follows. */
  show(placesM: readonly Place[]): void {
    const { x, z } = this.#view.camera.floorM;
    const over = this.#shown.map((_, idx) => {
      const [asideM, aheadM] = placesM[idx] ?? [0, 0];
      return this.#view.project([x + asideM, HEIGHT_M, z + aheadM]);
    });
    const apartPx = over.slice(1).map(({ xPx }, idx) => Math.abs(xPx - (over[idx]?.xPx ?? 0)));
    const widthPx = Math.max(LEAST_WIDTH_PX, Math.min(MOST_WIDTH_PX, ...apartPx) - GAP_PX);
    for (const [idx, { xPx, yPx }] of over.entries()) {
      const element = byId("names").children[idx] as HTMLElement | undefined;
      if (!element) continue;
      const bottomPx = Math.max(BELOW_TITLE_PX, yPx);
      element.style.maxWidth = `${widthPx.toFixed(0)}px`;
      element.style.translate = `calc(${xPx.toFixed(1)}px - 50%) calc(${bottomPx.toFixed(1)}px - 100%)`;
    }
  }
}
