// The worker's side: one avatar of its own core, driven by messages.
import { restJointsOf } from "../adapter/rig.js";
import type { Avatar } from "../avatar.js";
import { toDynaSkinError } from "../error.js";
import { load } from "../load.js";
import {
  type Answer,
  type AvatarState,
  buffersOf,
  type Change,
  copySurface,
  type Failed,
  type Request,
  type Settings,
  type SurfaceArrays,
} from "./protocol.js";

interface WorkerScope {
  postMessage(answer: Answer, transfer: Transferable[]): void;
  addEventListener(type: "message", listener: (event: MessageEvent<Request>) => void): void;
}

const scope = globalThis as unknown as WorkerScope;
let avatar: Avatar | null = null;

scope.addEventListener("message", ({ data }) => {
  answer(data).catch((error: unknown) => {
    const { code, message } = toDynaSkinError(error);
    const failed: Failed = { type: "failed", during: data.type, code, message };
    const settings = avatar && settingsIfSound(avatar);
    if (settings) failed.settings = settings;
    if (data.type === "step") failed.surface = data.surface;
    scope.postMessage(failed, failed.surface ? buffersOf(failed.surface) : []);
  });
});

async function answer(request: Request): Promise<void> {
  if (request.type === "load") {
    await loadAvatar(request);
    return;
  }
  if (!avatar) throw new Error("The worker has no avatar.");
  switch (request.type) {
    case "step": {
      const { pose, dtSeconds, surface } = request;
      avatar.step(pose, dtSeconds);
      fill(surface, avatar);
      const { timings } = avatar;
      scope.postMessage({ type: "stepped", pose, surface, timings }, [
        ...buffersOf(surface),
        pose.buffer as ArrayBuffer,
      ]);
      return;
    }
    case "change":
      apply(request.change, avatar);
      sendAll("changed", avatar);
      return;
    case "save": {
      const bytes = avatar.save();
      scope.postMessage({ type: "saved", bytes }, [bytes.buffer as ArrayBuffer]);
      return;
    }
    case "restore":
      avatar.restore(request.state);
      sendAll("restored", avatar);
  }
}

async function loadAvatar({ model: folder, wasm, shape }: Request & { type: "load" }) {
  const model = await load({
    model: folder,
    ...(wasm && { wasm }),
    onProgress: (progress) => scope.postMessage({ type: "progress", progress }, []),
  });
  avatar = model.createAvatar(shape ? { shape } : {});
  model.dispose();
  sendAll("ready", avatar);
}

function apply(change: Change, to: Avatar): void {
  switch (change.what) {
    case "shape":
      to.setShape(change.shape);
      return;
    case "controls":
      to.setControls(change.controls);
      return;
    case "scale":
      to.scale = change.factor;
      return;
    case "dynamics":
      to.dynamics = change.on;
      return;
    case "detail":
      to.detail = change.detail;
      return;
    case "visible":
      to.visible = change.visible;
      return;
    case "reset":
      to.reset();
  }
}

function sendAll(type: "ready" | "changed" | "restored", source: Avatar): void {
  const surface = copySurface(source);
  const state: AvatarState = {
    shape: source.shape,
    restJointsM: restJointsOf(source),
    settings: settingsOf(source),
  };
  scope.postMessage({ type, surface, state }, buffersOf(surface));
}

function settingsOf({ controls, scale, dynamics, detail, visible }: Avatar): Settings {
  return { controls, scale, dynamics, detail, visible };
}

/** None of an avatar whose core has crashed. */
function settingsIfSound(source: Avatar): Settings | null {
  try {
    return settingsOf(source);
  } catch {
    return null;
  }
}

function fill(surface: SurfaceArrays, source: Avatar): void {
  surface.offsets.set(source.offsets);
  surface.positions.set(source.positions);
  surface.normals.set(source.normals);
  surface.skinMatrices.set(source.skinMatrices);
}
