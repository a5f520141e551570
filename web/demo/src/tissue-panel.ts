import { REGION_NAMES, type RegionName } from "dynaskin";
import { byId } from "./dom.js";
import { STRENGTH, TISSUE_FACTORS, type TissueProperty } from "./settings.js";
import { createSlider, fillSliders, type Slider } from "./slider.js";
import type { PageStore } from "./state.js";

const percent = (value: number) => `${Math.round(value * 100)} %`;
const times = (octaves: number) => `× ${(2 ** octaves).toFixed(2)}`;

/** What the page calls a region. */
export function regionLabel(region: RegionName): string {
  const words = region.replace("-", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** How far the tissue moves, and how much, how stiffly and how damped in each region. */
export class TissuePanel {
  readonly #store: PageStore;

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
    strength.set(store.state.strength);
    fillSliders("strength", [strength]);
    byId("tissue-property").addEventListener("change", (event) => {
      this.#showRegions((event.target as HTMLInputElement).value as TissueProperty);
    });
    this.#showRegions("gain");
  }

  #showRegions(property: TissueProperty): void {
    fillSliders(
      "regions",
      REGION_NAMES.map((region) => this.#regionSlider(property, region)),
    );
  }

  #regionSlider(property: TissueProperty, region: RegionName): Slider {
    const [low, usual, high] = TISSUE_FACTORS[property];
    // Stiffness and damping are told in ratios: half and double are equally far from the usual.
    const inOctaves = property !== "gain";
    const shown = (factor: number) => (inOctaves ? Math.log2(factor) : factor);
    const slider = createSlider({
      id: `region-${region}`,
      label: regionLabel(region),
      min: shown(low),
      max: shown(high),
      step: inOctaves ? 0.1 : 0.05,
      value: shown(usual),
      format: inOctaves ? times : percent,
      onInput: (next) => this.#setFactor(property, region, inOctaves ? 2 ** next : next),
    });
    slider.set(shown(this.#store.state.tissue[property][region] ?? usual));
    return slider;
  }

  #setFactor(property: TissueProperty, region: RegionName, factor: number): void {
    const { tissue } = this.#store.state;
    this.#store.change({
      tissue: { ...tissue, [property]: { ...tissue[property], [region]: factor } },
    });
  }
}
