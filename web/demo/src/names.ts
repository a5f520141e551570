import { actorLabel } from "./actors.js";
import { byId, create } from "./dom.js";
import type { Place } from "./layer.js";
import type { Shown } from "./lineup.js";
import type { View } from "./view.js";

/** How high over the floor the names hang: a head's height over a head. */
const HEIGHT_M = 1.98;

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
    for (const [idx, element] of [...byId("names").children].entries()) {
      if (!this.#shown[idx]) continue;
      const [asideM, aheadM] = placesM[idx] ?? [0, 0];
      const { xPx, yPx } = this.#view.project([x + asideM, HEIGHT_M, z + aheadM]);
      const top = Math.max(74, yPx);
      (element as HTMLElement).style.translate =
        `calc(${xPx.toFixed(1)}px - 50%) ${top.toFixed(1)}px`;
    }
  }
}
