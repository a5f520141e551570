import { Avatar } from "./avatar.js";
import { checkName, checkNumber, checkObject } from "./check.js";
import type { Core } from "./core.js";
import { DynaSkinError } from "./error.js";
import { checkLength, JOINT_NAMES, type JointName, POSE_LENGTH, type Pose } from "./pose.js";
import type { CoreMotion } from "./wasm/core.js";

/** The procedural motions of the SDK. */
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

/** Name of a procedural motion. */
export type ProceduralName = (typeof PROCEDURAL_MOTIONS)[number];

/** Parameters of a procedural motion; each has a default for the motion. */
export interface MotionOptions {
  /** Repetitions per second. */
  tempoHz?: number;
  /** Height of the flight, lift of the foot or amplitude of the hips, in metres. */
  heightM?: number;
  /** Length in seconds, with standing still at both ends; 8 if left out. */
  durationSeconds?: number;
}

/** What a BVH file does not state, or states wrongly. */
export interface BvhOptions {
  /**
   * The file's names of some of the body's joints, such as `{ left_hip: "Bone_17" }`; they take precedence
   * over recognition by name.
   */
  joints?: Partial<Record<JointName, string>>;
  /** Frames per second, in place of the file's frame time. */
  rateHz?: number;
}

/**
 * What a motion file does not state, or states wrongly. An option that does not apply to the kind of file
 * is an error.
 */
export interface MotionFileOptions extends BvhOptions {
  /** For glTF: the animation's name, or its index from 0; by default the one that moves the most joints. */
  animation?: string | number;
  /** For SMPL poses: the axis that points up; by default the file's, or detected from the body. */
  up?: "y" | "z" | "-y";
}

/** An animation of a binary glTF file. */
export interface AnimationInfo {
  /** Its name in the file, of any content; empty if it has none. */
  name: string;
  /** Time from its first keyframe to its last, in seconds. */
  seconds: number;
  /** Number of joints that it turns by half a degree or more; 0 for a held pose. */
  movingJoints: number;
}

/** A joint of the body that a motion file turns. */
export interface MappedJoint {
  /** The body's joint. */
  joint: JointName;
  /** The file's name of the joint that turns it. */
  source: string;
}

/** How the joints of a motion file were matched. Names are those in the file: show them as text. */
export interface JointReport {
  /** The body's joints and the file's joint that turns each. */
  mapped: MappedJoint[];
  /** The body's joints that nothing in the file turns; they follow their neighbours. */
  missing: JointName[];
  /** The file's joints that turn nothing on the body, such as fingers. */
  unmapped: string[];
  /** The file's unit of length, estimated from the legs, in English. */
  unit: string;
  /** The file's time step in seconds. */
  frameSeconds: number;
  /**
   * Whatever is unusual in the file and how it was read, and what could not be determined, one sentence
   * each: swapped sides, a zero pose that does not stand, feet that never stand. The same as
   * {@link Motion.notes}.
   */
  notes: string[];
}

/** Most poses of a motion, as in the core: 45 minutes at 60 Hz. */
const MAX_POSES = 162_000;

/** Largest motion file in bytes. */
const MAX_FILE_BYTES = 256 * 2 ** 20;

/**
 * A clip of poses for one body, resampled to 60 Hz. It fits the avatar's present shape: after a
 * change of shape make it again, or feet leave the floor.
 */
export class Motion {
  /** Name of the motion; for a file the name in it, of any content. Show it as text, never as HTML. */
  readonly name: string;
  /** Length in seconds. */
  readonly durationSeconds: number;
  /** For a file with named joints: how they were matched; otherwise null. SMPL poses (npz) need no matching. */
  readonly jointReport: JointReport | null;
  /**
   * For a file: what it does not state or lacks, what is unusual in it, and how it was read, one
   * sentence each without initial capital and full stop; empty if nothing is unusual.
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
   * Reads a BVH file and retargets its motion to the avatar's skeleton.
   *
   * @throws DynaSkinError `argument` for arguments of another type, `motion` for a file
   *   that is not BVH, has no complete frame or shows no person, and for names that are not in it
   */
  static fromBvh(file: ArrayBuffer | Uint8Array, avatar: Avatar, options: BvhOptions = {}): Motion {
    checkAvatar(avatar);
    const bytes = bytesOf("fromBvh", file);
    const joints = jointPairs(options);
    checkUnknown(options, ["joints", "rateHz"]);
    return Motion.#read(avatar.core, () => avatar.raw.motionFromBvh(bytes, joints, options.rateHz));
  }

  /**
   * Reads a motion file of any known kind, recognised by its content, and retargets its motion
   * to the avatar's skeleton:
   *
   * - BVH;
   * - an animation in binary glTF (`.glb`, `.vrm`, `.vrma`): the one that moves the most
   *   joints, unless you choose another ({@link Motion.animations}); joints are matched by VRM's
   *   humanoid if the file has one, else by name;
   * - SMPL, SMPL-H or SMPL-X poses as AMASS stores them (`.npz`).
   *
   * @throws DynaSkinError `argument` for arguments of another type, `motion` for any
   *   other file, a broken one or one that shows no person, for names that are not in it, and for
   *   options that do not apply to its kind
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
   * @throws DynaSkinError `argument` for arguments of another type, `motion` for a file of another
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
   * Makes a motion from your own poses, such as a recording.
   *
   * @param poses - {@link POSE_LENGTH} numbers per pose, one pose after the other; see {@link Pose}
   * @param rateHz - poses per second, 1 to 1000
   * @param avatar - the avatar whose skeleton the poses are for
   * @param name - the motion's name, for display
   * @throws DynaSkinError `argument` if `poses` is not a Float64Array of whole poses, `pose` for numbers
   *   that are not finite or quaternions that are not of unit length, `motion` for no poses, more than
   *   162,000 before or after resampling to 60 Hz, or a rate out of range
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
   * Writes the pose at a time in seconds into `out` and returns it. Times outside the motion give its first
   * or last pose; between frames the motion is smooth.
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

  /**
   * Turns the motion about the vertical through the origin so that the body faces +Z at its beginning, half a
   * second after the first frame, as the procedural motions do: a file may begin with its back to the camera, and
   * its first frame is often of a calibration. A body that lies then keeps its direction.
   *
   * @returns this motion
   */
  turnToFront(): this {
    const raw = this.#raw;
    if (!raw) throw new DynaSkinError("disposed", "This motion was used after dispose().");
    this.#core.guard(() => raw.turnToFront());
    return this;
  }

  /**
   * Which of the procedural motions it resembles most, by how fast the joints turn and the pelvis rises, and whether left
   * and right do the same or take turns: what to play where a file cannot be, as behind a link.
   *
   * @param avatar - the avatar whose skeleton the motion is for
   * @throws DynaSkinError `argument` for another argument, `disposed`, and `motion` in `dynaskin/slim`, which reads no
   *   motion files
   */
  nearestProcedural(avatar: Avatar): ProceduralName {
    checkAvatar(avatar);
    const raw = this.#raw;
    if (!raw) throw new DynaSkinError("disposed", "This motion was used after dispose().");
    return this.#core.guard(() => raw.nearest(avatar.restJointsM()) as ProceduralName);
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
