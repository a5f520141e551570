import type { RegionName } from "../bundle.js";

/** Arrays of one surface; they travel to the worker and back instead of being copied. */
export interface SurfaceArrays {
  offsets: Float32Array;
  positions: Float32Array;
  normals: Float32Array;
}

/** What the page asks of the worker. Everything after `load` is answered in order. */
export type Request =
  | {
      type: "load";
      model: string;
      wasm?: string | ArrayBuffer | WebAssembly.Module;
      shape?: number[];
    }
  | { type: "step"; pose: Float64Array; dtSeconds: number; surface: SurfaceArrays }
  | { type: "shape"; shape: number[] }
  | { type: "strength"; factor: number }
  | { type: "dynamics"; on: boolean }
  | { type: "gain"; region: RegionName; factor: number }
  | { type: "reset" };

/** A body's shape, and where its joints rest. */
export interface ShapeState {
  shape: Float32Array;
  restJointsM: Float32Array;
}

/** What the worker answers. */
export type Answer =
  | ({ type: "ready"; surface: SurfaceArrays } & ShapeState)
  | { type: "stepped"; pose: Float64Array; surface: SurfaceArrays }
  | ({ type: "shaped"; surface: SurfaceArrays } & ShapeState)
  | {
      type: "failed";
      during: Request["type"];
      code: string;
      message: string;
      surface?: SurfaceArrays;
    };

/** The buffers of a surface, for the transfer list. */
export function buffersOf({ offsets, positions, normals }: SurfaceArrays): ArrayBuffer[] {
  return [offsets, positions, normals].map((array) => array.buffer as ArrayBuffer);
}
