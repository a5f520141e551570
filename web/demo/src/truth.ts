import { type Body, POSE_LENGTH, SHAPE_LENGTH } from "dynaskin";
import { SafeTensors } from "./safetensors.js";

/** Addresses of the clips in `clips/`, by file. */
const FILES = import.meta.glob<string>("../clips/*.safetensors", {
  query: "?url",
  import: "default",
  eager: true,
});

const [FOLDER, ENDING] = ["../clips/", ".safetensors"];
const fileOf = (name: string) => FOLDER + name + ENDING;

/** Names of the clips that were there when the page was built. */
export const CLIP_NAMES: readonly string[] = Object.keys(FILES).map((path) =>
  path.slice(FOLDER.length, -ENDING.length),
);

/** What the page calls a clip. */
export function clipLabel(name: string): string {
  const words = name.replaceAll("-", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

const ROTATION_LENGTH = POSE_LENGTH - 3;

/**
 * A clip of the simulator: poses, and the offsets that it computed for them, as
 * `scripts/demo-clips.py` writes them.
 */
export class TruthClip {
  /** Poses, {@link POSE_LENGTH} numbers each. */
  readonly poses: Float64Array;
  /** Frames per second. */
  readonly rateHz: number;
  /** The body's shape coefficients. */
  readonly shape: number[];
  /** Which state of the simulator made it, as bundles name it in `training.simulator.method`. */
  readonly simulatorMethod: string;
  /** The motion by formula that it was simulated for, with tempo and height. */
  readonly formula: { motion: string; tempoHz: number; heightM: number };
  /** Offsets at the moment of the last {@link moveTo}: `[vertex][x, y, z]` flattened, metres. */
  readonly offsets: Float32Array;
  readonly #vertices: Uint32Array;
  readonly #basisM: Float32Array;
  readonly #coefficients: Float32Array;
  readonly #soft: Float32Array;

  /** Throws an `Error` for a file that is no clip of this body. */
  constructor(
    readonly name: string,
    file: ArrayBuffer,
    body: Body,
  ) {
    const tensors = new SafeTensors(file);
    const { format, version, body_sha256, rate_hz, sim_method, name: source } = tensors.metadata;
    if (format !== "dynaskin-clip-basis" || version !== "1" || body_sha256 !== body.sha256) {
      throw new Error(`The clip ${name} is not for this body, or of another version.`);
    }
    this.rateHz = Number(rate_hz);
    this.simulatorMethod = sim_method ?? "";
    this.formula = formulaOf(source ?? "");
    this.shape = [...tensors.singles("shape")].slice(0, SHAPE_LENGTH);
    this.#vertices = tensors.integers("vertices");
    this.#basisM = tensors.halves("basis_m");
    this.#coefficients = tensors.singles("coefficients");
    this.#soft = new Float32Array(this.#vertices.length * 3);
    this.offsets = new Float32Array(body.vertexCount * 3);
    const translations = tensors.doubles("root_translation_m");
    const rotations = tensors.doubles("parent_from_joint");
    this.poses = new Float64Array((translations.length / 3) * POSE_LENGTH);
    for (let frame = 0; frame < this.frameCount; frame += 1) {
      const at = frame * POSE_LENGTH;
      const turned = frame * ROTATION_LENGTH;
      this.poses.set(translations.subarray(frame * 3, frame * 3 + 3), at);
      this.poses.set(rotations.subarray(turned, turned + ROTATION_LENGTH), at + 3);
    }
  }

  /** Number of frames. */
  get frameCount(): number {
    return this.poses.length / POSE_LENGTH;
  }

  /** Computes {@link offsets} at a time in seconds, interpolated between frames. */
  moveTo(timeSeconds: number): void {
    const components = this.#basisM.length / this.#soft.length;
    const last = this.frameCount - 1;
    const position = Math.max(0, Math.min(last, timeSeconds * this.rateHz));
    const before = Math.floor(position);
    const after = Math.min(before + 1, last);
    const share = position - before;
    this.#soft.fill(0);
    for (let component = 0; component < components; component += 1) {
      const from = this.#coefficients[before * components + component] ?? 0;
      const to = this.#coefficients[after * components + component] ?? 0;
      const factor = from + (to - from) * share;
      const start = component * this.#soft.length;
      for (let idx = 0; idx < this.#soft.length; idx += 1) {
        this.#soft[idx] = (this.#soft[idx] ?? 0) + factor * (this.#basisM[start + idx] ?? 0);
      }
    }
    this.#vertices.forEach((vertex, idx) => {
      this.offsets.set(this.#soft.subarray(idx * 3, idx * 3 + 3), vertex * 3);
    });
  }
}

/** Reads `hop-190-060__s0`, the data set's name of a clip: motion, tempo (cHz), height (mm), shape. */
function formulaOf(source: string): TruthClip["formula"] {
  const [, motion, tempo, height] = /^(.+)-(\d+)-(\d+)__/.exec(source) ?? [];
  if (!motion) throw new Error(`The clip was made from ${source}, which is no motion by formula.`);
  return { motion, tempoHz: Number(tempo) / 100, heightM: Number(height) / 1000 };
}

/** Downloads a clip. Throws an `Error` when it cannot be had or is not for this body. */
export async function loadClip(name: string, body: Body, signal: AbortSignal): Promise<TruthClip> {
  const address = FILES[fileOf(name)];
  if (!address) throw new Error(`There is no clip ${name}.`);
  const response = await fetch(address, { signal });
  if (!response.ok) throw new Error(`The server answered ${response.status} for the clip ${name}.`);
  return new TruthClip(name, await response.arrayBuffer(), body);
}
