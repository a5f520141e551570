import { checkNumber, checkObject } from "./check.js";
import { DynaSkinError } from "./error.js";

/**
 * A body's shape as measures. What you leave out follows from the rest: the shape is the likeliest of all
 * adults with these measures. Bodies stay likely, so the result may differ from the request: `avatar.figure`
 * has the measures of the result.
 */
export interface Figure {
  /** Weight in kilograms, 30 to 250: the body's volume at 1010 kg/m³. */
  weightKg?: number;
  /** Height in metres, 1.45 to 2.2; smaller people are refused, as the bodies are adults. */
  statureM?: number;
  /** Chest circumference in centimetres, 60 to 170. */
  chestCm?: number;
  /** Muscle, 0 to 1; the average of many people is 0.5. */
  muscle?: number;
  /** Age in years, 18 to 100. The bodies behind the shape space are 25 to 63 years old. */
  age?: number;
}

/** In the order in which the core counts them. */
const NAMES = ["statureM", "weightKg", "chestCm", "muscle", "age"] as const;

/** Ten shape coefficients in standard deviations, or measures. */
export type Shape = ArrayLike<number> | Figure;

/**
 * Whether a shape is in words; what is neither is refused where coefficients are.
 *
 * @internal
 */
export function isFigure(shape: Shape): shape is Figure {
  return typeof shape === "object" && shape !== null && !("length" in shape);
}

/**
 * A figure as the core takes it: five numbers, not a number where nothing is wished.
 *
 * @throws DynaSkinError `argument` for other names, and for values that are no numbers
 * @internal
 */
export function figureNumbers(figure: Figure): Float64Array {
  checkObject("shape", figure);
  for (const [name, value] of Object.entries(figure)) {
    if (!(NAMES as readonly string[]).includes(name)) {
      throw new DynaSkinError(
        "argument",
        `shape has no measure ${JSON.stringify(name)}; there are ${NAMES.join(", ")}. ` +
          "Coefficients are an array of ten numbers.",
      );
    }
    if (value === undefined) continue;
    checkNumber(`shape.${name}`, value);
    // It would read as a measure that is left out.
    if (Number.isNaN(value)) throw new DynaSkinError("shape", `shape.${name} is not a number.`);
  }
  return Float64Array.from(NAMES, (name) => figure[name] ?? Number.NaN);
}

/**
 * The five measures as the core gives them; null where a bundle tells none.
 *
 * @internal
 */
export function figureOf(numbers: Float64Array): Required<Figure> | null {
  if (numbers.length !== NAMES.length) return null;
  return Object.fromEntries(NAMES.map((name, idx) => [name, numbers[idx]])) as Required<Figure>;
}
