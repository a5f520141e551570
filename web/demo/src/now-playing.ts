import { actorLabel } from "./actors.js";
import type { Chapter } from "./chapters.js";
import type { ClipTexts } from "./clip.js";
import { byId } from "./dom.js";
import type { State } from "./state.js";

/** Says what plays, called `label`, in the title and to screen readers. */
export function announcePlaying({ cast, shown }: Readonly<State>, label: string): void {
  const playing = `${label} · ${cast?.sex} body`;
  byId("now-playing").textContent = playing;
  const actors = shown.map(({ kind }) => actorLabel(kind)).join(", ");
  byId("view").setAttribute(
    "aria-label",
    `${playing}, moved by: ${actors}. Drag or use the arrow keys to orbit, scroll, pinch or press plus ` +
      "and minus to zoom, double-click to reset the view.",
  );
}

/** What stands in a film of what is on the screen. */
export function filmTexts({ chapter, shown }: Readonly<State>): Omit<ClipTexts, "middles"> {
  const names = shown.map(({ kind, label }) => label ?? actorLabel(kind));
  return {
    names: (chapter && STORY_NAMES[chapter]) ?? names,
    address: `dynaskin · ${location.host}${location.pathname}`,
  };
}

/** What the story calls its two actors. */
const STORY_NAMES: Partial<Record<Chapter, readonly string[]>> = {
  look: ["rigid skin", "soft tissue"],
  ghost: ["line: rigid skin", "soft tissue"],
};
