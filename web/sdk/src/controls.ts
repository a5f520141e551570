import { REGION_NAMES, type RegionName } from "./bundle.js";
import { checkObject } from "./check.js";
import { DynaSkinError } from "./error.js";

/** How the soft tissue of one region behaves, relative to what the networks predict. */
export interface RegionControls {
  /** Factor on the offsets, 0 to 4. */
  gain: number;
  /**
   * Factor on the tissue's stiffness, 0.1 to 10: 4 doubles the frequency at which the region swings
   * and quarters its displacement under gravity.
   */
  stiffness: number;
  /** Factor on the tissue's damping, 0.1 to 10: 2 halves the time for which it keeps swinging. */
  damping: number;
  /**
   * Upper limit for the length of an offset, in centimetres, 0 to 20. Offsets up to half of it do not
   * change; longer ones approach it smoothly. By default 17 for the chest, 12 for belly and buttocks,
   * 8 for thighs and upper arms, and 3 for calves.
   */
  limitCm: number;
}

/**
 * All controls of an avatar. They may change while it moves.
 *
 * Networks of the feature kind `inertial-materials` are trained on tissue of varied stiffness and damping
 * (`Bundle.learned`; the shipped ones on a quarter to four times the usual stiffness and damping ratio).
 * Within these ranges stiffness and damping are an input of the networks. The part beyond them, and
 * everything with networks of other kinds, acts after the networks: each region counts as one
 * damped oscillator whose natural frequency is measured on the model, and a linear filter replaces its
 * swing with that of the changed oscillator. The filter is stable for every setting,
 * and an approximation where tissue swings in several modes at once.
 */
export interface Controls {
  /** Factor on all offsets, 0 to 4. */
  strength: number;
  /**
   * Factor on the effect of the pelvis's acceleration through the world, 0 to 4. 0 removes the effect of
   * jumps, lifts and vehicles and keeps that of limbs and trunk moving relative to the pelvis.
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
  /** The regions to change, and the controls to change in each. */
  regions?: Partial<Record<RegionName, Partial<RegionControls>>>;
}

/**
 * Named sets of controls. `as-predicted` is the default. `calm-clothes` is tissue under firm
 * everyday clothes: held more tightly, at rest sooner, and displaced by at most 2 cm.
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
