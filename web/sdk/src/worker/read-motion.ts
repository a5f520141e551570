import type { Avatar } from "../avatar.js";
import { checkCallback, checkObject } from "../check.js";
import { DynaSkinError } from "../error.js";
import {
  checkAvatar,
  checkMotionSize,
  fileArguments,
  Motion,
  type MotionFileOptions,
} from "../motion.js";
import {
  checkThread,
  startThread,
  type ThreadOptions,
  threadNeeds,
  untilAborted,
} from "./start.js";

/** How a motion file is read in a worker. */
export interface ReadMotionOptions extends MotionFileOptions, ThreadOptions {
  /** Called with the fraction that is done, 0 to 1. What it throws, the promise rejects with. */
  onProgress?: (fraction: number) => void;
}

/**
 * Reads a motion file as `Motion.fromFile` does, in a worker of its own, which ends with it: long files
 * take seconds, in which the page goes on. The motion is the same, bit by bit. A `Blob` (such as an
 * input's `File`) is read in the worker; other bytes are copied to it.
 *
 * @throws DynaSkinError `worker` where workers cannot be started or stay silent, and what
 *   `Motion.fromFile` throws
 */
export async function readMotion(
  file: Blob | ArrayBuffer | Uint8Array,
  avatar: Avatar,
  options: ReadMotionOptions = {},
): Promise<Motion> {
  checkAvatar(avatar);
  checkObject("options", options);
  const { wasm, createWorker, workerScript, timeoutMs, signal, onProgress, ...fileOptions } =
    options;
  checkCallback("onProgress", onProgress);
  checkThread(options);
  const how = fileArguments(fileOptions);
  const sent = toSend(file);
  const restJointsM = avatar.restJointsM();
  const link = startThread(options, (news) => {
    if (news.type === "read") onProgress?.(news.fraction);
  });
  let reason: unknown = null;
  try {
    const call = { file: sent, restJointsM, how, ...threadNeeds(options) };
    const reading = await untilAborted(link, signal, () => link.call("readMotion", call));
    const motion = Motion.fromReading(reading, avatar);
    onProgress?.(1);
    return motion;
  } catch (error) {
    reason = error;
    throw error;
  } finally {
    link.close(reason);
  }
}

function toSend(file: unknown): Blob | Uint8Array {
  const isBlob = typeof Blob !== "undefined" && file instanceof Blob;
  if (!isBlob && !(file instanceof Uint8Array || file instanceof ArrayBuffer)) {
    throw new DynaSkinError(
      "argument",
      "readMotion takes a file as a Blob, or its bytes as an ArrayBuffer or a Uint8Array.",
    );
  }
  checkMotionSize(isBlob ? file.size : file.byteLength);
  return file instanceof ArrayBuffer ? new Uint8Array(file) : file;
}
