import traits from "virtual:traits";
import type { Figure } from "dynaskin";
import type { Sex } from "./actors.js";
import { lessMotion } from "./less-motion.js";
import { narrowScreen } from "./narrow.js";
import type { Settings } from "./settings.js";
import { figureOf } from "./words.js";

/** The parts of the story that the page begins with, in order. */
export const CHAPTERS = ["look", "ghost", "bodies", "grab"] as const;
export type Chapter = (typeof CHAPTERS)[number];

/** What is said beside the picture of each. */
export const CHAPTER_TEXTS: Readonly<Record<Chapter, { title: string; line: string }>> = {
  look: {
    title: "Bodies are soft.",
    line: "One body, one jump. Left of the line the skin is rigid and follows the bones; right of it soft tissue arrives late and swings. Watch chest and belly as the line passes.",
  },
  ghost: {
    title: "How far it goes.",
    line: "The line is the rigid skin; the numbers are how far the soft tissue is from it, in millimetres.",
  },
  bodies: {
    title: "Every body in its own time.",
    line: "The same jump. How far the tissue moves and how long it swings depends on the body.",
  },
  grab: {
    title: "Grab it.",
    line: "Drag a ring and let go; on the keyboard, Tab to a ring and hold the arrow keys.",
  },
};

/** One jump out of many, which begins where it ends: in flight after a push-off. Seconds of the motion. */
export const JUMP = { tempoHz: 0.6, heightM: 0.28, fromSeconds: 2.85, periodSeconds: 1 / 0.6 };

/** The landing, in seconds of the motion: the skin is farthest from plain skinning in it. */
export const LANDING = { fromSeconds: 3.42, peakSeconds: 3.52, toSeconds: 3.72 };

/** The part of the landing in which the picture all but stands still, while the divider goes over the body. */
const STILL = { fromSeconds: 3.5, toSeconds: 3.54 };

/** How fast the landing and its still part play after the first, and how softly the clock goes over into them. */
const SLOW_SPEED = 0.4;
const STILL_SPEED = 0.026;
const EASE_SECONDS = 0.04;
const STILL_EASE_SECONDS = 0.006;

const smooth = (share: number) => {
  const within = Math.max(0, Math.min(1, share));
  return within * within * (3 - 2 * within);
};

/** 1 within a part of the motion, 0 outside, with edges inside it that take `easeSeconds`. */
function shareWithin(
  timeSeconds: number,
  part: { readonly fromSeconds: number; readonly toSeconds: number },
  easeSeconds: number,
): number {
  return (
    smooth((timeSeconds - part.fromSeconds) / easeSeconds) *
    smooth((part.toSeconds - timeSeconds) / easeSeconds)
  );
}

/** Speed of the clock at a time of the motion: real time, and slow motion in landings after the first. */
export function storySpeed(timeSeconds: number, round: number): number {
  if (round === 0) return 1;
  const slowed = 1 - (1 - SLOW_SPEED) * shareWithin(timeSeconds, LANDING, EASE_SECONDS);
  return slowed + (STILL_SPEED - slowed) * shareWithin(timeSeconds, STILL, STILL_EASE_SECONDS);
}

/** How far through the still part of the landing a time is, 0 to 1, with no speed at either end. */
export function stillShare(timeSeconds: number): number {
  const { fromSeconds, toSeconds } = STILL;
  return smooth((timeSeconds - fromSeconds) / (toSeconds - fromSeconds));
}

/** Yaw and pitch (radians), distance and height (metres) of the camera that the page begins with. */
export const CLOSE_UP = [-0.42, 0, 1.24, 1.1] as const;

/** The same of a chapter's camera. */
const CAMERAS: Readonly<Record<Chapter, readonly [number, number, number, number]>> = {
  look: CLOSE_UP,
  ghost: [-0.7, 0, 1.24, 1.06],
  // At the top of the jump there is room over the heads for their names.
  bodies: [0.38, 0.06, 4.05, 0.97],
  grab: [0.38, 0.06, 3.3, 0.88],
};

/** Of three bodies on a narrow screen, which has room over their heads. */
const NARROW_BODIES = [0.38, 0.06, 3.6, 0.86] as const;

/** Weights of the bodies beside each other, in kilograms; a narrow picture has room for every second. */
const WEIGHTS_KG: Readonly<Record<Sex, readonly number[]>> = {
  female: [48, 57, 65, 74, 83],
  male: [58, 67, 76, 86, 97],
};

const WEIGHT_KG: Readonly<Record<Sex, number>> = { female: 74, male: 86 };

/** A body of a weight and the average stature and age, in the SDK's words. */
function figureOfWeight(sex: Sex, weightKg: number): Figure {
  const mean = (name: "stature" | "age") => traits[sex].find((own) => own.name === name)?.mean;
  return figureOf({ weight: weightKg, stature: mean("stature"), age: mean("age") });
}

/** The body that the story is told of, in the SDK's words. */
export const storyFigure = (sex: Sex): Figure => figureOfWeight(sex, WEIGHT_KG[sex]);

/** The bodies that stand beside each other, and what they are called. */
export function troupe(sex: Sex, isNarrow: boolean): { shape: Figure; label: string }[] {
  return WEIGHTS_KG[sex]
    .filter((_, idx) => !isNarrow || idx % 2 === 0)
    .map((kg) => ({ shape: figureOfWeight(sex, kg), label: `${kg} kg` }));
}

/** Whether a chapter plays the jump over and over. */
export function isLoop(chapter: Chapter | null): boolean {
  return chapter !== null && chapter !== "grab";
}

/** The settings of a chapter, as the Lab would have them, but for its bodies. */
export function chapterSettings(chapter: Chapter): Partial<Settings> {
  const still = lessMotion.matches && isLoop(chapter);
  const hasTwo = chapter === "look" || chapter === "ghost";
  return {
    chapter,
    ...(chapter === "grab"
      ? { motion: "by-hand", tempoHz: null, heightM: null }
      : { motion: "jump", tempoHz: JUMP.tempoHz, heightM: JUMP.heightM }),
    clip: null,
    layout: hasTwo ? "wipe" : chapter === "bodies" ? "side" : "one",
    ...{ left: "linear", right: "dynaskin", third: null, fourth: null },
    split: chapter === "ghost" ? 0 : 0.5,
    ...{ clothes: "sportswear", strength: 1, tissue: { gain: {}, stiffness: {}, damping: {} } },
    ...{ dynamics: true, heat: false, plots: false, hud: false, caption: false, speed: 1 },
    camera: chapter === "bodies" && narrowScreen.matches ? NARROW_BODIES : CAMERAS[chapter],
    paused: still,
    timeSeconds: still ? LANDING.peakSeconds : null,
  };
}
