import { REGION_NAMES, type RegionName } from "dynaskin";
import { byId } from "./dom.js";

import { createSlider, fillSliders, type Slider } from "./slider.js";
import type { PageStore } from "./state.js";
import { STRENGTH, TISSUE_FACTORS, type TissueFactors, type TissueProperty } from "./tissue.js";

const percent = (value: number) => `${Math.round(value * 100)} %`;
const times = (octaves: number) => `× ${(2 ** octaves).toFixed(2)}`;

/** Stiffness and damping are told in ratios: half and double are equally far from the usual. */
const inOctaves = (property: TissueProperty) => property !== "gain";
const shown = (property: TissueProperty, factor: number) =>
  inOctaves(property) ? Math.log2(factor) : factor;

/** What the page calls a region. */
export function regionLabel(region: RegionName): string {
  const words = region.replace("-", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** How far the tissue moves, and how much, how stiffly and how damped in each region. */
export class TissuePanel {
  readonly #store: PageStore;
  #property: TissueProperty = "gain";
  #regions: Slider[] = [];

  constructor(store: PageStore) {
    this.#store = store;
    const [min, value, max] = STRENGTH;
    const strength = createSlider({
      id: "strength-all",
      label: "Strength",
      ...{ min, max, step: 0.05, value },
      format: percent,
      onInput: (next) => store.change({ strength: next }),
    });
    store.show(() => strength.set(store.state.strength));
    fillSliders("strength", [strength]);
    byId("tissue-property").addEventListener("change", (event) => {
      this.#makeRegions((event.target as HTMLInputElement).value as TissueProperty);
    });
    this.#makeRegions("gain");
    store.show(() => this.#showRegions(store.state.tissue));
  }

  #makeRegions(property: TissueProperty): void {
    this.#property = property;
    this.#regions = REGION_NAMES.map((region) => this.#regionSlider(property, region));
    fillSliders("regions", this.#regions);
    this.#showRegions(this.#store.state.tissue);
  }

  #showRegions(tissue: TissueFactors): void {
    const [, usual] = TISSUE_FACTORS[this.#property];
    for (const [idx, region] of REGION_NAMES.entries()) {
      this.#regions[idx]?.set(shown(this.#property, tissue[this.#property][region] ?? usual));
    }
  }

  #regionSlider(property: TissueProperty, region: RegionName): Slider {
    const [low, usual, high] = TISSUE_FACTORS[property];
    return createSlider({
      id: `region-${region}`,
      label: regionLabel(region),
      min: shown(property, low),
      max: shown(property, high),
      step: inOctaves(property) ? 0.1 : 0.05,
      value: shown(property, usual),
      format: inOctaves(property) ? times : percent,
      onInput: (next) => this.#setFactor(property, region, inOctaves(property) ? 2 ** next : next),
    });
  }

  #setFactor(property: TissueProperty, region: RegionName, factor: number): void {
    const { tissue } = this.#store.state;
    this.#store.change({
      tissue: { ...tissue, [property]: { ...tissue[property], [region]: factor } },
    });
  }
}
