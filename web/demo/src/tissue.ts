import { type Avatar, type ControlPreset, REGION_NAMES, type RegionName } from "dynaskin";
/** Lowest, usual and highest factor on all offsets; four times is the most that the core takes. */
export const STRENGTH = [0, 1, 4] as const;

/** What of a region can be changed: the offsets' size, and how stiff and how damped its tissue is. */
export const TISSUE_PROPERTIES = ["gain", "stiffness", "damping"] as const;
export type TissueProperty = (typeof TISSUE_PROPERTIES)[number];

/** Lowest, usual and highest factor on each. */
export const TISSUE_FACTORS: Record<TissueProperty, readonly [number, number, number]> = {
  gain: [0, 1, 2],
  stiffness: [0.25, 1, 4],
  damping: [0.25, 1, 4],
};

/** Factors on the tissue of regions, where they are not 1. */
export type TissueFactors = Readonly<
  Record<TissueProperty, Readonly<Partial<Record<RegionName, number>>>>
>;

/** What the page's controls say of an avatar's tissue. */
export interface TissueSettings {
  preset: ControlPreset;
  /** Factor on all offsets; 0 without tissue. */
  strength: number;
  tissue: TissueFactors;
}

/** How far neighbouring vertices may move against each other, as a share of what lies between them. */
const MAX_STRAIN = 0.5;

/** Where offsets end that are made larger than predicted, in centimetres: beyond, skin would fold. */
const LIMITS_CM: Readonly<Record<RegionName, number>> = {
  chest: 8,
  belly: 6,
  buttocks: 6,
  thighs: 4.5,
  calves: 2.5,
  "upper-arms": 3,
};

/** The factor from which on a region's own limit holds; below, it goes over from no limit. */
const FULL_FACTOR = 1.5;

/** The limit of a region whose offsets are that many times as large as predicted. */
function limitCm(region: RegionName, factor: number, usualCm: number): number {
  const share = Math.min(1, Math.max(0, (factor - 1) / (FULL_FACTOR - 1)));
  return Math.min(usualCm, usualCm + share * (LIMITS_CM[region] - usualCm));
}

/** Gives an avatar the tissue of the settings. More than predicted saturates at a region's limit. */
export function tuneTissue(avatar: Avatar, { preset, strength, tissue }: TissueSettings): void {
  avatar.setControls(preset);
  const { regions } = avatar.controls;
  for (const name of REGION_NAMES) {
    const region = regions[name];
    const factorOf = (property: keyof TissueFactors) => tissue[property][name] ?? 1;
    region.gain *= factorOf("gain");
    // Firm clothes over stiff tissue would leave the range that the core takes.
    region.stiffness = Math.min(10, region.stiffness * factorOf("stiffness"));
    region.damping = Math.min(10, region.damping * factorOf("damping"));
    const softened = Math.max(1, 1 / Math.sqrt(factorOf("stiffness") * factorOf("damping")));
    region.limitCm = limitCm(name, strength * factorOf("gain") * softened, region.limitCm);
  }
  avatar.setControls({ regions });
  // What shape and sliders ask for together must not fold the skin.
  avatar.maxStrain = MAX_STRAIN;
  avatar.strength = strength;
}
