// Runs the code of the pages in docs/recipes as it stands there, and measures what comes of it.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { type Avatar, JOINT_NAMES, type JointName } from "dynaskin";
import { Matrix4, Vector3 } from "three";
import { expect } from "vitest";
import { largestOffset } from "./support.js";

export const PAGES = new URL("../../../docs/recipes/", import.meta.url);
const EXTRACTED = new URL("../../../test-results/recipes/", import.meta.url);

/** A frame of a display of 60 Hz, in seconds. */
export const TICK = 1 / 60;

/** The only block of code of a page. */
export function codeOf(name: string): string {
  const page = readFileSync(new URL(`${name}.md`, PAGES), "utf8");
  const blocks = [...page.matchAll(/^```js\n([\s\S]*?)^```$/gm)].map(([, code = ""]) => code);
  expect(blocks.length, `blocks of code in ${name}.md`).toBe(1);
  return blocks[0] ?? "";
}

/** What the code of a page exports. */
export async function recipe<Exports>(name: string): Promise<Exports> {
  const file = fileURLToPath(new URL(`${name}.mjs`, EXTRACTED));
  mkdirSync(EXTRACTED, { recursive: true });
  writeFileSync(file, codeOf(name));
  return (await import(/* @vite-ignore */ file)) as Exports;
}

/** How much the tissue shakes: watched after every frame, in metres. */
export class Shaking {
  readonly #avatar: Avatar;
  #last: Float32Array[] = [];
  #squares = 0;
  #count = 0;
  /** Largest offset that was seen. */
  largestM = 0;

  constructor(avatar: Avatar) {
    this.#avatar = avatar;
  }

  watch(): void {
    const now = this.#avatar.offsets.slice();
    const [before, last] = this.#last;
    if (before && last) {
      for (const [idx, metres] of now.entries()) {
        this.#squares += (metres - 2 * (last[idx] ?? 0) + (before[idx] ?? 0)) ** 2;
      }
      this.#count += now.length;
    }
    this.largestM = Math.max(this.largestM, largestOffset(now));
    this.#last = [last ?? now, now];
  }

  /** Root mean square of second differences from frame to frame. */
  get rmsM(): number {
    return Math.sqrt(this.#squares / Math.max(1, this.#count));
  }
}

/** Where a joint is in the world, metres. */
export function jointAt(avatar: Avatar, name: JointName): Vector3 {
  const joint = JOINT_NAMES.indexOf(name);
  const worldFromRest = new Matrix4().fromArray(avatar.skinMatrices, 16 * joint);
  return new Vector3().fromArray(avatar.restJointsM(), 3 * joint).applyMatrix4(worldFromRest);
}

/** Degrees between the line from one joint to another and a direction in the world. */
export function degreesOff(
  avatar: Avatar,
  from: JointName,
  to: JointName,
  direction: number[],
): number {
  const line = jointAt(avatar, to).sub(jointAt(avatar, from));
  return (line.angleTo(new Vector3(...direction)) * 180) / Math.PI;
}

/** Evenly spread numbers from 0 to 1, the same in every run. */
export function randomNumbers(seed: number): () => number {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}
