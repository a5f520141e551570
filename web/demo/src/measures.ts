import { type Body, REGION_NAMES, type RegionName } from "dynaskin";

/** From this weight on a vertex counts as one of a region, as in the model cards. */
const MEMBER = 0.5;
const MM_PER_M = 1000;

/** Means over the vertices of a body's regions. */
export class RegionMeasures {
  readonly #members: Map<RegionName, Uint32Array>;

  constructor(body: Body) {
    this.#members = new Map(
      REGION_NAMES.map((region) => {
        const weights = body.regionWeights(region);
        const members = [...weights.keys()].filter((vertex) => (weights[vertex] ?? 0) >= MEMBER);
        return [region, Uint32Array.from(members)];
      }),
    );
  }

  /** How far a region is above its place on the bone, in millimetres; offsets in metres. */
  heightMm(region: RegionName, offsetsM: Float32Array): number {
    return this.#mean(region, (at) => offsetsM[at + 1] ?? 0);
  }

  /** Mean distance of a region's vertices from ground truth, in millimetres; offsets in metres. */
  errorMm(region: RegionName, offsetsM: Float32Array, truthM: Float32Array): number {
    const off = (at: number) => (offsetsM[at] ?? 0) - (truthM[at] ?? 0);
    return this.#mean(region, (at) => Math.hypot(off(at), off(at + 1), off(at + 2)));
  }

  #mean(region: RegionName, valueM: (at: number) => number): number {
    const members = this.#members.get(region) ?? [];
    let sum = 0;
    for (const vertex of members) sum += valueM(vertex * 3);
    return (MM_PER_M * sum) / Math.max(1, members.length);
  }
}
