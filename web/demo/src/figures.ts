import type { Avatar } from "dynaskin";
import type { Cast } from "./cast.js";
import type { PageStore } from "./state.js";
import { figureOf, MEASURES, type Words } from "./words.js";

/** Shapes in words of the body on the screen, as the SDK finds them. */
export class Figures {
  readonly #store: PageStore;
  #cast: Cast | null = null;
  /** It is never seen: its shape answers what is asked. */
  #avatar: Avatar | null = null;

  constructor(store: PageStore) {
    this.#store = store;
  }

  /** The measures of a shape; null before the body is there. */
  measure(shape: readonly number[]): Words | null {
    const avatar = this.#ofBody;
    avatar?.setShape(shape);
    const figure = avatar?.figure;
    if (!figure) return null;
    return Object.fromEntries(
      MEASURES.map(([name, key, perUnit]) => [name, perUnit * figure[key]]),
    ) as Words;
  }

  /** The likeliest shape with these measures, as far as bodies have them; null before the body is there. */
  shapeOf(words: Readonly<Partial<Words>>): number[] | null {
    const avatar = this.#ofBody;
    if (!avatar) return null;
    avatar.setShape(figureOf(words));
    return [...avatar.shape];
  }

  get #ofBody(): Avatar | null {
    const { cast } = this.#store.state;
    if (cast !== this.#cast) {
      this.#avatar?.dispose();
      this.#avatar = cast?.body.createAvatar() ?? null;
      this.#cast = cast;
    }
    return this.#avatar;
  }
}
