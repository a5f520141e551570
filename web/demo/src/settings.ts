import { REGION_NAMES, type RegionName, SHAPE_LENGTH } from "dynaskin";
import { type ActorKind, actorsOf, type Sex } from "./actors.js";
import { CHAPTERS, type Chapter, chapterSettings } from "./chapters.js";
import { lessMotion } from "./less-motion.js";
import { withinBound } from "./likely.js";
import * as link from "./link.js";
import { findMotion, MOTION_NAMES, type MotionName } from "./motions.js";
import { STRENGTH, TISSUE_FACTORS, type TissueFactors } from "./tissue.js";
import { clipNamesOf } from "./truth.js";

/** The playback speeds that can be chosen. */
const SPEEDS = [0.1, 0.25, 0.5, 1];

/** How the actors share the picture. */
export const LAYOUTS = ["one", "wipe", "side"] as const;
export type Layout = (typeof LAYOUTS)[number];

/** A landing of the usual jump: what a page that may not move shows of it. */
const LANDING_SECONDS = 1.85;

/** Largest size of a shape coefficient, in standard deviations. */
export const SHAPE_LIMIT = 3;

/** Everything a link to the page can carry. */
export interface Settings {
  /** The graphics interface that was asked for. */
  backend: "auto" | "webgpu" | "webgl2";
  /** Whether fewer pixels are drawn while pictures come too slowly. */
  resolution: "adaptive" | "full";
  /** The part of the story that is told; null: the Lab, with all controls. */
  chapter: Chapter | null;
  /** Which body. */
  sex: Sex;
  /** Shape coefficients in standard deviations. */
  shape: readonly number[];
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
  /** What it is made of: matt plaster, or skin and cloth. */
  look: "sculpture" | "skin";
  /** Whether the plots are shown. */
  plots: boolean;
  /** The region that the plots are about. */
  region: RegionName;
  /** Yaw and pitch (radians), distance and height (metres) of the camera; null: as at the start. */
  camera: readonly number[] | null;
  /** Factor on all offsets. */
  strength: number;
  tissue: TissueFactors;
  /** Whether the network moves the skin. */
  dynamics: boolean;
  /** What the heat map shows: the offsets, or how far they are from ground truth. */
  heatOf: "offset" | "error";
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
  /** Where a motion that stands still stands, in seconds; null: it plays, or has no timeline. */
  timeSeconds: number | null;
}

/**
 * What has to be done where a setting has changed; `app.ts` says how. What only shows a setting reads it
 * in `Store.show`, and needs none.
 */
export type Consequence = "actors" | "shape" | "motion" | "tissue" | "plots" | "clock";

/** An element of the page that shows a setting and changes it, by its id. */
export type Control =
  | { kind: "switch"; id: string; key?: string }
  | { kind: "list"; id: string }
  /** Radio buttons in an element; their name is its id. */
  | { kind: "radios"; id: string };

/** All that the page knows of one setting: a new one is described here and nowhere else. */
export interface Setting<Value> {
  /** The page without any parameters. */
  usual: Value;
  /** How a link says it. */
  link: link.Codec<Value, Settings>;
  /** The element that sets it, where that takes no more than its value. */
  control?: Control;
  /** The values that the control can have, where it is no switch. */
  values?: readonly Value[];
  /** What follows from another value. */
  affects?: readonly Consequence[];
}

/** What a link may say beside the story's chapter; with anything else it leads into the Lab. */
const STORY_NAMES = ["chapter", "backend", "resolution", "sex"];

function readChapter(query: URLSearchParams): Chapter | null {
  if ([...query.keys()].some((name) => !STORY_NAMES.includes(name))) return null;
  return CHAPTERS.find((chapter) => chapter === query.get("chapter")) ?? CHAPTERS[0];
}

function writeChapter(query: URLSearchParams, chapter: Chapter | null): void {
  if (chapter !== null && chapter !== CHAPTERS[0]) query.set("chapter", chapter);
}

const actor = (name: "left" | "right", usual: ActorKind): Setting<ActorKind> => ({
  usual,
  link: link.word(name, usual, ({ sex, clip }) => actorsOf(sex, clip !== null)),
  affects: ["actors"],
});

const furtherActor = (name: "third" | "fourth"): Setting<ActorKind | null> => ({
  usual: null,
  link: link.wordOrNull(name, ({ sex, clip }) => actorsOf(sex, clip !== null)),
  affects: ["actors"],
});

const BACKENDS = ["auto", "webgpu", "webgl2"] as const;
const RESOLUTIONS = ["adaptive", "full"] as const;
const SEXES = ["female", "male"] as const;
const CLOTHES = ["sportswear", "unsupported"] as const;
const LOOKS = ["sculpture", "skin"] as const;
const AVERAGE: readonly number[] = new Array<number>(SHAPE_LENGTH).fill(0);

const anyShape = link.numbers<Settings>("shape", AVERAGE, SHAPE_LIMIT);

/** A link's body is a likely one, too. */
const likelyShape: link.Codec<readonly number[], Settings> = {
  ...anyShape,
  read: (query, all) => withinBound(anyShape.read(query, all)),
};

/**
 * The settings, in the order of the link. A link is read in the same order: what stands further up is
 * known further down.
 */
export const SETTINGS: { readonly [Name in keyof Settings]: Setting<Settings[Name]> } = {
  backend: { usual: "auto", link: link.word("backend", "auto", () => BACKENDS) },
  resolution: { usual: "adaptive", link: link.word("resolution", "adaptive", () => RESOLUTIONS) },
  chapter: {
    usual: null,
    link: { read: readChapter, write: writeChapter },
    affects: ["actors"],
  },
  sex: {
    usual: "female",
    link: link.word("sex", "female", () => SEXES),
    affects: ["actors"],
  },
  shape: { usual: AVERAGE, link: likelyShape, affects: ["shape"] },
  motion: { usual: "jump", link: link.word("motion", "jump", () => MOTION_NAMES) },
  tempoHz: {
    usual: null,
    link: link.numberOrNull("tempo", ({ motion }) => findMotion(motion)?.tempoHz),
    affects: ["motion"],
  },
  heightM: {
    usual: null,
    link: link.numberOrNull("height", ({ motion }) => findMotion(motion)?.heightM),
    affects: ["motion"],
  },
  clip: {
    usual: null,
    link: link.wordOrNull("clip", ({ sex }) => clipNamesOf(sex)),
    affects: ["actors"],
  },
  layout: {
    usual: "side",
    link: link.word("view", "side", () => LAYOUTS),
    control: { kind: "radios", id: "layout" },
    values: LAYOUTS,
    affects: ["actors"],
  },
  left: actor("left", "linear"),
  right: actor("right", "dynaskin"),
  third: furtherActor("third"),
  fourth: furtherActor("fourth"),
  split: { usual: 0.5, link: link.number("split", 0.5, [0, 0, 1], 3) },
  clothes: {
    usual: "sportswear",
    link: link.word("clothes", "sportswear", () => CLOTHES),
    affects: ["tissue"],
  },
  look: {
    usual: "sculpture",
    link: link.word("look", "sculpture", () => LOOKS),
    control: { kind: "radios", id: "look" },
    values: LOOKS,
  },
  plots: {
    usual: false,
    link: link.flag("plots", false),
    control: { kind: "switch", id: "plots-toggle", key: "g" },
    affects: ["plots"],
  },
  region: {
    usual: "chest",
    link: link.word("region", "chest", () => REGION_NAMES),
    control: { kind: "list", id: "region" },
    values: REGION_NAMES,
    affects: ["plots"],
  },
  camera: { usual: null, link: link.place("camera") },
  strength: { usual: 1, link: link.number("strength", 1, STRENGTH), affects: ["tissue"] },
  tissue: {
    usual: { gain: {}, stiffness: {}, damping: {} },
    link: link.tissue(TISSUE_FACTORS, REGION_NAMES),
    affects: ["tissue"],
  },
  dynamics: {
    usual: true,
    link: link.flag("dynamics", true),
    control: { kind: "switch", id: "dynamics", key: "d" },
    affects: ["tissue"],
  },
  heatOf: {
    usual: "offset",
    link: {
      read: (query) => (query.get("heat") === "error" ? "error" : "offset"),
      write: () => {},
    },
    control: { kind: "radios", id: "heat-of" },
    values: ["offset", "error"],
  },
  heat: {
    usual: false,
    link: {
      read: (query) => query.get("heat") === "error" || link.isOn(query, "heat", false),
      write: (query, on, { heatOf }) => {
        if (on) query.set("heat", heatOf === "error" ? "error" : "1");
      },
    },
    control: { kind: "switch", id: "heat", key: "m" },
  },
  caption: { usual: true, link: link.flag("caption", true) },
  hud: {
    usual: false,
    link: link.flag("hud", false),
    control: { kind: "switch", id: "hud-toggle", key: "t" },
  },
  speed: {
    usual: 1,
    link: link.nearest("speed", 1, SPEEDS),
    control: { kind: "list", id: "speed" },
    values: SPEEDS,
    affects: ["clock"],
  },
  paused: {
    usual: false,
    link: link.flag("paused", false, () => lessMotion.matches),
    affects: ["clock"],
  },
  timeSeconds: {
    usual: null,
    link: {
      read: (query, { clip, motion }) =>
        link.numberIn(query, "time", [0, 0, 3600]) ??
        (lessMotion.matches && !query.has("paused") && clip === null && motion === "jump"
          ? LANDING_SECONDS
          : null),
      write: (query, seconds, { paused }) => {
        if (paused && seconds !== null) query.set("time", seconds.toFixed(3));
      },
    },
  },
};

/** The names of all settings, in the order of the link. */
export const SETTING_NAMES = Object.keys(SETTINGS) as (keyof Settings)[];

/** The page without any parameters. */
export const USUAL = Object.fromEntries(
  SETTING_NAMES.map((name) => [name, SETTINGS[name].usual]),
) as unknown as Readonly<Settings>;

/**
 * Reads the settings from a link; what makes no sense is left at its usual value. Numbers out of range
 * become the nearest in it: the range of the link's own motion, for tempo and height.
 */
export function readSettings(search: string): Settings {
  const query = new URLSearchParams(search);
  const settings: Settings = { ...USUAL };
  for (const name of SETTING_NAMES) {
    Object.assign(settings, { [name]: SETTINGS[name].link.read(query, settings) });
  }
  if (settings.chapter) Object.assign(settings, chapterSettings(settings.chapter));
  return settings;
}

/** The settings as a link, with only what is not as usual. */
export function writeSettings(settings: Readonly<Settings>): string {
  const query = new URLSearchParams();
  // The rest follows from the chapter.
  const names = settings.chapter
    ? SETTING_NAMES.filter((name) => STORY_NAMES.includes(name))
    : SETTING_NAMES;
  for (const name of names) {
    const { write } = SETTINGS[name].link as link.Codec<unknown, Settings>;
    write(query, settings[name], settings);
  }
  if (!settings.chapter && readChapter(query)) query.set("lab", "1");
  // Commas and colons may stand as they are, and read better.
  const text = `${query}`.replaceAll("%2C", ",").replaceAll("%3A", ":");
  return query.size > 0 ? `?${text}` : "";
}
