import { type ActorKind, actorsOf, SLOTS, type Slot } from "./actors.js";
import { narrowScreen } from "./narrow.js";
import { DEFAULTS, type Settings } from "./settings.js";

/** An actor on the screen. */
export interface Shown {
  slot: Slot;
  kind: ActorKind;
}

/** The actors on the screen, from left to right; a narrow one has room for two. */
export function shownActors(settings: Settings): Shown[] {
  const taken = SLOTS.flatMap((slot) => {
    const kind = settings[slot];
    return kind === null ? [] : [{ slot, kind }];
  });
  if (settings.layout === "one") return taken.filter(({ slot }) => slot === "right");
  return taken.slice(0, settings.layout === "wipe" || narrowScreen.matches ? 2 : SLOTS.length);
}

/** Puts ground truth beside the other actors, where it is not among them yet. */
export function addTruth(settings: Settings): void {
  if (shownActors(settings).some(({ kind }) => kind === "truth")) return;
  if (settings.layout === "one") settings.layout = narrowScreen.matches ? "wipe" : "side";
  if (settings.layout === "wipe" || narrowScreen.matches) settings.left = "truth";
  else if (settings.third === null) settings.third = "truth";
  else settings.fourth = "truth";
}

/**
 * Puts those that the page begins with in the places of actors that the settings' body and motion do
 * not have, such as ground truth where no clip plays.
 */
export function replaceMissing(settings: Settings): void {
  const known = actorsOf(settings.sex, settings.clip !== null);
  for (const slot of SLOTS) {
    const kind = settings[slot];
    if (kind !== null && !known.includes(kind)) Object.assign(settings, { [slot]: DEFAULTS[slot] });
  }
}
