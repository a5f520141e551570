/**
 * An avatar in a web worker: the networks run beside the page's own work. The adapters for three.js
 * and Babylon.js take a {@link WorkerAvatar} as they take an `Avatar`.
 *
 * The price is time: the surface of a pose arrives with the worker's answer, usually by the next
 * display frame. It then lies one display frame further behind the skeleton than an `Avatar`'s,
 * whose tissue is one sixtieth of a second behind.
 *
 * @module
 */
import type { RemoteAvatar } from "../adapter/rig.js";
import { REGION_NAMES, type RegionName } from "../bundle.js";
import { DynaSkinError } from "../error.js";
import { checkLength, POSE_LENGTH, type Pose, SHAPE_LENGTH } from "../pose.js";
import { type Answer, buffersOf, type Request, type SurfaceArrays } from "./protocol.js";

/** How an avatar in a worker begins. */
export interface WorkerAvatarOptions {
  /** The folder that holds `bundle.json` and the files it names. */
  model: string | URL;
  /** Ten shape coefficients in standard deviations; average if left out. */
  shape?: ArrayLike<number>;
  /** The WebAssembly file, where the bundler cannot find it. */
  wasm?: string | URL | ArrayBuffer | WebAssembly.Module;
  /** Makes the worker, where the bundler cannot find `dynaskin/worker/thread`. */
  createWorker?: () => Worker;
  /** Stops the loading; the promise then rejects with the signal's reason. */
  signal?: AbortSignal;
}

/**
 * Starts a worker, loads a model in it and makes an avatar.
 *
 * @throws DynaSkinError `worker` where workers cannot be started, and what `load` throws
 */
export function createWorkerAvatar(options: WorkerAvatarOptions): Promise<WorkerAvatar> {
  const { signal, shape } = options;
  return new Promise((resolve, reject) => {
    signal?.throwIfAborted();
    if (shape) checkLength("shape", shape, SHAPE_LENGTH);
    const worker = startWorker(options.createWorker);
    const finish = (end: () => void) => {
      signal?.removeEventListener("abort", onAbort);
      worker.onmessage = null;
      worker.onerror = null;
      end();
    };
    const fail = (error: unknown) =>
      finish(() => {
        worker.terminate();
        reject(error);
      });
    const onAbort = () => fail(signal?.reason);
    signal?.addEventListener("abort", onAbort);
    worker.onerror = (event) => fail(brokenWorker(event));
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      if (data.type === "failed") fail(new DynaSkinError(data.code, data.message));
      if (data.type === "ready") finish(() => resolve(new WorkerAvatar(worker, data)));
    };
    const request: Request = { type: "load", model: absolute(options.model) };
    const { wasm } = options;
    if (wasm)
      request.wasm = wasm instanceof URL || typeof wasm === "string" ? absolute(wasm) : wasm;
    if (shape) request.shape = Array.from(shape);
    worker.postMessage(request);
  });
}

/** One body that moves, in a worker. */
export class WorkerAvatar implements RemoteAvatar {
  #worker: Worker | null;
  #surface: SurfaceArrays;
  #spare: SurfaceArrays;
  #shape: Float32Array;
  #restJointsM: Float32Array;
  #spentPose: Float64Array = new Float64Array(POSE_LENGTH);
  readonly #nextPose = new Float64Array(POSE_LENGTH);
  #nextDtSeconds: number | null = null;
  #stepping = false;
  #failure: DynaSkinError | null = null;
  #strength = 1;
  #dynamics = true;

  /** @internal */
  constructor(worker: Worker, { surface, shape, restJointsM }: Answer & { type: "ready" }) {
    this.#worker = worker;
    this.#surface = surface;
    this.#spare = {
      offsets: surface.offsets.slice(),
      positions: surface.positions.slice(),
      normals: surface.normals.slice(),
    };
    this.#shape = shape;
    this.#restJointsM = restJointsM;
    worker.onmessage = ({ data }: MessageEvent<Answer>) => this.#receive(data);
    worker.onerror = (event) => {
      this.#failure = brokenWorker(event);
    };
  }

  /**
   * Sends a pose to the worker. While the worker is busy with an earlier one, only the newest pose
   * waits, and the times between add up: a slow worker gives fewer surfaces, not later ones.
   *
   * @param pose - see `Pose`; it is copied
   * @param dtSeconds - time since the last step in seconds
   * @throws DynaSkinError `argument`, `disposed`, and what the worker met since the last step
   */
  step(pose: Pose, dtSeconds: number): void {
    checkLength("pose", pose, POSE_LENGTH);
    this.#assertAlive();
    const failure = this.#failure;
    this.#failure = null;
    if (failure) throw failure;
    this.#nextPose.set(pose);
    this.#nextDtSeconds = (this.#nextDtSeconds ?? 0) + dtSeconds;
    this.#send();
  }

  /** Whether an answer is outstanding: the surface is not yet that of the last pose. */
  get pending(): boolean {
    return this.#stepping;
  }

  /** Rest-pose offsets, `[vertex][x, y, z]` flattened, metres; valid until the next task. */
  get offsets(): Float32Array {
    return this.#alive().offsets;
  }

  /** Rest-pose positions with the offsets, `[vertex][x, y, z]` flattened, metres. */
  get positions(): Float32Array {
    return this.#alive().positions;
  }

  /** Unit normals of {@link positions}. */
  get normals(): Float32Array {
    return this.#alive().normals;
  }

  /** Shape coefficients β in standard deviations, as the present surface has them. */
  get shape(): Float32Array {
    return this.#shape;
  }

  /** Rest positions of the 24 joints for {@link shape}: `[joint][x, y, z]` flattened, metres. */
  restJointsM(): Float32Array {
    return this.#restJointsM;
  }

  /**
   * Gives the avatar another shape; {@link shape} and the surface change when the worker answers.
   *
   * @throws DynaSkinError `argument` for a wrong length; what the worker refuses, the next step throws
   */
  setShape(shape: ArrayLike<number>): void {
    checkLength("shape", shape, SHAPE_LENGTH);
    this.#post({ type: "shape", shape: Array.from(shape) });
  }

  /** Factor on all offsets; see `Avatar.strength`. Takes effect with the next step. */
  get strength(): number {
    return this.#strength;
  }

  set strength(factor: number) {
    this.#post({ type: "strength", factor });
    this.#strength = factor;
  }

  /** Whether the networks run; see `Avatar.dynamics`. Takes effect with the next step. */
  get dynamics(): boolean {
    return this.#dynamics;
  }

  set dynamics(on: boolean) {
    this.#post({ type: "dynamics", on });
    this.#dynamics = on;
  }

  /**
   * Factor on the offsets of one region; see `Avatar.setRegionGain`.
   *
   * @throws DynaSkinError `argument` for an unknown region
   */
  setRegionGain(region: RegionName, factor: number): void {
    if (!REGION_NAMES.includes(region)) {
      throw new DynaSkinError("argument", `There is no region ${region}.`);
    }
    this.#post({ type: "gain", region, factor });
  }

  /** Settles the tissue with the next step, as after a cut. */
  reset(): void {
    this.#post({ type: "reset" });
  }

  /** Ends the worker. May be called again; anything else throws `disposed` afterwards. */
  dispose(): void {
    this.#worker?.terminate();
    this.#worker = null;
  }

  #alive(): SurfaceArrays {
    this.#assertAlive();
    return this.#surface;
  }

  #assertAlive(): Worker {
    if (this.#worker) return this.#worker;
    throw new DynaSkinError("disposed", "This avatar was used after dispose().");
  }

  #post(request: Request): void {
    this.#assertAlive().postMessage(request);
  }

  #send(): void {
    const dtSeconds = this.#nextDtSeconds;
    if (this.#stepping || dtSeconds === null) return;
    this.#nextDtSeconds = null;
    this.#stepping = true;
    const pose = this.#spentPose;
    pose.set(this.#nextPose);
    const surface = this.#spare;
    const request: Request = { type: "step", pose, dtSeconds, surface };
    this.#worker?.postMessage(request, [...buffersOf(surface), pose.buffer as ArrayBuffer]);
  }

  #receive(answer: Answer): void {
    switch (answer.type) {
      case "stepped":
        this.#spare = this.#surface;
        this.#surface = answer.surface;
        this.#spentPose = answer.pose;
        this.#stepping = false;
        break;
      case "shaped":
        this.#shape = answer.shape;
        this.#restJointsM = answer.restJointsM;
        this.#surface = answer.surface;
        break;
      case "failed":
        this.#failure = new DynaSkinError(answer.code, answer.message);
        if (answer.surface) {
          this.#spare = answer.surface;
          this.#spentPose = new Float64Array(POSE_LENGTH);
          this.#stepping = false;
        }
    }
    this.#send();
  }
}

function startWorker(create: (() => Worker) | undefined): Worker {
  if (create) return create();
  if (typeof Worker !== "function") {
    throw new DynaSkinError("worker", "There are no web workers here; use load() instead.");
  }
  // In one piece, because bundlers look for exactly this.
  return new Worker(new URL("./thread.js", import.meta.url), { type: "module" });
}

function brokenWorker(event: ErrorEvent): DynaSkinError {
  return new DynaSkinError(
    "worker",
    "The worker could not be started, or stopped. The page's content security policy must allow " +
      `worker-src 'self', and the bundler must have copied worker/thread.js. ${event.message ?? ""}`,
  );
}

/** A worker's relative addresses count from its own file, the caller's from the page. */
function absolute(address: string | URL): string {
  const { document } = globalThis as { document?: { baseURI: string } };
  return new URL(address, document?.baseURI).href;
}
