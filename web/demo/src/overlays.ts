import { ByHand } from "./by-hand.js";
import { Handles } from "./handles.js";
import { Names } from "./names.js";
import type { Playback } from "./playing.js";
import type { Stage } from "./stage.js";
import type { PageStore } from "./state.js";
import type { View } from "./view.js";

/** What hangs on the bodies in the picture: names over heads, and rings to take hold by. */
export class Overlays {
  readonly names: Names;
  readonly #handles: Handles;
  readonly #store: PageStore;
  readonly #stage: Stage;
  readonly #view: View;

  constructor(store: PageStore, stage: Stage, view: View) {
    this.#store = store;
    this.#stage = stage;
    this.#view = view;
    // Who takes hold of a body that stands still wants it to move.
    this.#handles = new Handles(view, () => store.change({ paused: false }));
    // An actor that is alone is held to see it without its tissue.
    this.names = new Names(view, (slot) =>
      store.change({ held: slot && store.state.shownLayout === "one" ? "left" : slot }),
    );
    addEventListener("blur", () => store.change({ held: null }));
  }

  /** Puts all where the bodies are in the picture, for a frame of so many seconds, 0 after a jump in time. */
  show(playback: Playback | null, elapsedSeconds: number): void {
    const { shown } = this.#store.state;
    const places = this.#stage.placesM(shown.length);
    const main = Math.max(
      0,
      shown.findIndex(({ slot }) => slot === "right"),
    );
    const motion = playback?.motion;
    this.#handles.attach(motion instanceof ByHand ? motion : null);
    this.#handles.show(places[main] ?? [0, 0], this.#view.asidePx("right"));
    const crownsM = this.#stage.crownsM(playback?.avatars ?? []);
    this.names.show(crownsM, places, elapsedSeconds);
  }

  /** Puts the keyboard's focus on a ring of the body that is moved by hand. */
  focusBody(playback: Playback | null): void {
    this.show(playback, 0);
    this.#handles.focus();
  }
}
