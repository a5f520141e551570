import type { Body, Figure } from "dynaskin";
import type { Trait } from "./traits.js";

/** What people say of a body, in the units of `traits.json`. */
export type Words = Record<Trait["name"], number>;

/** Each trait's name in the SDK, and how many of the trait's units one of the SDK's is. */
export const MEASURES: readonly (readonly [Trait["name"], keyof Figure, number])[] = [
  ["stature", "statureM", 100],
  ["weight", "weightKg", 1],
  ["chest", "chestCm", 1],
  ["muscle", "muscle", 100],
  ["age", "age", 1],
];

/** Words as the SDK takes them; what is undefined follows from the others. */
export function figureOf(
  words: Readonly<Partial<Record<keyof Words, number | undefined>>>,
): Figure {
  return Object.fromEntries(
    MEASURES.flatMap(([name, key, perUnit]) => {
      const value = words[name];
      return value === undefined ? [] : [[key, value / perUnit] as const];
    }),
  );
}

/** A random body: of any weight, age, stature and muscle alike, so that two of them are seen to differ. */
export function randomWords(traits: readonly Trait[], random = Math.random): Partial<Words> {
  return Object.fromEntries(
    traits
      // The chest follows from the others.
      .filter(({ name }) => name !== "chest")
      .map(({ name, range: [low, high] }) => [name, low + (high - low) * random()]),
  );
}

/** The coefficients of a body with these measures, or with those nearest to them that bodies have. */
export function coefficientsOf(body: Body, figure: Figure): number[] {
  const avatar = body.createAvatar({ shape: figure });
  const shape = [...avatar.shape];
  avatar.dispose();
  return shape;
}
