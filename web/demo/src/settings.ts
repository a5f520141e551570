import { type ProceduralName, SHAPE_LENGTH } from "dynaskin";
import { findMotion, MOTIONS } from "./motions.js";

/** The playback speeds that can be chosen. */
const SPEEDS = [0.1, 0.25, 0.5, 1];

/** Everything a link to the page can carry. */
export interface Settings {
  /** Which body. */
  sex: "female" | "male";
  /** Shape coefficients in standard deviations. */
  shape: number[];
  /** Name of a built-in motion. */
  motion: ProceduralName;
  /** Cycles per second of the motion; null: the motion's own. */
  tempoHz: number | null;
  /** Height of jumps in metres; null: the motion's own. */
  heightM: number | null;
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
  const inRange = (name: string, [min, , max]: [number, number, number]) => {
    const value = number(name);
    return value === null ? null : Math.max(min, Math.min(max, value));
  };
  const flag = (name: string, otherwise: boolean) =>
    query.has(name) ? ["", "1", "on", "true"].includes(query.get(name) ?? "") : otherwise;
  const shape = (query.get("shape") ?? "").split(",").map(Number.parseFloat);
  const motion = oneOf(
    "motion",
    MOTIONS.map(({ name }) => name),
    DEFAULTS.motion,
  );
  const choice = findMotion(motion);
  return {
    sex: oneOf("sex", ["female", "male"], DEFAULTS.sex),
    shape: DEFAULTS.shape.map((zero, idx) => {
      const value = shape[idx];
      return Number.isFinite(value) ? Math.max(-3, Math.min(3, value as number)) : zero;
    }),
    motion,
    tempoHz: inRange("tempo", choice.tempoHz),
    heightM: inRange("height", choice.heightM),
    dynamics: flag("dynamics", DEFAULTS.dynamics),
    heat: flag("heat", DEFAULTS.heat),
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
  if (!settings.dynamics) query.set("dynamics", "0");
  if (settings.heat) query.set("heat", "1");
  if (settings.hud) query.set("hud", "1");
  put("speed", settings.speed, DEFAULTS.speed);
  if (settings.paused) query.set("paused", "1");
  return query.size > 0 ? `?${query}` : "";
}
