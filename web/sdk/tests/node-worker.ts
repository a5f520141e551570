import { Worker as NodeThread } from "node:worker_threads";
import { createWorkerAvatar, type WorkerAvatar } from "dynaskin/worker";
import { modelFolder } from "./support.js";

/** What a browser's worker has, for the worker's script to run in a thread of Node. */
const SCOPE = `
  const { parentPort, workerData } = require("node:worker_threads");
  globalThis.postMessage = (message, transfer) => parentPort.postMessage(message, transfer);
  globalThis.addEventListener = (type, listener) =>
    parentPort.on(type, (data) => listener({ data }));
  import(workerData);
`;

/** A thread of Node with the face of a browser's worker. */
export function nodeWorker(): Worker {
  const script = import.meta.resolve("dynaskin/worker/thread");
  const thread = new NodeThread(SCOPE, { eval: true, workerData: script });
  const worker = {
    onmessage: null as ((event: { data: unknown }) => void) | null,
    onerror: null as ((event: { message: string }) => void) | null,
    postMessage: (message: unknown, transfer: Transferable[] = []) =>
      thread.postMessage(message, transfer as ArrayBuffer[]),
    terminate: () => void thread.terminate(),
  };
  thread.on("message", (data) => worker.onmessage?.({ data }));
  thread.on("error", ({ message }) => worker.onerror?.({ message }));
  return worker as unknown as Worker;
}

/** An avatar of the female model in a thread of its own. */
export function createThreadAvatar(shape?: number[]): Promise<WorkerAvatar> {
  const model = modelFolder();
  return createWorkerAvatar({ model, createWorker: nodeWorker, ...(shape && { shape }) });
}
