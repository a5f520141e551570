import { describeActors } from "./about.js";
import { nameOf } from "./actors.js";
import { describeDifference } from "./caption.js";
import { drawLegend, HEAT_SCALES } from "./legend.js";
import type { Names } from "./names.js";
import { aloneOf, isMoved, type PageStore, showsError, wantedActors } from "./state.js";
import { regionLabel } from "./tissue-panel.js";
import type { Traces } from "./traces.js";
import type { View } from "./view.js";
import type { Wipe } from "./wipe.js";

/** What is shown beside the actors. */
export interface Readings {
  view: View;
  names: Names;
  wipe: Wipe;
  traces: Traces;
}

/** Keeps names, heat map, caption and the titles of plots as the store says. */
export function showReadings(store: PageStore, { view, names, wipe, traces }: Readings): void {
  const { state } = store;
  store.show(() => {
    const shown = showsError(state) ? "error" : "offset";
    drawLegend(shown);
    view.setHeat(state.heat ? HEAT_SCALES[shown].rangeMm : null);
  });
  store.show(() => view.setLook(state.look === "sculpture"));
  store.show(() => {
    const { left, right, held, shown } = state;
    if (shown.length > 0) names.label(isMoved(state));
    names.setHeld(held, aloneOf(state) !== null);
    if (state.chapter) wipe.setNames("rigid skin", "soft tissue");
    else wipe.setNames(nameOf(left, isMoved(state)), nameOf(right, isMoved(state)));
  });
  store.show(() => {
    const { truth, cast } = state;
    const shown = state.isComplete ? state.shown : wantedActors(state);
    // dynaskin first, whatever stands beside it.
    const own = (kind: string) => (kind === "dynaskin" ? 0 : 1);
    describeActors(
      shown
        .toSorted((a, b) => own(a.kind) - own(b.kind))
        .map(({ kind }) => ({ kind, bundle: cast?.bundleOf(kind) ?? null })),
      truth?.simulatorMethod ?? null,
    );
    traces.describe(regionLabel(state.region), shown, truth !== null);
    describeDifference(state, shown, cast?.bundleOf("dynaskin") ?? null);
  });
}
