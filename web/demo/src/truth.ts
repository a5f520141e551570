import { type Body, POSE_LENGTH, SHAPE_LENGTH } from "dynaskin";
import type { Sex } from "./actors.js";
import { SafeTensors } from "./safetensors.js";

/** Addresses of the clips in `clips/BODY/`, by file. */
const FILES = import.meta.glob<string>("../clips/*/*.safetensors", {
  query: "?url",
  import: "default",
  eager: true,
});

const ENDING = ".safetensors";
const folderOf = (sex: Sex) => `../clips/${sex}/`;

/** Names of the clips of a body that were there when the page was built. */
export function clipNamesOf(sex: Sex): readonly string[] {
  const folder = folderOf(sex);
  return Object.keys(FILES)
    .filter((path) => path.startsWith(folder))
    .map((path) => path.slice(folder.length, -ENDING.length));
}

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
  readonly #bodySha256: string;
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
    this.#bodySha256 = body.sha256;
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

  /** Whether this is the clip of this name for a body. */
  isOf(name: string, body: Body): boolean {
    return name === this.name && body.sha256 === this.#bodySha256;
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
    const soft = this.#soft.fill(0);
    for (let component = 0; component < components; component += 1) {
      const from = this.#coefficients[before * components + component] ?? 0;
      const to = this.#coefficients[after * components + component] ?? 0;
      const factor = from + (to - from) * share;
      const start = component * soft.length;
      for (let idx = 0; idx < soft.length; idx += 1) {
        soft[idx] = (soft[idx] ?? 0) + factor * (this.#basisM[start + idx] ?? 0);
      }
    }
    for (let idx = 0; idx < this.#vertices.length; idx += 1) {
      const at = (this.#vertices[idx] ?? 0) * 3;
      this.offsets[at] = soft[idx * 3] ?? 0;
      this.offsets[at + 1] = soft[idx * 3 + 1] ?? 0;
      this.offsets[at + 2] = soft[idx * 3 + 2] ?? 0;
    }
  }
}

/** Reads `hop-190-060__s0`, the data set's name of a clip: motion, tempo (cHz), height (mm), shape. */
function formulaOf(source: string): TruthClip["formula"] {
  const [, motion, tempo, height] = /^(.+)-(\d+)-(\d+)__/.exec(source) ?? [];
  if (!motion)
    throw new Error(`The clip was made from ${source}, which is not a procedural motion.`);
  return { motion, tempoHz: Number(tempo) / 100, heightM: Number(height) / 1000 };
}

/** Downloads a clip of `sex`, whose body this is. Throws an `Error` when it cannot be had or is not for it. */
export async function loadClip(
  name: string,
  { sex, body }: { sex: Sex; body: Body },
  options: { signal: AbortSignal; onProgress: (loadedBytes: number) => void },
): Promise<TruthClip> {
  const address = FILES[folderOf(sex) + name + ENDING];
  if (!address) throw new Error(`There is no clip ${name}.`);
  const response = await fetch(address, { signal: options.signal });
  if (!response.ok) throw new Error(`The server answered ${response.status} for the clip ${name}.`);
  let loaded = 0;
  const counted = response.body?.pipeThrough(
    new TransformStream<Uint8Array<ArrayBuffer>, Uint8Array<ArrayBuffer>>({
      transform(chunk, controller) {
        loaded += chunk.length;
        options.onProgress(loaded);
        controller.enqueue(chunk);
      },
    }),
  );
  return new TruthClip(name, await new Response(counted).arrayBuffer(), body);
}

/** What the progress bar calls the file of a clip. */
export function clipFile(sex: Sex, name: string): string {
  return `clips/${sex}/${name}${ENDING}`;
}
