import { REGION_NAMES, type RegionName, SHAPE_LENGTH } from "dynaskin";
import { type ActorKind, actorsOf } from "./actors.js";
import { lessMotion } from "./less-motion.js";
import { findMotion, MOTION_NAMES, type MotionName } from "./motions.js";
import { clipNamesOf } from "./truth.js";

/** The playback speeds that can be chosen. */
const SPEEDS = [0.1, 0.25, 0.5, 1];

/** How the actors share the picture. */
export const LAYOUTS = ["one", "wipe", "side"] as const;
export type Layout = (typeof LAYOUTS)[number];

/** A landing of the usual jump: what a page that may not move shows of it. */
const LANDING_SECONDS = 1.85;

/** Lowest, usual and highest factor on all offsets; four times is the most that the core takes. */
export const STRENGTH = [0, 1, 4] as const;

/** Largest size of a shape coefficient, in standard deviations. */
export const SHAPE_LIMIT = 3;

/** What of a region can be changed: the offsets' size, and how stiff and how damped its tissue is. */
export const TISSUE_PROPERTIES = ["gain", "stiffness", "damping"] as const;
export type TissueProperty = (typeof TISSUE_PROPERTIES)[number];

/** Lowest, usual and highest factor on each. */
export const TISSUE_FACTORS: Record<TissueProperty, readonly [number, number, number]> = {
  gain: [0, 1, 2],
  stiffness: [0.25, 1, 4],
  damping: [0.25, 1, 4],
};

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
  /** One actor, two under a divider, or up to four beside each other. */
  layout: Layout;
  /** The actor left of the divider, or the first of those beside each other. */
  left: ActorKind;
  /** The actor right of the divider, the second of those beside each other, or the only one. */
  right: ActorKind;
  /** Further actors beside these; null: none. */
  third: ActorKind | null;
  fourth: ActorKind | null;
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
  /** Factor on all offsets. */
  strength: number;
  /** Factors on the tissue of regions, where they are not 1. */
  tissue: Record<TissueProperty, Partial<Record<RegionName, number>>>;
  /** Where a motion that stands still stands, in seconds; null: it plays, or has no timeline. */
  timeSeconds: number | null;
  /** Whether the network moves the skin. */
  dynamics: boolean;
  /** Whether the body shows its offsets as colours. */
  heat: boolean;
  /** Whether the caption says what there is to see. */
  caption: boolean;
  /** Whether the timings are shown. */
  hud: boolean;
  /** Playback speed: 0.1, 0.25, 0.5 or 1. */
  speed: number;
  /** Whether the motion stands still. */
  paused: boolean;
  /** Whether fewer pixels are drawn while pictures come too slowly. */
  resolution: "adaptive" | "full";
  /** The graphics interface that was asked for. */
  backend: "auto" | "webgpu" | "webgl2";
}

/** The page without any parameters. */
export const DEFAULTS: Settings = {
  sex: "female",
  shape: new Array<number>(SHAPE_LENGTH).fill(0),
  motion: "jump",
  tempoHz: null,
  heightM: null,
  clip: null,
  layout: "side",
  left: "linear",
  right: "dynaskin",
  third: null,
  fourth: null,
  split: 0.5,
  clothes: "sportswear",
  heatOf: "offset",
  plots: false,
  region: "chest",
  camera: null,
  strength: 1,
  tissue: { gain: {}, stiffness: {}, damping: {} },
  timeSeconds: null,
  dynamics: true,
  heat: false,
  caption: true,
  hud: false,
  speed: 1,
  paused: false,
  resolution: "adaptive",
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
  const clip = oneOf("clip", clipNamesOf(sex), "") || null;
  const actors = actorsOf(sex, clip !== null);
  const showsStill =
    lessMotion.matches && !query.has("paused") && clip === null && motion === DEFAULTS.motion;
  const camera = (query.get("camera") ?? "").split(",").map(Number.parseFloat);
  return {
    sex,
    clip,
    layout: oneOf("view", LAYOUTS, DEFAULTS.layout),
    left: oneOf("left", actors, DEFAULTS.left),
    right: oneOf("right", actors, DEFAULTS.right),
    third: oneOf("third", actors, "") || null,
    fourth: oneOf("fourth", actors, "") || null,
    split: inRange("split", [0, 0, 1]) ?? DEFAULTS.split,
    clothes: oneOf("clothes", ["sportswear", "unsupported"], DEFAULTS.clothes),
    heatOf: query.get("heat") === "error" ? "error" : "offset",
    plots: flag("plots", DEFAULTS.plots),
    region: oneOf("region", REGION_NAMES, DEFAULTS.region),
    camera: camera.length === 4 && camera.every(Number.isFinite) ? camera : null,
    shape: DEFAULTS.shape.map((zero, idx) => {
      const value = shape[idx];
      return Number.isFinite(value)
        ? Math.max(-SHAPE_LIMIT, Math.min(SHAPE_LIMIT, value as number))
        : zero;
    }),
    motion,
    tempoHz: inRange("tempo", choice?.tempoHz),
    heightM: inRange("height", choice?.heightM),
    strength: inRange("strength", STRENGTH) ?? DEFAULTS.strength,
    tissue: {
      gain: readFactors("gain", query),
      stiffness: readFactors("stiffness", query),
      damping: readFactors("damping", query),
    },
    timeSeconds: inRange("time", [0, 0, 3600]) ?? (showsStill ? LANDING_SECONDS : null),
    dynamics: flag("dynamics", DEFAULTS.dynamics),
    heat: query.get("heat") === "error" || flag("heat", DEFAULTS.heat),
    caption: flag("caption", DEFAULTS.caption),
    hud: flag("hud", DEFAULTS.hud),
    speed: nearest(SPEEDS, number("speed") ?? DEFAULTS.speed),
    paused: flag("paused", lessMotion.matches),
    resolution: oneOf("resolution", ["adaptive", "full"], DEFAULTS.resolution),
    backend: oneOf("backend", ["auto", "webgpu", "webgl2"], DEFAULTS.backend),
  };
}

/** Name of a property's factors in the address. */
const inAddress = (property: TissueProperty) => (property === "gain" ? "gains" : property);

/** Reads `chest:0.5,belly:2`. */
function readFactors(
  property: TissueProperty,
  query: URLSearchParams,
): Partial<Record<RegionName, number>> {
  const factors: Partial<Record<RegionName, number>> = {};
  const [low, , high] = TISSUE_FACTORS[property];
  for (const part of (query.get(inAddress(property)) ?? "").split(",")) {
    const [name, value] = part.split(":");
    const region = REGION_NAMES.find((known) => known === name);
    const factor = Number.parseFloat(value ?? "");
    if (region && Number.isFinite(factor)) {
      factors[region] = Math.max(low, Math.min(high, factor));
    }
  }
  return factors;
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
  put("resolution", settings.resolution, DEFAULTS.resolution);
  put("sex", settings.sex, DEFAULTS.sex);
  if (settings.shape.some((value) => value !== 0)) {
    query.set("shape", settings.shape.map((value) => +value.toFixed(2)).join(","));
  }
  put("motion", settings.motion, DEFAULTS.motion);
  put("tempo", settings.tempoHz, null);
  put("height", settings.heightM, null);
  put("clip", settings.clip, null);
  put("view", settings.layout, DEFAULTS.layout);
  put("left", settings.left, DEFAULTS.left);
  put("right", settings.right, DEFAULTS.right);
  put("third", settings.third, null);
  put("fourth", settings.fourth, null);
  put("split", +settings.split.toFixed(3), DEFAULTS.split);
  put("clothes", settings.clothes, DEFAULTS.clothes);
  if (settings.plots) query.set("plots", "1");
  put("region", settings.region, DEFAULTS.region);
  if (settings.camera) query.set("camera", settings.camera.map((n) => +n.toFixed(2)).join(","));
  put("strength", settings.strength, DEFAULTS.strength);
  for (const property of TISSUE_PROPERTIES) {
    const factors = Object.entries(settings.tissue[property]).filter(([, factor]) => factor !== 1);
    if (factors.length > 0) {
      const text = factors.map(([region, factor]) => `${region}:${+factor.toFixed(2)}`).join(",");
      query.set(inAddress(property), text);
    }
  }
  if (!settings.dynamics) query.set("dynamics", "0");
  if (settings.heat) query.set("heat", settings.heatOf === "error" ? "error" : "1");
  if (!settings.caption) query.set("caption", "0");
  if (settings.hud) query.set("hud", "1");
  put("speed", settings.speed, DEFAULTS.speed);
  if (settings.paused) query.set("paused", "1");
  if (settings.paused && settings.timeSeconds !== null) {
    query.set("time", settings.timeSeconds.toFixed(3));
  }
  return query.size > 0 ? `?${query}` : "";
}
