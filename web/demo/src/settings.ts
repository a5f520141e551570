import { REGION_NAMES, type RegionName, SHAPE_LENGTH } from "dynaskin";
import { type ActorKind, actorsOf } from "./actors.js";
import { findMotion, MOTION_NAMES, type MotionName } from "./motions.js";
import { CLIP_NAMES } from "./truth.js";

/** The playback speeds that can be chosen. */
const SPEEDS = [0.1, 0.25, 0.5, 1];

/** Which body. */
export type Sex = "female" | "male";

/** Everything a link to the page can carry. */
export interface Settings {
  /** Which body. */
  sex: Sex;
  /** Shape coefficients in standard deviations. */
  shape: number[];
  /** Name of a built-in motion, or the visitor's hand. */
  motion: MotionName;
  /** Cycles per second of the motion; null: the motion's own. */
  tempoHz: number | null;
  /** Height of jumps in metres; null: the motion's own. */
  heightM: number | null;
  /** Name of the ground-truth clip that plays instead of the motion; null: none. */
  clip: string | null;
  /** Whether two actors share the picture. */
  compare: boolean;
  /** The actor left of the divider. */
  left: ActorKind;
  /** The actor right of the divider, and the only one without it. */
  right: ActorKind;
  /** Where the divider is: share of the picture's free width. */
  split: number;
  /** What the body wears: sportswear holds chest and hips. */
  clothes: "sportswear" | "unsupported";
  /** What the heat map shows: the offsets, or how far they are from ground truth. */
  heatOf: "offset" | "error";
  /** Whether the plots are shown. */
  plots: boolean;
  /** The region that the plots are about. */
  region: RegionName;
  /** Yaw and pitch (radians), distance and height (metres) of the camera; null: as at the start. */
  camera: number[] | null;
  /** Whether the network moves the skin. */
  dynamics: boolean;
  /** Whether the body shows its offsets as colours. */
  heat: boolean;
  /** Whether the timings are shown. */
  hud: boolean;
  /** Playback speed: 0.1, 0.25, 0.5 or 1. */
  speed: number;
  /** Whether the motion stands still. */
  paused: boolean;
  /** The graphics interface that was asked for. */
  backend: "auto" | "webgpu" | "webgl2";
}

/** The page without any parameters. */
export const DEFAULTS: Settings = {
  sex: "female",
  shape: new Array<number>(SHAPE_LENGTH).fill(0),
  motion: "hop",
  tempoHz: null,
  heightM: null,
  clip: null,
  compare: false,
  left: "linear",
  right: "dynaskin",
  split: 0.5,
  clothes: "sportswear",
  heatOf: "offset",
  plots: false,
  region: "chest",
  camera: null,
  dynamics: true,
  heat: false,
  hud: false,
  speed: 1,
  paused: false,
  backend: "auto",
};

/**
 * Reads the settings from a link; what makes no sense is left at its default. Numbers out of range
 * become the nearest in it: the range of the link's own motion, for tempo and height.
 */
export function readSettings(search: string): Settings {
  const query = new URLSearchParams(search);
  const oneOf = <T extends string>(name: string, values: readonly T[], otherwise: T) =>
    values.find((value) => value === query.get(name)) ?? otherwise;
  const number = (name: string) => {
    const value = Number.parseFloat(query.get(name) ?? "");
    return Number.isFinite(value) ? value : null;
  };
  const inRange = (name: string, range: readonly [number, number, number] | undefined) => {
    const value = number(name);
    if (value === null || !range) return null;
    return Math.max(range[0], Math.min(range[2], value));
  };
  const flag = (name: string, otherwise: boolean) =>
    query.has(name) ? ["", "1", "on", "true"].includes(query.get(name) ?? "") : otherwise;
  const shape = (query.get("shape") ?? "").split(",").map(Number.parseFloat);
  const motion = oneOf("motion", MOTION_NAMES, DEFAULTS.motion);
  const choice = findMotion(motion);
  const sex = oneOf("sex", ["female", "male"], DEFAULTS.sex);
  const clip = sex === "female" ? oneOf("clip", CLIP_NAMES, "") || null : null;
  const actors = actorsOf(sex, clip !== null);
  const camera = (query.get("camera") ?? "").split(",").map(Number.parseFloat);
  return {
    sex,
    clip,
    compare: flag("compare", DEFAULTS.compare),
    left: oneOf("left", actors, DEFAULTS.left),
    right: oneOf("right", actors, DEFAULTS.right),
    split: inRange("split", [0, 0, 1]) ?? DEFAULTS.split,
    clothes: oneOf("clothes", ["sportswear", "unsupported"], DEFAULTS.clothes),
    heatOf: query.get("heat") === "error" ? "error" : "offset",
    plots: flag("plots", DEFAULTS.plots),
    region: oneOf("region", REGION_NAMES, DEFAULTS.region),
    camera: camera.length === 4 && camera.every(Number.isFinite) ? camera : null,
    shape: DEFAULTS.shape.map((zero, idx) => {
      const value = shape[idx];
      return Number.isFinite(value) ? Math.max(-3, Math.min(3, value as number)) : zero;
    }),
    motion,
    tempoHz: inRange("tempo", choice?.tempoHz),
    heightM: inRange("height", choice?.heightM),
    dynamics: flag("dynamics", DEFAULTS.dynamics),
    heat: query.get("heat") === "error" || flag("heat", DEFAULTS.heat),
    hud: flag("hud", DEFAULTS.hud),
    speed: nearest(SPEEDS, number("speed") ?? DEFAULTS.speed),
    paused: flag("paused", matchMedia("(prefers-reduced-motion: reduce)").matches),
    backend: oneOf("backend", ["auto", "webgpu", "webgl2"], DEFAULTS.backend),
  };
}

function nearest(values: readonly number[], wanted: number): number {
  return values.reduce((best, value) =>
    Math.abs(value - wanted) < Math.abs(best - wanted) ? value : best,
  );
}

/** The settings as a link, with only what differs from the defaults. */
export function writeSettings(settings: Settings): string {
  const query = new URLSearchParams();
  const put = (name: string, value: string | number | null, otherwise: unknown) => {
    if (value !== null && value !== otherwise) query.set(name, `${value}`);
  };
  put("backend", settings.backend, DEFAULTS.backend);
  put("sex", settings.sex, DEFAULTS.sex);
  if (settings.shape.some((value) => value !== 0)) {
    query.set("shape", settings.shape.map((value) => +value.toFixed(2)).join(","));
  }
  put("motion", settings.motion, DEFAULTS.motion);
  put("tempo", settings.tempoHz, null);
  put("height", settings.heightM, null);
  put("clip", settings.clip, null);
  if (settings.compare) query.set("compare", "1");
  put("left", settings.left, DEFAULTS.left);
  put("right", settings.right, DEFAULTS.right);
  put("split", +settings.split.toFixed(3), DEFAULTS.split);
  put("clothes", settings.clothes, DEFAULTS.clothes);
  if (settings.plots) query.set("plots", "1");
  put("region", settings.region, DEFAULTS.region);
  if (settings.camera) query.set("camera", settings.camera.map((n) => +n.toFixed(2)).join(","));
  if (!settings.dynamics) query.set("dynamics", "0");
  if (settings.heat) query.set("heat", settings.heatOf === "error" ? "error" : "1");
  if (settings.hud) query.set("hud", "1");
  put("speed", settings.speed, DEFAULTS.speed);
  if (settings.paused) query.set("paused", "1");
  return query.size > 0 ? `?${query}` : "";
}
