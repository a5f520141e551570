// The worker's side: one avatar of its own core, driven by messages.
import { restJointsOf } from "../adapter/rig.js";
import type { Avatar } from "../avatar.js";
import { toDynaSkinError } from "../error.js";
import { load } from "../load.js";
import {
  type Answer,
  buffersOf,
  type Request,
  type ShapeState,
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
    const surface = data.type === "step" ? data.surface : undefined;
    const failed: Answer = { type: "failed", during: data.type, code, message };
    if (surface) failed.surface = surface;
    scope.postMessage(failed, surface ? buffersOf(surface) : []);
  });
});

async function answer(request: Request): Promise<void> {
  if (request.type === "load") {
    const { model: folder, wasm, shape } = request;
    const model = await load({ model: folder, ...(wasm && { wasm }) });
    avatar = model.createAvatar(shape ? { shape } : {});
    model.dispose();
    const surface = copySurface(avatar);
    scope.postMessage({ type: "ready", surface, ...shapeOf(avatar) }, buffersOf(surface));
    return;
  }
  if (!avatar) throw new Error("The worker has no avatar.");
  switch (request.type) {
    case "step": {
      const { pose, dtSeconds, surface } = request;
      avatar.step(pose, dtSeconds);
      fill(surface, avatar);
      scope.postMessage({ type: "stepped", pose, surface }, [
        ...buffersOf(surface),
        pose.buffer as ArrayBuffer,
      ]);
      return;
    }
    case "shape": {
      avatar.setShape(request.shape);
      const surface = copySurface(avatar);
      scope.postMessage({ type: "shaped", surface, ...shapeOf(avatar) }, buffersOf(surface));
      return;
    }
    case "strength":
      avatar.strength = request.factor;
      return;
    case "dynamics":
      avatar.dynamics = request.on;
      return;
    case "gain":
      avatar.setRegionGain(request.region, request.factor);
      return;
    case "reset":
      avatar.reset();
  }
}

function shapeOf(source: Avatar): ShapeState {
  return { shape: source.shape, restJointsM: restJointsOf(source) };
}

function copySurface({ offsets, positions, normals }: Avatar): SurfaceArrays {
  return { offsets: offsets.slice(), positions: positions.slice(), normals: normals.slice() };
}

function fill(surface: SurfaceArrays, source: Avatar): void {
  surface.offsets.set(source.offsets);
  surface.positions.set(source.positions);
  surface.normals.set(source.normals);
}
