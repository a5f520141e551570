declare module "virtual:methods" {
  /** Names of the methods that were there when the page was built, by body. */
  const methods: Readonly<Record<string, readonly string[]>>;
  export default methods;
}

declare module "virtual:traits" {
  const traits: Record<"female" | "male", readonly import("./traits.js").Trait[]>;
  export default traits;
}

declare module "virtual:sizes" {
  /** Bytes by file: `core`, `renderer`, paths under `models`, and `clips/BODY/NAME.safetensors`. */
  const sizes: Readonly<Record<string, number>>;
  export default sizes;
}
