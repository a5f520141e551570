// Binding as every engine's entry offers it; an engine adds how an avatar is read.
import { checkCallback, checkObject, kindOf } from "../check.js";
import { DynaSkinError } from "../error.js";
import type { Model } from "../model.js";
import { JOINT_NAMES, type JointName } from "../pose.js";
import {
  checkThread,
  startThread,
  type ThreadOptions,
  threadNeeds,
  untilAborted,
} from "../worker/start.js";
import { Binding, checkModel } from "./binding.js";
import type { AvatarParts, BindWish } from "./parts.js";
import { bindHere } from "./start.js";

/** How an avatar is bound. `wasm` is the address of `bind_bg.wasm`, where the bundler cannot find it. */
export interface BindOptions extends ThreadOptions {
  /**
   * What the avatar depicts. Soft tissue is for adults alone: there is no default, and nothing but
   * `"adult"` is bound. Who says so answers for it.
   */
  depicts: "adult";
  /** The avatar's bones by the body's joints, where names and tree fail: `{ left_hip: "thigh_l" }`. */
  bones?: Partial<Record<JointName, string>>;
  /**
   * Whether a worker binds, so that the page goes on meanwhile: true if left out, wherever there are
   * workers. False binds in the page's own thread, which stands still for up to some seconds.
   */
  worker?: boolean;
  /** Called with the fraction that is done, 0 to 1. What it throws, the promise rejects with. */
  onProgress?: (fraction: number) => void;
}

/**
 * Binds what `read` gives, in a worker or here.
 *
 * @internal
 */
export async function bindParts(
  model: Model,
  options: BindOptions,
  read: () => AvatarParts,
): Promise<Binding> {
  checkModel(model);
  checkObject('Binding needs options, such as { depicts: "adult" }: they', options);
  const { onProgress, signal, worker = true, createWorker } = options;
  checkCallback("onProgress", onProgress);
  checkThread(options);
  const wish = { depicts: depictsOf(options), bones: pairsOf(options.bones) };
  const parts = read();
  onProgress?.(0);
  const inWorker = worker && (createWorker !== undefined || typeof Worker === "function");
  const bytes = await (inWorker ? bindAside : bindInPage)(model, options, wish, parts);
  signal?.throwIfAborted();
  const binding = Binding.fromBytes(bytes, model);
  onProgress?.(1);
  return binding;
}

async function bindAside(
  model: Model,
  options: BindOptions,
  wish: BindWish,
  parts: AvatarParts,
): Promise<Uint8Array> {
  const link = startThread(options, (news) => {
    if (news.type === "read") options.onProgress?.(news.fraction);
  });
  let reason: unknown = null;
  try {
    const sent = { parts, body: model.body.file, wish, ...threadNeeds(options) };
    return await untilAborted(link, options.signal, () => link.call("bind", sent));
  } catch (error) {
    reason = error;
    throw error;
  } finally {
    link.close(reason);
  }
}

async function bindInPage(
  model: Model,
  { wasm, onProgress }: BindOptions,
  wish: BindWish,
  parts: AvatarParts,
): Promise<Uint8Array> {
  const thrown: unknown[] = [];
  const tell = (fraction: number) => {
    try {
      onProgress?.(fraction);
    } catch (error) {
      // WebAssembly would swallow it.
      thrown.push(error);
    }
  };
  const bytes = await bindHere(parts, model.body.file, wish, wasm, tell);
  if (thrown.length > 0) throw thrown[0];
  return bytes;
}

function depictsOf({ depicts }: { depicts?: unknown }): string | undefined {
  // Another value than a string is none that WebAssembly could repeat.
  return typeof depicts === "string" ? depicts : undefined;
}

function pairsOf(bones: BindOptions["bones"]): string[] {
  if (bones === undefined) return [];
  checkObject("bones", bones);
  return Object.entries(bones).flatMap(([joint, name]) => {
    if (!JOINT_NAMES.includes(joint as JointName)) {
      const known = JOINT_NAMES.join(", ");
      throw new DynaSkinError("argument", `The body has no joint ${joint}; it has ${known}.`);
    }
    if (typeof name !== "string") {
      const found = kindOf(name);
      throw new DynaSkinError("argument", `bones.${joint} must be a bone's name, got ${found}.`);
    }
    return [joint, name];
  });
}
