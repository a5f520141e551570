declare module "virtual:methods" {
  /** Names of the methods that were there when the page was built, by body. */
  const methods: Readonly<Record<string, readonly string[]>>;
  export default methods;
}

declare module "virtual:traits" {
  /** One attribute of a body's shape, as `dynaskin body build` writes it. */
  export interface Trait {
    name: "stature" | "weight" | "chest" | "muscle" | "age";
    /** `cm`, `kg`, `%` or `years`. */
    unit: string;
    /** Value of the average body. */
    mean: number;
    range: [low: number, high: number];
    /** Change of the value with each shape coefficient. */
    per_coefficient: number[];
    /** Change of the coefficients that raises the value by 1. */
    coefficients_per_unit: number[];
  }
  const traits: Record<"female" | "male", readonly Trait[]>;
  export default traits;
}

declare module "virtual:sizes" {
  /** Bytes by file: `core`, `renderer`, paths under `models`, and `clips/BODY/NAME.safetensors`. */
  const sizes: Readonly<Record<string, number>>;
  export default sizes;
}
