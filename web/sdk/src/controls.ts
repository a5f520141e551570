import { REGION_NAMES, type RegionName } from "./bundle.js";
import { checkObject } from "./check.js";
import { DynaSkinError } from "./error.js";

/** How the soft tissue of one region behaves, relative to what the networks predict. */
export interface RegionControls {
  /** Factor on the offsets, 0 to 4. */
  gain: number;
  /**
   * Factor on the tissue's stiffness, 0.1 to 10: 4 doubles the frequency at which the region swings
   * and quarters what gravity does to it.
   */
  stiffness: number;
  /** Factor on the tissue's damping, 0.1 to 10: 2 halves the time it swings on for. */
  damping: number;
  /**
   * No offset is longer than this, in centimetres, 0 to 20. Up to half of it offsets are left alone;
   * longer ones approach it smoothly. At first chest and belly have 17, buttocks 16, thighs 10, calves 3
   * and upper arms 8: twice what the region reaches in the training data, but for the chest under the
   * hardest punches.
   */
  limitCm: number;
}

/**
 * All that can be turned on an avatar while it moves.
 *
 * Networks of the feature kind `inertial-materials` have learned tissue of other stiffness and damping
 * (`Bundle.learned`; the shipped ones half to twice the usual stiffness, and damping ratios of
 * 0.63 to 1.6 times the usual). Within these ranges stiffness and damping are their input. What goes
 * beyond, and everything with networks of other kinds, acts after them. Each region then counts as one
 * damped oscillator whose own frequency was measured on the model, and a linear filter replaces its
 * swing by that of the changed oscillator. It is stable for every setting,
 * and an approximation where tissue swings in several ways at once.
 */
export interface Controls {
  /** Factor on all offsets, 0 to 4. */
  strength: number;
  /**
   * Factor on how much the pelvis's own acceleration through the world shakes the tissue, 0 to 4. 0
   * keeps jumps, lifts and vehicles out and leaves what limbs and trunk do against the pelvis.
   */
  rootInertia: number;
  /** Per region; where regions meet, they are blended. */
  regions: Record<RegionName, RegionControls>;
}

/** Some of the {@link Controls}; what is left out stays as it is. */
export interface ControlChanges {
  /** See {@link Controls.strength}. */
  strength?: number;
  /** See {@link Controls.rootInertia}. */
  rootInertia?: number;
  /** The regions to change, and of each what to change. */
  regions?: Partial<Record<RegionName, Partial<RegionControls>>>;
}

/**
 * Controls with a name. `as-predicted` is how an avatar begins. `calm-clothes` is tissue under firm
 * everyday clothes, held more tightly, at rest sooner, and never more than 2 cm from where it was.
 * `sportswear` is a supported chest, which swings half as far and faster, and firmer hips and thighs;
 * the rest moves as predicted.
 */
export type ControlPreset = "as-predicted" | "calm-clothes" | "sportswear";

const HEAD = 2;
const HEAD_KEYS = ["strength", "rootInertia", "regions"] as const;
const PER_REGION = ["gain", "stiffness", "damping", "limitCm"] as const;

/** @internal */
export function controlsOf(numbers: Float32Array): Controls {
  const [strength = 0, rootInertia = 0] = numbers;
  const entries = REGION_NAMES.map((name, idx) => {
    const start = HEAD + idx * PER_REGION.length;
    const [gain = 0, stiffness = 0, damping = 0, limitM = 0] = numbers.subarray(start);
    return [name, { gain, stiffness, damping, limitCm: 100 * limitM }];
  });
  return { strength, rootInertia, regions: Object.fromEntries(entries) };
}

/**
 * The core's numbers with `changes` made to them.
 *
 * @internal
 */
export function changedControls(numbers: Float32Array, changes: ControlChanges): Float32Array {
  const changed = numbers.slice();
  const set = (idx: number, what: string, value: number | undefined, factor = 1) => {
    if (value === undefined) return;
    if (typeof value !== "number") {
      throw new DynaSkinError("argument", `The control ${what} must be a number.`);
    }
    changed[idx] = value * factor;
  };
  checkKeys("The controls", changes, HEAD_KEYS);
  set(0, "strength", changes.strength);
  set(1, "rootInertia", changes.rootInertia);
  for (const [region, controls] of Object.entries(changes.regions ?? {})) {
    const start = HEAD + regionIndex(region) * PER_REGION.length;
    checkObject(`the controls of ${region}`, controls);
    checkKeys(`The controls of ${region}`, controls, PER_REGION);
    for (const [offset, key] of PER_REGION.entries()) {
      const factor = key === "limitCm" ? 0.01 : 1;
      set(start + offset, `${key} of ${region}`, controls[key], factor);
    }
  }
  return changed;
}

/** A control that is mistyped would otherwise do nothing, and nobody would know why. */
function checkKeys(what: string, changes: object, known: readonly string[]): void {
  const unknown = Object.keys(changes).find((key) => !known.includes(key));
  if (unknown === undefined) return;
  throw new DynaSkinError("argument", `${what} have no ${unknown}; they have ${known.join(", ")}.`);
}

/**
 * The number of a region in the core.
 *
 * @internal
 */
export function regionIndex(region: string): number {
  const idx = REGION_NAMES.indexOf(region as RegionName);
  if (idx >= 0) return idx;
  const known = REGION_NAMES.join(", ");
  throw new DynaSkinError("argument", `There is no region ${region}; there are ${known}.`);
}

/**
 * The controls with `changes` made to them, for where the core is out of reach.
 *
 * @internal
 */
export function mergedControls(controls: Controls, { regions, ...head }: ControlChanges): Controls {
  const changedRegions = { ...controls.regions };
  for (const [name, change] of Object.entries(regions ?? {})) {
    regionIndex(name);
    checkObject(`the controls of ${name}`, change);
    const region = name as RegionName;
    changedRegions[region] = { ...changedRegions[region], ...change };
  }
  return { ...controls, ...head, regions: changedRegions };
}
