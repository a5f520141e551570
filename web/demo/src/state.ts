import type { Shape } from "dynaskin";
import { type ActorKind, actorsOf, isMethod, type Sex, SLOTS, type Slot } from "./actors.js";
import type { Cast } from "./cast.js";
import { troupe } from "./chapters.js";
import type { MotionFile } from "./motions.js";
import { narrowScreen } from "./narrow.js";
import { type Layout, SETTING_NAMES, type Settings, USUAL } from "./settings.js";
import { Store } from "./store.js";
import { clipNamesOf, type TruthClip } from "./truth.js";

/** An actor on the screen. */
export interface Shown {
  slot: Slot | "fifth";
  kind: ActorKind;
  /** Another shape than that of the settings, and what its body is called. */
  shape?: Shape;
  label?: string;
}

/** The places of the story's five bodies. */
const FIVE = [...SLOTS, "fifth"] as const;

/** What the page does before its next picture, because controls ask more often than pictures come. */
export interface Waiting {
  /** Make the motion anew. */
  motion: boolean;
  /** Jump to this moment; null: to none. */
  seekSeconds: number | null;
  /** Move the camera to the body at once, which may be somewhere else than in the picture before. */
  camera: boolean;
}

/** What the page is about at the moment, beside what a link can carry. */
export interface Session {
  /** The body on the screen with the networks that are there; null before the first. */
  cast: Cast | null;
  /** The actors on the screen, one for each avatar. */
  shown: readonly Shown[];
  /** How they share the picture: that of the settings, once all actors are there. */
  shownLayout: Layout;
  /** Whether the actors, networks and clip that the link asked for are on the screen. */
  isComplete: boolean;
  /** The clip that plays where no file does; null: none. */
  truth: TruthClip | null;
  /** The motion file that plays; null: none. */
  file: MotionFile | null;
  /** What played before the file, to go back to if the avatar refuses one of its poses. */
  fileBefore: MotionFile | null;
  /** Whose key or name is held down. */
  held: Shown["slot"] | null;
  /** Whether the picture stands still because the benchmark runs. */
  isMeasuring: boolean;
  /** Whether drawing has failed, and is not tried again. */
  hasFailed: boolean;
  /** Whether two actors beside each other have a camera each, because it is close to them. */
  isPaired: boolean;
  /** Whether the controls are a sheet at the bottom, beside a picture that has room for two. */
  isNarrow: boolean;
  /** The moment to begin at; null once it has begun, or from the motion's beginning. */
  startSeconds: number | null;
  waiting: Waiting;
}

/** Everything that the page shows and does depends on this. */
export type State = Settings & Session;
export type PageStore = Store<State>;

export const NOTHING_WAITS: Waiting = { motion: false, seekSeconds: null, camera: false };

/** The page's store, with the settings of a link. */
export function createStore(settings: Settings): PageStore {
  const store = new Store<State>({
    ...settings,
    cast: null,
    shown: [],
    shownLayout: settings.layout,
    isComplete: false,
    truth: null,
    file: null,
    fileBefore: null,
    held: null,
    isMeasuring: false,
    hasFailed: false,
    isPaired: false,
    isNarrow: narrowScreen.matches,
    startSeconds: settings.timeSeconds,
    waiting: NOTHING_WAITS,
  });
  narrowScreen.addEventListener("change", ({ matches }) => store.change({ isNarrow: matches }));
  return store;
}

/** The settings of a state. */
export function settingsOf(state: Readonly<State>): Settings {
  return Object.fromEntries(
    SETTING_NAMES.map((name) => [name, state[name]]),
  ) as unknown as Settings;
}

/** The actors that the settings ask for, from left to right; a narrow screen has room for two. */
export function wantedActors(state: Readonly<Settings & Pick<Session, "isNarrow">>): Shown[] {
  if (state.chapter === "bodies") {
    return troupe(state.sex, state.isNarrow).map(({ shape, label }, idx) => ({
      ...{ slot: FIVE[idx] ?? "fifth", kind: "dynaskin", shape, label },
    }));
  }
  const taken = SLOTS.flatMap((slot) => {
    const kind = state[slot];
    return kind === null ? [] : [{ slot, kind }];
  });
  if (state.layout === "one") return taken.filter(({ slot }) => slot === "right");
  return taken.slice(0, state.layout === "wipe" || state.isNarrow ? 2 : SLOTS.length);
}

/** Which actor of a row is shown alone, in its middle, while it is held; null: all. */
export function aloneOf({ shownLayout, shown, held }: Readonly<State>): number | null {
  const idx = shown.findIndex(({ slot }) => slot === held);
  return shownLayout === "side" && shown.length > 1 && idx >= 0 ? idx : null;
}

/** Whether the only actor is held, to see it without its tissue. */
export function isPlain({ shownLayout, held }: Readonly<State>): boolean {
  return shownLayout === "one" && held === "left";
}

/** Whether anything moves the skin of the actors that is not part of their motion. */
export function isMoved(state: Readonly<State>): boolean {
  return state.dynamics && state.strength > 0 && !isPlain(state);
}

/** How many bodies the picture has side by side. */
export function bodyCount(state: Readonly<State>): number {
  if (state.isPaired) return 1;
  return state.shownLayout === "side" && aloneOf(state) === null ? state.shown.length : 1;
}

/** Whether the left canvas and the right one show an actor each: under a divider, or close by. */
export function hasTwoPictures(state: Readonly<State>): boolean {
  return isDivided(state) || state.isPaired;
}

/** Whether these settings need the core that runs any network and reads motion files. */
export function needsWholeCore(
  state: Readonly<Settings & Pick<Session, "isNarrow" | "file">>,
): boolean {
  return state.file !== null || wantedActors(state).some(({ kind }) => isMethod(kind));
}

/** Whether two actors are left and right of a divider. */
export function isDivided({ shownLayout, shown }: Readonly<State>): boolean {
  return shownLayout === "wipe" && shown.length === 2;
}

/** Whether the heat map shows the error. */
export function showsError({ heatOf, truth, file }: Readonly<State>): boolean {
  return heatOf === "error" && truth !== null && file === null;
}

/**
 * Those that the page begins with, in the places of actors that the body and the motion of these
 * settings do not have, such as ground truth where no clip plays.
 */
function withoutMissing(settings: Readonly<Settings>): Partial<Settings> {
  const known = actorsOf(settings.sex, settings.clip !== null);
  const missing = SLOTS.filter((slot) => {
    const kind = settings[slot];
    return kind !== null && !known.includes(kind);
  });
  return Object.fromEntries(missing.map((slot) => [slot, USUAL[slot]]));
}

/** Ground truth beside the other actors, where it is not among them yet. */
function withTruth(state: Readonly<State>): Partial<Settings> {
  if (wantedActors(state).some(({ kind }) => kind === "truth")) return {};
  const { layout, isNarrow, third } = state;
  const shared = layout === "one" ? ({ layout: isNarrow ? "wipe" : "side" } as const) : {};
  const divided = (shared.layout ?? layout) === "wipe";
  if (divided || isNarrow) return { ...shared, left: "truth" };
  // Nobody whom the visitor has chosen leaves for it.
  if (third !== null && state.fourth !== null) return shared;
  return { ...shared, [third === null ? "third" : "fourth"]: "truth" };
}

/** Another body: a clip and actors that it does not have leave. */
export function chooseBody(store: PageStore, sex: Sex): void {
  const { clip } = store.state;
  const kept = clip !== null && clipNamesOf(sex).includes(clip) ? clip : null;
  const next = { sex, clip: kept };
  store.change({ ...next, ...withoutMissing({ ...store.state, ...next }) });
}

/** Another motion, or a clip with its ground truth, at the usual tempo and height. No file plays then. */
export function chooseMotion(
  store: PageStore,
  motion: Settings["motion"],
  clip: string | null,
): void {
  const chosen = { motion, clip, tempoHz: null, heightM: null, file: null, fileBefore: null };
  const state = { ...store.state, ...chosen };
  store.change({ ...chosen, ...(clip === null ? clipLeft(store.state) : withTruth(state)) });
}

/** Where no clip plays there is no ground truth to show. */
export function leaveClip(store: PageStore): void {
  store.change(clipLeft(store.state));
}

function clipLeft(state: Readonly<State>): Partial<Settings> {
  if (state.clip === null && !state.truth) return {};
  const heatOf = USUAL.heatOf;
  return { clip: null, heatOf, ...withoutMissing({ ...state, clip: null }) };
}

/** The first two change places. */
export function swapFirstTwo(store: PageStore): void {
  const { left, right } = store.state;
  store.change({ left: right, right: left });
}

/** One of the things to do before the next picture. */
export function wait(store: PageStore, what: Partial<Waiting>): void {
  store.change({ waiting: { ...store.state.waiting, ...what } });
}
