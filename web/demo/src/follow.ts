import { type Consequence, SETTING_NAMES, SETTINGS } from "./settings.js";
import { bodyCount, isPlain, type PageStore } from "./state.js";

/** What follows from changed settings, and from what else the page is about at the moment. */
export interface Followers extends Record<Consequence, () => void> {
  /** The number of bodies side by side, or the body itself. */
  bodies: () => void;
  /** Whether the picture stands still for the benchmark. */
  measuring: () => void;
}

/**
 * Does what follows from the store's values: once for all that change together. `carryOut` runs each piece of work, and
 * takes note of the moment at which the motion then stands.
 */
export function followStore(
  store: PageStore,
  followers: Followers,
  carryOut: (work: () => void) => void,
): void {
  const { state } = store;
  const { bodies, measuring, ...consequences } = followers;
  const on = (read: () => readonly unknown[], work: () => void) =>
    store.on(read, () => carryOut(work));
  for (const [consequence, work] of Object.entries(consequences)) {
    const names = SETTING_NAMES.filter((name) =>
      SETTINGS[name].affects?.includes(consequence as Consequence),
    );
    on(() => names.map((name) => state[name]), work);
  }
  // What a link says of the moment belongs to all the rest that it says.
  on(
    () => SETTING_NAMES.map((name) => state[name]),
    () => {},
  );
  on(() => [state.isNarrow], consequences.actors);
  on(() => [isPlain(state)], consequences.tissue);
  on(() => [bodyCount(state), state.cast], bodies);
  on(() => [state.isMeasuring], measuring);
}
