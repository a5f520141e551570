import { type ActorKind, SLOTS, type Slot } from "./actors.js";
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

/** Puts those in the places of ground truth that the page begins with. */
export function removeTruth(settings: Settings): void {
  for (const slot of SLOTS) {
    if (settings[slot] === "truth") Object.assign(settings, { [slot]: DEFAULTS[slot] });
  }
}

/** Puts everyone at their places that the page begins with. */
export function resetActors(settings: Settings): void {
  for (const slot of SLOTS) Object.assign(settings, { [slot]: DEFAULTS[slot] });
}
