import type { StepTimings } from "../avatar.js";
import type { ControlChanges, ControlPreset, Controls } from "../controls.js";
import type { Detail } from "../detail.js";
import type { Progress } from "../source.js";

/** Arrays of one surface; they travel to the worker and back instead of being copied. */
export interface SurfaceArrays {
  offsets: Float32Array;
  positions: Float32Array;
  normals: Float32Array;
  skinMatrices: Float32Array;
}

/** What may be changed on an avatar between poses. */
export type Change =
  | { what: "shape"; shape: number[] }
  | { what: "controls"; controls: ControlChanges | ControlPreset }
  | { what: "scale"; factor: number }
  | { what: "dynamics"; on: boolean }
  | { what: "detail"; detail: Detail }
  | { what: "visible"; visible: boolean }
  | { what: "reset" };

/** What the page asks of the worker. Everything after `load` is answered in order. */
export type Request =
  | {
      type: "load";
      model: string;
      wasm?: string | ArrayBuffer | WebAssembly.Module;
      shape?: number[];
    }
  | { type: "step"; pose: Float64Array; dtSeconds: number; surface: SurfaceArrays }
  | { type: "change"; change: Change }
  | { type: "save" }
  | { type: "restore"; state: Uint8Array };

/** How an avatar is set. */
export interface Settings {
  controls: Controls;
  scale: number;
  dynamics: boolean;
  detail: Detail;
  visible: boolean;
}

/** A body's shape, and where its joints rest. */
export interface ShapeState {
  shape: Float32Array;
  restJointsM: Float32Array;
}

/** All of an avatar that steps leave alone. */
export interface AvatarState extends ShapeState {
  settings: Settings;
}

/** What the worker answers. */
export type Answer =
  | { type: "progress"; progress: Progress }
  | { type: "ready"; surface: SurfaceArrays; state: AvatarState }
  | { type: "stepped"; pose: Float64Array; surface: SurfaceArrays; timings: StepTimings }
  | { type: "changed"; surface: SurfaceArrays; state: AvatarState }
  | { type: "restored"; surface: SurfaceArrays; state: AvatarState }
  | { type: "saved"; bytes: Uint8Array }
  | Failed;

/** A request that was refused. A refused step brings its buffers back. */
export interface Failed {
  type: "failed";
  during: Request["type"];
  code: string;
  message: string;
  settings?: Settings;
  surface?: SurfaceArrays;
}

/** The buffers of a surface, for the transfer list. */
export function buffersOf({
  offsets,
  positions,
  normals,
  skinMatrices,
}: SurfaceArrays): ArrayBuffer[] {
  return [offsets, positions, normals, skinMatrices].map((array) => array.buffer as ArrayBuffer);
}

/** A surface of its own, from views that may change or go empty. */
export function copySurface({
  offsets,
  positions,
  normals,
  skinMatrices,
}: SurfaceArrays): SurfaceArrays {
  return {
    offsets: offsets.slice(),
    positions: positions.slice(),
    normals: normals.slice(),
    skinMatrices: skinMatrices.slice(),
  };
}
