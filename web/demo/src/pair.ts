import { aloneOf, type PageStore } from "./state.js";
import type { View } from "./view.js";

/** Nearer than this, a row of two leaves the picture, in metres. */
const NEAR_M = 2.6;

/**
 * Gives two actors beside each other a camera each while it is close to them: one between them would see neither.
 * They have it from the picture on in which the second canvas is there.
 */
export function pairUp(store: PageStore, view: View): void {
  const { state } = store;
  const { shownLayout, shown, cast, chapter } = state;
  const isClosePair =
    chapter === null &&
    shownLayout === "side" &&
    shown.length === 2 &&
    cast !== null &&
    aloneOf(state) === null &&
    view.camera.distanceM < NEAR_M;
  // What fails here has failed for the first canvas as well, which says so.
  if (isClosePair && !view.hasLeft) view.openLeft().catch(() => {});
  const isPaired = isClosePair && view.hasLeft;
  if (isPaired === state.isPaired) return;
  view.setPaired(isPaired);
  store.change({ isPaired });
}
