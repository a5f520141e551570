import {
  BufferAttribute,
  type BufferGeometry,
  type Material,
  MeshStandardMaterial,
  type SkinnedMesh,
} from "three";

/** Colours of what moves, from least to most; sRGB, 0 to 255. */
const RAMP = [
  [68, 92, 168],
  [62, 160, 168],
  [240, 190, 70],
  [214, 62, 40],
] as const;

/** Of what stays still. */
const STILL = [150, 150, 150] as const;

/** Offsets below this count as none, metres. */
const LEAST_M = 1e-4;

/** The ramp as a background. */
export function rampCss(): string {
  const stops = RAMP.map((colour) => `rgb(${colour.join(" ")})`);
  return `linear-gradient(90deg, rgb(${STILL.join(" ")}) 8%, ${stops[0]} 8%, ${stops.slice(1).join(", ")})`;
}

/** Red, green and blue, linear, of an offset as a share of the largest; null stays still. */
function colourOf(share: number | null): number[] {
  const linear = (value: number) => (value / 255) ** 2.2;
  if (share === null) return STILL.map(linear);
  const at = Math.min(1, share) * (RAMP.length - 1);
  const below = Math.min(RAMP.length - 2, Math.floor(at));
  const [from, to] = [RAMP[below] ?? RAMP[0], RAMP[below + 1] ?? RAMP[0]];
  return from.map((value, idx) => linear(value + (at - below) * ((to[idx] ?? value) - value)));
}

/** Shows how far each vertex moves, in the place of the avatar's own materials. */
export class CoverageMap {
  readonly #own = new Map<SkinnedMesh, Material | Material[]>();
  readonly #coloured = new MeshStandardMaterial({ vertexColors: true, roughness: 1 });
  readonly #still = new MeshStandardMaterial({ roughness: 1 });

  constructor() {
    const [red = 0, green = 0, blue = 0] = colourOf(null);
    this.#still.color.setRGB(red, green, blue);
  }

  /** `peaksM`: the largest offset of each vertex, for the meshes that move. */
  show(
    meshes: readonly SkinnedMesh[],
    peaksM: ReadonlyMap<SkinnedMesh, Float32Array>,
    mostM: number,
  ): void {
    this.hide();
    for (const mesh of meshes) {
      this.#own.set(mesh, mesh.material);
      const peaks = peaksM.get(mesh);
      mesh.material = peaks ? this.#coloured : this.#still;
      if (peaks) colour(mesh.geometry, peaks, mostM);
    }
  }

  /** Gives the meshes their materials back. */
  hide(): void {
    for (const [mesh, material] of this.#own) mesh.material = material;
    this.#own.clear();
  }

  dispose(): void {
    this.hide();
    this.#coloured.dispose();
    this.#still.dispose();
  }
}

/** On a geometry with tissue, which is no other mesh's. */
function colour(geometry: BufferGeometry, peaksM: Float32Array, mostM: number): void {
  const colours = new Float32Array(3 * peaksM.length);
  for (const [vertex, peak] of peaksM.entries()) {
    colours.set(colourOf(peak < LEAST_M ? null : peak / mostM), 3 * vertex);
  }
  geometry.setAttribute("color", new BufferAttribute(colours, 3));
}
