// What page and worker say to each other, and the tables that both go by.
import type { RestBody } from "../adapter/vertex-map.js";
import type { Avatar, StepTimings } from "../avatar.js";
import type { AvatarParts, BindWish } from "../bind/parts.js";
import type { Bundle } from "../bundle.js";
import type { Crowd, CrowdReport } from "../crowd.js";
import { checkDistance, type Detail, detailIndex } from "../detail.js";
import { type Figure, figureNumbers, isFigure, type Shape } from "../figure.js";
import type { ModelFiles } from "../load.js";
import type { FileArguments, MotionReading } from "../motion.js";
import { checkLength, SHAPE_LENGTH } from "../pose.js";
import { poseSourceIndex } from "../pose-source.js";
import { isDualQuaternion } from "../skinning.js";
import type { Progress } from "../source.js";
import { checkScale } from "./refusals.js";

/** Arrays of one surface; they travel to the worker and back instead of being copied. */
export type SurfaceArrays = Record<(typeof SURFACE)[number], Float32Array>;

/** What a surface is made of. */
export const SURFACE = ["offsets", "positions", "normals", "skinMatrices"] as const;

/** How the page deals with something that is set by assignment. */
interface Setting<Value> {
  /** Refuses what the worker would refuse, and gives what is sent. */
  check: (value: Value) => Value;
  /** Nothing to be seen depends on it, so no answer comes. */
  silent?: true;
}

/** A check that gives back what it does not refuse. */
const unless =
  <Value>(refuse: (value: Value) => unknown) =>
  (value: Value): Value => {
    refuse(value);
    return value;
  };

/** What is set on an avatar by assignment: one line here is all that another one needs. */
export const AVATAR_SETTINGS = {
  dynamics: { check: Boolean },
  visible: { check: Boolean },
  detail: { check: unless(detailIndex) },
  poseCorrectives: { check: Boolean },
  poseSource: { check: unless(poseSourceIndex) },
  skinning: { check: unless(isDualQuaternion) },
  scale: { check: unless(checkScale) },
  distanceM: { check: unless(checkDistance), silent: true },
} satisfies { [Name in keyof Avatar]?: Setting<Avatar[Name]> };

/** An avatar's properties that are set by assignment, as the class declares them. */
export type AvatarProperties = Pick<Avatar, keyof typeof AVATAR_SETTINGS>;

/** How an avatar is set. */
export interface AvatarSettings extends AvatarProperties, Pick<Avatar, "controls"> {}

/** How a crowd is set. */
export type CrowdSettings = Pick<Crowd, "levelOfDetail">;

/** A shape as it is sent. */
export type SentShape = number[] | Figure;

/**
 * Refuses what is no shape, before it is sent.
 *
 * @throws DynaSkinError `argument` for a wrong length or an unknown measure
 */
export function checkedShape(shape: Shape): SentShape {
  if (isFigure(shape)) {
    figureNumbers(shape);
    return { ...shape };
  }
  checkLength("shape", shape, SHAPE_LENGTH);
  return Array.from(shape);
}

/** The surface at one moment, and the shape that belongs to it. */
export interface Shown extends Pick<Avatar, "shape" | "figure" | "revision"> {
  surface: SurfaceArrays;
  restJointsM: Float32Array;
}

/** All of an object that may change between steps. */
export interface State<Settings> {
  settings: Partial<Settings>;
  /** Of an avatar. */
  shown?: Shown;
}

/** Stands for an object of the worker. */
export interface Ref {
  ref: number;
}

/** What may be done to an object: a method of its class, or a property that is set. */
export type Doing<Target> = {
  [Name in keyof Target]: Target[Name] extends (...args: infer Args) => unknown
    ? [name: Name, ...args: Sent<Args>]
    : [name: Name, value: Target[Name]];
}[keyof Target];

/** Objects of the worker are sent as what stands for them. */
type Sent<Args extends unknown[]> = {
  [Idx in keyof Args]: Args[Idx] extends Avatar ? Ref : Args[Idx];
};

/** What the worker can be asked: what is sent, and what comes back. It answers in order. */
export interface Calls {
  /** Loads the model. Meanwhile the worker says every so often that it is alive. */
  load: {
    sent: {
      model: string | ModelFiles;
      wasm?: string | ArrayBuffer | WebAssembly.Module;
      aliveEveryMs: number;
    };
    back: Bundle;
  };
  /** Reads a motion file; says on the way how far it is. It needs no model. */
  readMotion: {
    sent: {
      file: Blob | Uint8Array;
      restJointsM: Float32Array;
      how: FileArguments;
      wasm?: string | ArrayBuffer | WebAssembly.Module;
      aliveEveryMs: number;
    };
    back: MotionReading;
  };
  /** Binds an avatar; says on the way how far it is. It needs no model. */
  bind: {
    sent: {
      parts: AvatarParts;
      /** The body's file. */
      body: Uint8Array;
      wish: BindWish;
      wasm?: string | ArrayBuffer | WebAssembly.Module;
      aliveEveryMs: number;
    };
    back: Uint8Array;
  };
  /** Makes an avatar and calls it `target`. */
  createAvatar: {
    sent: { target: number; shape?: SentShape; wantsRest: boolean };
    /** `rest` where it was wanted: it is the same for all avatars of a model. */
    back: State<AvatarSettings> & { shown: Shown; rest?: RestBody };
  };
  /** Makes a crowd and calls it `target`. */
  createCrowd: { sent: { target: number }; back: State<CrowdSettings> };
  /** Steps an avatar, or a crowd of these avatars; brings the buffers back, filled. */
  step: {
    sent: {
      target: number;
      avatars: number[];
      poses: Float64Array;
      dtSeconds: number;
      surfaces: SurfaceArrays[];
    };
    back: Stepped;
  };
  /** Does something to an object. */
  do: {
    sent: { target: number; doing: Doing<Avatar> | Doing<Crowd> };
    back: { value: unknown; state: State<AvatarSettings | CrowdSettings> };
  };
  /** Frees an object. */
  dispose: { sent: { target: number }; back: null };
}

/** What a step gave. */
export interface Stepped {
  poses: Float64Array;
  surfaces: SurfaceArrays[];
  /** Of each avatar: a crowd may have chosen it. */
  details: Detail[];
  /** Of an avatar alone. */
  timings?: StepTimings;
  /** Of a crowd. */
  report?: CrowdReport;
}

/** What the page sends. Without an `id` no answer comes. */
export type Request = {
  [Name in keyof Calls]: { id?: number; call: Name; sent: Calls[Name]["sent"] };
}[keyof Calls];

/** What the worker sends. */
export type Message =
  | { type: "alive" }
  | { type: "progress"; progress: Progress }
  | { type: "read"; fraction: number }
  | { type: "answer"; id: number; back: unknown }
  | { type: "refusal"; id: number; code: string; message: string; settings?: object };

/** The buffers of a surface, for the transfer list. */
export function buffersOf(surface: SurfaceArrays): ArrayBuffer[] {
  return SURFACE.map((name) => surface[name].buffer as ArrayBuffer);
}

/** A surface of its own, from views that may change or go empty. */
export function copySurface(source: SurfaceArrays): SurfaceArrays {
  const copies = SURFACE.map((name) => [name, source[name].slice()]);
  return Object.fromEntries(copies) as SurfaceArrays;
}

/** Copies a surface into another of the same body. */
export function fillSurface(target: SurfaceArrays, source: SurfaceArrays): void {
  for (const name of SURFACE) target[name].set(source[name]);
}
