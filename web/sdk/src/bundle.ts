/** A soft region of the body. Left and right are one region. */
export type RegionName = "chest" | "belly" | "buttocks" | "thighs" | "calves" | "upper-arms";

/** The soft regions in the order in which the core counts them. */
export const REGION_NAMES: readonly RegionName[] = [
  "chest",
  "belly",
  "buttocks",
  "thighs",
  "calves",
  "upper-arms",
];

/** A file that a bundle names, beside it. */
export interface BundleFile {
  /** File name, relative to `bundle.json`. */
  file: string;
  /** SHA-256 of the file in hexadecimal; the core refuses a file that has another. */
  sha256: string;
}

/** The networks of a bundle as `dynaskin/slim` plays them, which `dynaskin slim` writes. */
export interface LoweredFiles {
  /** The predictor. */
  predictor: BundleFile;
  /** The decoder. */
  decoder: BundleFile;
}

/** Ranges of the training data: the least and the greatest value. Beyond them the networks extrapolate. */
export interface Learned {
  /** Factor on the tissue's stiffness. */
  stiffness: [least: number, greatest: number];
  /** Factor on its damping ratio. */
  damping: [least: number, greatest: number];
  /** Each shape coefficient, in standard deviations; absent if unknown. */
  shape?: [least: number, greatest: number][];
}

/** A measure of bodies, and how it changes with the shape coefficients. */
export interface Trait {
  /** `stature`, `weight`, `chest`, `muscle` or `age`. */
  name: string;
  /** `cm`, `kg`, `%` or `years`. */
  unit: string;
  /** Value of the average body. */
  mean: number;
  /** Range of the bodies behind the shape space, at mean stature. */
  range: [least: number, greatest: number];
  /** Change of the value with each shape coefficient. */
  per_coefficient: number[];
  /** Change of the shape coefficients that raises the value by 1. */
  coefficients_per_unit: number[];
  /** Share of the variance among bodies that the coefficients explain, 0 to 1. */
  explained: number;
}

/**
 * `bundle.json`: the files of a model, and where they come from. Its strings (`name`, `licence`, all of
 * `training` and `measured`) come from its author, may have any length and content, and are not checked:
 * show them as text, never as HTML, and do not make addresses or file names from them.
 */
export interface Bundle {
  /** Always `dynaskin-bundle`. */
  format: string;
  /** Version of the format, 1 or 2. */
  version: number;
  /** Name of the model, such as `female`. */
  name: string;
  /** Ticks per second of the network's clock. */
  rate_hz: number;
  /** The body model, a GLB. */
  body: BundleFile;
  /** The network that turns motion features and state into a latent vector. */
  predictor: BundleFile;
  /** The network that turns the latent vector into offsets. */
  decoder: BundleFile;
  /** The same networks for `dynaskin/slim`; absent if `dynaskin slim` has not written them. */
  lowered?: LoweredFiles;
  /** The kind of the predictor's input, such as `inertial-materials`. */
  feature_kind: string;
  /** Numbers in a feature vector. */
  feature_count: number;
  /** Numbers in a latent vector. */
  latent_count: number;
  /** Ranges of the training data; absent in version 1. */
  learned?: Learned;
  /** The body's measures, for shapes given by measures; absent if unknown. */
  traits?: Trait[];
  /** Body vertices that the decoder moves, ascending. */
  vertices: number[];
  /** What the networks were trained on. */
  training: Record<string, unknown>;
  /** Errors measured on data that was held out. */
  measured: Record<string, unknown>;
  /** Licence of the weights. */
  licence: string;
}
