import type { Avatar, Figure } from "dynaskin";
import type { Cast } from "./cast.js";
import type { Trait } from "./likely.js";
import type { PageStore } from "./state.js";

/** What people say of a body, in the units of `traits.json`. */
export type Words = Record<Trait["name"], number>;

/** Each trait's name in the SDK, and how many of the trait's units one of the SDK's is. */
const MEASURES: readonly (readonly [Trait["name"], keyof Figure, number])[] = [
  ["stature", "statureM", 100],
  ["weight", "weightKg", 1],
  ["chest", "chestCm", 1],
  ["muscle", "muscle", 100],
  ["age", "age", 1],
];

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
    const wished = MEASURES.flatMap(([name, key, perUnit]) => {
      const value = words[name];
      return value === undefined ? [] : [[key, value / perUnit] as const];
    });
    avatar.setShape(Object.fromEntries(wished));
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
