import type { MotionOptions, ProceduralName } from "dynaskin";
import { BY_HAND } from "./by-hand.js";

/** What the settings can name: a built-in motion, or the visitor's hand. */
export type MotionName = ProceduralName | typeof BY_HAND;

/** A motion file's name and content, to make its motion again for another body or shape. */
export interface MotionFile {
  name: string;
  bytes: Uint8Array;
}

/** A built-in motion as the page offers it. */
export interface MotionChoice {
  /** The name the SDK knows. */
  name: ProceduralName;
  label: string;
  /** Cycles per second: lowest, usual, highest. */
  tempoHz: [number, number, number];
  /** Height or amplitude in metres: lowest, usual, highest. */
  heightM: [number, number, number];
}

/**
 * The motions of the list, in order. The core refuses a flight that takes longer than the tempo
 * leaves; within these ranges nearly all combinations fit.
 */
export const MOTIONS: readonly MotionChoice[] = [
  { name: "jump", label: "Jump", tempoHz: [0.25, 0.45, 0.6], heightM: [0.1, 0.28, 0.45] },
  { name: "hop", label: "Hop", tempoHz: [1, 1.9, 2.6], heightM: [0.02, 0.09, 0.12] },
  {
    name: "one-leg-hop",
    label: "Hop on one leg",
    tempoHz: [1, 1.9, 2.6],
    heightM: [0.02, 0.06, 0.12],
  },
  {
    name: "jumping-jacks",
    label: "Jumping jacks",
    tempoHz: [0.5, 0.9, 1.2],
    heightM: [0.02, 0.07, 0.12],
  },
  {
    name: "run-in-place",
    label: "Run in place",
    tempoHz: [2, 2.8, 3.6],
    heightM: [0.01, 0.035, 0.06],
  },
  { name: "walk", label: "Walk", tempoHz: [1.2, 1.8, 2.4], heightM: [0.03, 0.07, 0.12] },
  { name: "twist", label: "Twist", tempoHz: [0.5, 1, 1.6], heightM: [0, 0.05, 0.1] },
  {
    name: "shake-hips",
    label: "Shake the hips",
    tempoHz: [0.8, 1.8, 3],
    heightM: [0.01, 0.05, 0.08],
  },
];

/** Every name that the settings can have. */
export const MOTION_NAMES: readonly MotionName[] = [...MOTIONS.map(({ name }) => name), BY_HAND];

/** The built-in motion with this name; null for the visitor's hand. */
export function findMotion(name: MotionName): MotionChoice | null {
  return MOTIONS.find((choice) => choice.name === name) ?? null;
}

/** What the page calls a motion. */
export function motionLabel(name: MotionName): string {
  return findMotion(name)?.label ?? "Moved by hand";
}

/** Options for the SDK, from what a link or the sliders say. */
export function motionOptions(
  choice: MotionChoice,
  tempoHz: number | null,
  heightM: number | null,
): Required<Pick<MotionOptions, "tempoHz" | "heightM">> {
  return {
    tempoHz: tempoHz ?? choice.tempoHz[1],
    heightM: heightM ?? choice.heightM[1],
  };
}
