import { Avatar } from "./avatar.js";
import { checkName, checkNumber, checkObject } from "./check.js";
import type { Core } from "./core.js";
import { DynaSkinError } from "./error.js";
import { checkLength, JOINT_NAMES, type JointName, POSE_LENGTH, type Pose } from "./pose.js";
import type { CoreMotion } from "./wasm/core.js";

/** The motions the SDK can make by itself. */
export const PROCEDURAL_MOTIONS = [
  "jump",
  "hop",
  "one-leg-hop",
  "jumping-jacks",
  "run-in-place",
  "walk",
  "twist",
  "shake-hips",
] as const;

/** Name of a motion the SDK can make by itself. */
export type ProceduralName = (typeof PROCEDURAL_MOTIONS)[number];

/** Parameters of a procedural motion; what is left out is the motion's usual. */
export interface MotionOptions {
  /** Repetitions per second. */
  tempoHz?: number;
  /** Height of the flight, lift of the foot or amplitude of the hips, in metres. */
  heightM?: number;
  /** Length in seconds, with standing still at both ends; 8 if left out. */
  durationSeconds?: number;
}

/** What you know of a BVH file and it does not say, or says otherwise. */
export interface BvhOptions {
  /**
   * The file's names of some of the body's joints, such as `{ left_hip: "Bone_17" }`; they go before
   * what names would be taken for.
   */
  joints?: Partial<Record<JointName, string>>;
  /** Frames per second, in place of the file's frame time. */
  rateHz?: number;
}

/**
 * What you know of a motion file and it does not say, or says otherwise. An option that the kind of
 * file has no use for is an error.
 */
export interface MotionFileOptions extends BvhOptions {
  /** For glTF: the animation's name, or its place counted from 0. Left out, the one that moves most plays. */
  animation?: string | number;
  /** For SMPL poses: the axis that points up. Left out, it is the file's, or found by the body. */
  up?: "y" | "z" | "-y";
}

/** An animation of a binary glTF file. */
export interface AnimationInfo {
  /** Its name as it stands in the file, of any content; empty where it has none. */
  name: string;
  /** Time from its first keyframe to its last, in seconds. */
  seconds: number;
  /** How many joints it turns by half a degree and more; 0 for a pose held. */
  movingJoints: number;
}

/** A joint of the body that a motion file turns. */
export interface MappedJoint {
  /** The body's joint. */
  joint: JointName;
  /** The file's name of the joint that turns it. */
  source: string;
}

/** What became of the joints of a motion file. Names stand here as in the file: show them as text. */
export interface JointReport {
  /** The body's joints and the file's joint that turns each. */
  mapped: MappedJoint[];
  /** The body's joints that nothing in the file turns; they follow their neighbours. */
  missing: JointName[];
  /** The file's joints that turn nothing on the body, such as fingers. */
  unmapped: string[];
  /** The file's unit of length as its legs suggest, in English. */
  unit: string;
  /** The file's time step in seconds. */
  frameSeconds: number;
  /**
   * What was found other than usual and how it was taken, and what could not be made out, a sentence
   * each: exchanged sides, a zero pose that does not stand, feet that never stand. The same as
   * {@link Motion.notes}.
   */
  notes: string[];
}

/** Most poses of a motion, as in the core: 45 minutes at 60 Hz. */
const MAX_POSES = 162_000;

/** Largest motion file in bytes. */
const MAX_FILE_BYTES = 256 * 2 ** 20;

/**
 * A clip of poses for one body, resampled to 60 Hz. Made for an avatar's present shape: after a
 * change of shape, make it again, or feet leave the floor.
 */
export class Motion {
  /** Name of the motion: for a file what stands in it, of any content. Show it as text, never as HTML. */
  readonly name: string;
  /** Length in seconds. */
  readonly durationSeconds: number;
  /** For a file of named joints: what became of them. SMPL poses (npz) need no matching of names. */
  readonly jointReport: JointReport | null;
  /**
   * For a file: what it did not say or lacks, what was found other than usual, and how it was taken, a
   * sentence each without its first capital and full stop; empty where all is as usual.
   */
  readonly notes: readonly string[];
  readonly #core: Core;
  #raw: CoreMotion | null;

  private constructor(
    core: Core,
    raw: CoreMotion,
    jointReport: JointReport | null,
    notes: readonly string[] = raw.notes,
  ) {
    this.#core = core;
    this.#raw = raw;
    this.name = raw.name;
    this.durationSeconds = raw.durationSeconds;
    this.jointReport = jointReport;
    this.notes = notes;
  }

  /**
   * Reads a BVH file and carries its motion over to the avatar's skeleton.
   *
   * @throws DynaSkinError `argument` for what are no bytes, no avatar or no options, `motion` for a file
   *   that is no BVH, has no whole frame or shows no person, and for names that it does not have
   */
  static fromBvh(file: ArrayBuffer | Uint8Array, avatar: Avatar, options: BvhOptions = {}): Motion {
    checkAvatar(avatar);
    const bytes = bytesOf("fromBvh", file);
    const joints = jointPairs(options);
    checkUnknown(options, ["joints", "rateHz"]);
    return Motion.#read(avatar.core, () => avatar.raw.motionFromBvh(bytes, joints, options.rateHz));
  }

  /**
   * Reads a motion file of any known kind, told apart by its content, and carries its motion over
   * to the avatar's skeleton:
   *
   * - BVH;
   * - an animation in binary glTF (`.glb`, `.vrm`, `.vrma`), of which the one that moves the most
   *   joints plays unless you choose another ({@link Motion.animations}); joints are matched by VRM's
   *   humanoid where the file has one, else by name;
   * - SMPL, SMPL-H or SMPL-X poses as AMASS stores them (`.npz`).
   *
   * @throws DynaSkinError `argument` for what are no bytes, no avatar or no options, `motion` for any
   *   other file, a broken one or one that shows no person, for names that it does not have, and for
   *   options that its kind has no use for
   */
  static fromFile(
    file: ArrayBuffer | Uint8Array,
    avatar: Avatar,
    options: MotionFileOptions = {},
  ): Motion {
    checkAvatar(avatar);
    const bytes = bytesOf("fromFile", file);
    const how = fileArguments(options);
    return Motion.#read(avatar.core, () => avatar.raw.motionFromFile(bytes, ...how));
  }

  /**
   * Takes over what a worker has read for an avatar's skeleton.
   *
   * @internal
   */
  static fromReading(reading: MotionReading, avatar: Avatar): Motion {
    const { name, poses, jointReport, notes } = reading;
    return avatar.core.guard(() => {
      const raw = avatar.raw.motionFromPoses(name, poses, MOTION_RATE_HZ);
      return new Motion(avatar.core, raw, jointReport, notes);
    });
  }

  /**
   * Lists the animations of a binary glTF file (`.glb`, `.vrm`, `.vrma`), in its order, for
   * {@link MotionFileOptions.animation}.
   *
   * @throws DynaSkinError `argument` for what are no bytes or no avatar, `motion` for a file of another
   *   kind or a broken one
   */
  static animations(file: ArrayBuffer | Uint8Array, avatar: Avatar): AnimationInfo[] {
    checkAvatar(avatar);
    const bytes = bytesOf("animations", file);
    return avatar.core.guard(() => avatar.raw.animationsOf(bytes) as AnimationInfo[]);
  }

  static #read(core: Core, read: () => CoreMotion): Motion {
    return core.guard(() => {
      const raw = read();
      return new Motion(core, raw, raw.jointReport() as JointReport | null);
    });
  }

  /**
   * Makes a test motion for the avatar's skeleton. It starts and ends standing still.
   *
   * @throws DynaSkinError `argument` for an unknown name, `motion` for a parameter out of range or
   *   a flight that does not fit the tempo
   */
  static procedural(name: ProceduralName, avatar: Avatar, options: MotionOptions = {}): Motion {
    if (!PROCEDURAL_MOTIONS.includes(name)) {
      const known = PROCEDURAL_MOTIONS.join(", ");
      throw new DynaSkinError("argument", `There is no motion ${name}; there are ${known}.`);
    }
    checkAvatar(avatar);
    checkObject("options", options);
    const { tempoHz, heightM, durationSeconds } = options;
    for (const [what, value] of Object.entries({ tempoHz, heightM, durationSeconds })) {
      if (value !== undefined) checkNumber(what, value);
    }
    const raw = avatar.core.guard(() =>
      avatar.raw.motionProcedural(name, tempoHz, heightM, durationSeconds),
    );
    return new Motion(avatar.core, raw, null);
  }

  /**
   * Makes a motion of poses that you have, such as a recording's.
   *
   * @param poses - {@link POSE_LENGTH} numbers a pose, one pose after the other; see {@link Pose}
   * @param rateHz - poses per second, 1 to 1000
   * @param avatar - whose skeleton the poses are for
   * @param name - the motion's name, for people
   * @throws DynaSkinError `argument` for what is no Float64Array of whole poses, `pose` for numbers
   *   that are not finite or quaternions that are not of unit length, `motion` for no poses, more than
   *   162,000, or a rate out of range
   */
  static fromPoses(poses: Float64Array, rateHz: number, avatar: Avatar, name = "poses"): Motion {
    if (!(poses instanceof Float64Array)) {
      throw new DynaSkinError("argument", "fromPoses takes a Float64Array of 99 numbers a pose.");
    }
    // Counted here: the core's memory, once grown for a copy, never shrinks again.
    if (poses.length > MAX_POSES * POSE_LENGTH) {
      const count = Math.floor(poses.length / POSE_LENGTH);
      throw new DynaSkinError(
        "motion",
        `There are ${count} poses; at most ${MAX_POSES} are taken.`,
      );
    }
    checkNumber("rateHz", rateHz);
    checkName("name", name);
    checkAvatar(avatar);
    const raw = avatar.core.guard(() => avatar.raw.motionFromPoses(name, poses, rateHz));
    return new Motion(avatar.core, raw, null);
  }

  /**
   * Writes the pose at a time into `out` and returns it. Times outside the motion give its first or
   * last pose; between frames the motion is smooth.
   *
   * @throws DynaSkinError `argument` for an `out` of the wrong type or length
   */
  poseAt(timeSeconds: number, out: Pose = new Float64Array(POSE_LENGTH)): Pose {
    checkNumber("timeSeconds", timeSeconds);
    checkLength("out", out, POSE_LENGTH);
    if (!(out instanceof Float64Array)) {
      throw new DynaSkinError(
        "argument",
        "out must be a Float64Array: poses are double precision.",
      );
    }
    const raw = this.#raw;
    if (!raw) throw new DynaSkinError("disposed", "This motion was used after dispose().");
    this.#core.guard(() => raw.poseAt(timeSeconds, out));
    return out;
  }

  /** Frees the motion's memory. May be called again. */
  dispose(): void {
    this.#core.free(this.#raw);
    this.#raw = null;
  }
}

/** What a worker reads of a file: poses at 60 Hz, and what {@link Motion} says of it. */
export interface MotionReading {
  name: string;
  poses: Float64Array;
  jointReport: JointReport | null;
  notes: string[];
}

/** Poses a second of every motion. */
const MOTION_RATE_HZ = 60;

/** {@link MotionFileOptions} as the core takes them. */
export type FileArguments = [
  joints: string[],
  animation: string | number | undefined,
  rateHz: number | undefined,
  up: string | undefined,
];

/**
 * The options as the core takes them.
 *
 * @throws DynaSkinError `argument`
 * @internal
 */
export function fileArguments(options: MotionFileOptions): FileArguments {
  const joints = jointPairs(options);
  checkUnknown(options, ["joints", "rateHz", "animation", "up"]);
  const { animation, rateHz, up } = options;
  const isPlace = typeof animation === "number" && Number.isInteger(animation) && animation >= 0;
  if (!isPlace && typeof animation !== "string" && animation !== undefined) {
    const message = "animation must be a name, or a whole number counted from 0.";
    throw new DynaSkinError("argument", message);
  }
  if (typeof animation === "string") checkName("animation", animation);
  if (up !== undefined) checkName("up", up);
  return [joints, animation, rateHz, up];
}

/**
 * Refuses a file before it is copied into the core's memory, which never shrinks again.
 *
 * @throws DynaSkinError `motion`
 * @internal
 */
export function checkMotionSize(bytes: number): void {
  if (bytes <= MAX_FILE_BYTES) return;
  const [size, limit] = [bytes, MAX_FILE_BYTES].map((count) => Math.ceil(count / 2 ** 20));
  throw new DynaSkinError("motion", `The file has ${size} MiB; at most ${limit} MiB are read.`);
}

function bytesOf(what: string, file: ArrayBuffer | Uint8Array): Uint8Array {
  if (!(file instanceof Uint8Array || file instanceof ArrayBuffer)) {
    const message = `${what} takes the bytes of a file as an ArrayBuffer or a Uint8Array.`;
    throw new DynaSkinError("argument", message);
  }
  checkMotionSize(file.byteLength);
  if (file instanceof Uint8Array) return file;
  try {
    return new Uint8Array(file);
  } catch (cause) {
    const message = "The file's ArrayBuffer was transferred away and is empty; keep a copy.";
    throw new DynaSkinError("argument", message, { cause });
  }
}

/** Pairs of the body's joint and the file's, one after the other; checks the options on the way. */
function jointPairs(options: BvhOptions): string[] {
  checkObject("options", options);
  const { joints, rateHz } = options;
  if (rateHz !== undefined) checkNumber("rateHz", rateHz);
  if (joints === undefined) return [];
  checkObject("joints", joints);
  return Object.entries(joints).flatMap(([joint, name]) => {
    if (name === undefined) return [];
    if (!(JOINT_NAMES as readonly string[]).includes(joint)) {
      const known = JOINT_NAMES.join(", ");
      throw new DynaSkinError("argument", `The body has no joint ${joint}; it has ${known}.`);
    }
    checkName(`The file's name of ${joint}`, name);
    return [joint, name];
  });
}

/** Refuses options that there are not: a misspelt one would be passed over in silence. */
function checkUnknown(options: object, known: readonly string[]): void {
  const unknown = Object.keys(options).find((key) => !known.includes(key));
  if (unknown === undefined) return;
  const message = `There is no option ${unknown} for this file; there are ${known.join(", ")}.`;
  throw new DynaSkinError("argument", message);
}

/** @internal */
export function checkAvatar(avatar: unknown): void {
  if (avatar instanceof Avatar) return;
  throw new DynaSkinError("argument", "A motion needs an avatar, as createAvatar() gives it.");
}
