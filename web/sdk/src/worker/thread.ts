// The worker's side: a model of its own core, and what the page makes from it.
import type { Avatar } from "../avatar.js";
import { bindHere } from "../bind/start.js";
import { startCore } from "../core.js";
import { Crowd } from "../crowd.js";
import { toDynaSkinError } from "../error.js";
import { load } from "../load.js";
import type { Model } from "../model.js";
import type { MotionReading } from "../motion.js";
import { POSE_LENGTH } from "../pose.js";
import {
  AVATAR_SETTINGS,
  type AvatarSettings,
  buffersOf,
  type Calls,
  type CrowdSettings,
  copySurface,
  fillSurface,
  type Message,
  type Ref,
  type Request,
  type State,
} from "./protocol.js";

interface WorkerScope {
  postMessage(message: Message, transfer: Transferable[]): void;
  addEventListener(type: "message", listener: (event: MessageEvent<Request>) => void): void;
}

const scope = globalThis as unknown as WorkerScope;
const objects = new Map<number, Avatar | Crowd>();
let loaded: Model | null = null;

/** What the worker does when it is asked: an answer, and what of it travels. */
const ANSWERS: {
  [Name in keyof Calls]: (
    sent: Calls[Name]["sent"],
    transfer: Transferable[],
  ) => Calls[Name]["back"] | Promise<Calls[Name]["back"]>;
} = {
  async load({ model, wasm, aliveEveryMs }) {
    const alive = setInterval(() => scope.postMessage({ type: "alive" }, []), aliveEveryMs);
    try {
      const onProgress = (progress: { loadedBytes: number; totalBytes: number }) =>
        scope.postMessage({ type: "progress", progress }, []);
      loaded = await load({ model, ...(wasm && { wasm }), onProgress });
      return loaded.bundle;
    } finally {
      clearInterval(alive);
    }
  },

  async readMotion({ file, restJointsM, how, wasm, aliveEveryMs }, transfer) {
    const alive = setInterval(() => scope.postMessage({ type: "alive" }, []), aliveEveryMs);
    try {
      const bytes = file instanceof Blob ? new Uint8Array(await file.arrayBuffer()) : file;
      const core = await startCore(wasm);
      const tell = (fraction: number) => scope.postMessage({ type: "read", fraction }, []);
      return core.guard(() => {
        const raw = core.glue.CoreMotion.readFile(bytes, restJointsM, ...how, tell);
        const poses = raw.poses();
        transfer.push(poses.buffer);
        const jointReport = raw.jointReport() as MotionReading["jointReport"];
        return { name: raw.name, poses, jointReport, notes: raw.notes };
      });
    } finally {
      clearInterval(alive);
    }
  },

  async bind({ parts, body, wish, wasm, aliveEveryMs }, transfer) {
    const alive = setInterval(() => scope.postMessage({ type: "alive" }, []), aliveEveryMs);
    try {
      const tell = (fraction: number) => scope.postMessage({ type: "read", fraction }, []);
      const bytes = await bindHere(parts, body, wish, wasm, tell);
      transfer.push(bytes.buffer as ArrayBuffer);
      return bytes;
    } finally {
      clearInterval(alive);
    }
  },

  createAvatar({ target, shape, wantsRest }, transfer) {
    const avatar = theModel().createAvatar(shape ? { shape } : {});
    objects.set(target, avatar);
    const rest = wantsRest ? avatar.restBody() : null;
    if (rest) transfer.push(rest.positions.buffer, rest.jointsM.buffer);
    return { ...stateOfAvatar(avatar, transfer), ...(rest && { rest }) };
  },

  createCrowd({ target }) {
    const crowd = theModel().createCrowd();
    objects.set(target, crowd);
    return { settings: settingsOf(crowd) as CrowdSettings };
  },

  step({ target, avatars, poses, dtSeconds, surfaces }, transfer) {
    const object = objectOf(target);
    const members = avatars.map((id) => objectOf(id) as Avatar);
    if (object instanceof Crowd) object.stepAll(posesOf(poses), dtSeconds);
    else object.step(poses, dtSeconds);
    for (const [idx, surface] of surfaces.entries()) {
      fillSurface(surface, members[idx] as Avatar);
      transfer.push(...buffersOf(surface));
    }
    transfer.push(poses.buffer);
    const cost = object instanceof Crowd ? { report: object.report } : { timings: object.timings };
    return { poses, surfaces, details: members.map(({ detail }) => detail), ...cost };
  },

  do({ target, doing: [name, ...sent] }, transfer) {
    const object = objectOf(target);
    const args = sent.map((value) => (isRef(value) ? objectOf(value.ref) : value));
    const member: unknown = Reflect.get(object, name);
    let value: unknown;
    if (typeof member === "function") value = Reflect.apply(member, object, args);
    else Reflect.set(object, name, args[0]);
    const state =
      object instanceof Crowd ? { settings: settingsOf(object) } : stateOfAvatar(object, transfer);
    return { value, state };
  },

  dispose({ target }) {
    objectOf(target).dispose();
    return null;
  },
};

scope.addEventListener("message", ({ data }) => {
  answer(data).catch((error: unknown) => {
    const { id, sent } = data;
    if (id === undefined) return;
    const { code, message } = toDynaSkinError(error);
    const object = "target" in sent ? objects.get(sent.target) : undefined;
    const settings = object && settingsIfSound(object);
    const refusal: Message = { type: "refusal", id, code, message };
    try {
      scope.postMessage({ ...refusal, ...(settings && { settings }) }, []);
    } catch {
      // What cannot be sent must not leave the page waiting.
      scope.postMessage(refusal, []);
    }
  });
});

async function answer({ id, call, sent }: Request): Promise<void> {
  const transfer: Transferable[] = [];
  const back = await ANSWERS[call](sent as never, transfer);
  if (id !== undefined) scope.postMessage({ type: "answer", id, back }, transfer);
}

function theModel(): Model {
  if (loaded) return loaded;
  throw new Error("The worker has no model.");
}

function objectOf(id: number): Avatar | Crowd {
  const object = objects.get(id);
  if (object) return object;
  throw new Error(`The worker has no object ${id}.`);
}

function isRef(value: unknown): value is Ref {
  return typeof value === "object" && value !== null && "ref" in value;
}

function posesOf(poses: Float64Array): Float64Array[] {
  const count = poses.length / POSE_LENGTH;
  return Array.from({ length: count }, (_, idx) =>
    poses.subarray(idx * POSE_LENGTH, (idx + 1) * POSE_LENGTH),
  );
}

function stateOfAvatar(avatar: Avatar, transfer: Transferable[]): Calls["createAvatar"]["back"] {
  const surface = copySurface(avatar);
  transfer.push(...buffersOf(surface));
  const { shape, revision } = avatar;
  const figure = figureOf(avatar);
  const shown = { surface, shape, figure, revision, restJointsM: avatar.restJointsM() };
  return { settings: settingsOf(avatar) as Partial<AvatarSettings>, shown };
}

const figures = new WeakMap<Avatar, Pick<Avatar, "figure" | "revision">>();

/** Measured only after a change of the shape: it takes about as long as a step. */
function figureOf(avatar: Avatar): Avatar["figure"] {
  const { revision } = avatar;
  let known = figures.get(avatar);
  if (known?.revision !== revision) {
    known = { revision, figure: avatar.figure };
    figures.set(avatar, known);
  }
  return known.figure;
}

/** How an object is set; what the page sets silently, it knows best. */
function settingsOf(object: Avatar | Crowd): State<AvatarSettings | CrowdSettings>["settings"] {
  if (object instanceof Crowd) return { levelOfDetail: object.levelOfDetail };
  const settings: Record<string, unknown> = { controls: object.controls };
  for (const [name, setting] of Object.entries(AVATAR_SETTINGS)) {
    if (!("silent" in setting)) settings[name] = object[name as keyof Avatar];
  }
  return settings;
}

/** None of an object whose core has crashed. */
function settingsIfSound(object: Avatar | Crowd): object | null {
  try {
    return settingsOf(object);
  } catch {
    return null;
  }
}
