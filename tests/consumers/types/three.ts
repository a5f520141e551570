// A strict TypeScript application with three.js.
import { type Avatar, DynaSkinError, type Figure, load, type Pose, restPose } from "dynaskin";
import { load as loadInline } from "dynaskin/inline";
import { load as loadSlim } from "dynaskin/slim";
import { DynaSkin } from "dynaskin/three";
import {
  createWorkerAvatar,
  createWorkerModel,
  type WorkerAvatar,
  type WorkerCrowd,
} from "dynaskin/worker";
import { female } from "dynaskin-female";
import { male } from "dynaskin-male/inline";
import type { SkinnedMesh } from "three";

export async function start(mesh: SkinnedMesh): Promise<DynaSkin[]> {
  const model = await load({
    model: "/models/female/",
    onProgress: ({ loadedBytes }) => loadedBytes,
  });
  const same: typeof model = await loadInline({ model: new URL("https://example.org/female/") });
  const small: typeof model = await loadSlim({ model: "/models/female/", body: same.body });
  small.dispose();
  for (const files of [female, male]) await load({ model: files });
  const avatar: Avatar = same.createAvatar({ shape: new Float32Array(10) });
  avatar.setShape({ weightKg: 74, statureM: 1.66 } satisfies Figure);
  const remote: WorkerAvatar = await createWorkerAvatar({ model: "/models/female/" });
  remote.setControls("calm-clothes");
  remote.setControls({ rootInertia: 0.5, regions: { belly: { limitCm: 2 } } });
  remote.scale = remote.controls.strength;
  await remote.restore(await remote.save());
  await remote.whenAnswered();
  const workerModel = await createWorkerModel({ model: "/models/female/", timeoutMs: 5000 });
  const crowd: WorkerCrowd = await workerModel.createCrowd();
  crowd.add(await workerModel.createAvatar());
  crowd.levelOfDetail = { halfBeyondM: 5 };
  const pose: Pose = restPose();
  crowd.stepAll([pose], 1 / 60);
  avatar.step(pose, 1 / 60);
  return [new DynaSkin(avatar, mesh), new DynaSkin(remote, mesh, { boneNames: { neck: "Neck" } })];
}

export const codeOf = (error: unknown): string =>
  error instanceof DynaSkinError ? error.code : "unknown";
