import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { type Bundle, DynaSkinError, load, type Model, type ModelFiles, restPose } from "dynaskin";
import { expect } from "vitest";

const MODELS = new URL("../../../models/", import.meta.url);

/** Names of the models in the repository. */
export const MODEL_NAMES = readdirSync(fileURLToPath(MODELS), { withFileTypes: true })
  .filter((entry) => entry.isDirectory())
  .map((entry) => entry.name);

/** The folder of a model. */
export function modelFolder(name = "female"): URL {
  return new URL(`${name}/`, MODELS);
}

/** A model from the repository. */
export function loadModel(name = "female"): Promise<Model> {
  return load({ model: modelFolder(name) });
}

/** Bytes of one file of the female model. */
export function readModelFile(file: string): Uint8Array {
  return new Uint8Array(readFileSync(fileURLToPath(new URL(file, modelFolder()))));
}

/**
 * The files of the female model with some replaced. The hashes in the bundle are made to fit, so
 * that what refuses a file is not its hash; `bundle` then changes the bundle at will.
 */
export function modelFiles(
  replaced: Partial<Record<"body" | "predictor" | "decoder", Uint8Array>> = {},
  change: (bundle: Bundle) => void = () => {},
): ModelFiles {
  const bundle = JSON.parse(new TextDecoder().decode(readModelFile("bundle.json"))) as Bundle;
  const read = (key: "body" | "predictor" | "decoder") => {
    const bytes = replaced[key] ?? readModelFile(bundle[key].file);
    bundle[key].sha256 = createHash("sha256").update(bytes).digest("hex");
    return bytes;
  };
  const [body, predictor, decoder] = [read("body"), read("predictor"), read("decoder")];
  change(bundle);
  return { bundle: new TextEncoder().encode(JSON.stringify(bundle)), body, predictor, decoder };
}

/** The memory of the core that all models share, which is no part of what the package gives. */
export async function coreMemory(): Promise<WebAssembly.Memory> {
  const core = new URL("../dist/core.js", import.meta.url).href;
  const { startCore } = (await import(core)) as {
    startCore: (wasm: undefined) => Promise<{ memory: WebAssembly.Memory }>;
  };
  return (await startCore(undefined)).memory;
}

/** Expects our error with this code, and a message of at least a few words. */
export async function expectError(code: string, work: () => unknown): Promise<DynaSkinError> {
  const error = await Promise.resolve()
    .then(work)
    .then(
      () => null,
      (thrown: unknown) => thrown,
    );
  expect(error).toBeInstanceOf(DynaSkinError);
  const ours = error as DynaSkinError;
  expect(ours.code, ours.message).toBe(code);
  expect(ours.message.split(" ").length).toBeGreaterThan(4);
  return ours;
}

/** The rest pose with its root moved, in metres. */
export function poseAt(x: number, y: number, z: number): Float64Array {
  const pose = restPose();
  pose.set([x, y, z]);
  return pose;
}

/** Length of the largest of the offsets, in metres. */
export function largestOffset(offsets: Float32Array): number {
  let largest = 0;
  for (let idx = 0; idx < offsets.length; idx += 3) {
    const length = Math.hypot(offsets[idx] ?? 0, offsets[idx + 1] ?? 0, offsets[idx + 2] ?? 0);
    largest = Math.max(largest, length);
  }
  return largest;
}

/** Largest absolute difference of two arrays of the same length. */
export function largestDifference(a: ArrayLike<number>, b: ArrayLike<number>): number {
  expect(a.length).toBe(b.length);
  let largest = 0;
  for (let idx = 0; idx < a.length; idx += 1) {
    largest = Math.max(largest, Math.abs((a[idx] ?? 0) - (b[idx] ?? 0)));
  }
  return largest;
}
