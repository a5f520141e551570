import traits from "virtual:traits";
import { checkRadio } from "./controls.js";
import { byId } from "./dom.js";
import { Figures } from "./figures.js";
import { withinBound } from "./likely.js";
import { SHAPE_LIMIT } from "./settings.js";
import { createSlider, fillSliders, type Slider } from "./slider.js";
import { chooseBody, type PageStore } from "./state.js";
import { type Trait, traitOf } from "./traits.js";
import { randomWords, type Words } from "./words.js";

const LABELS: Record<Trait["name"], string> = {
  stature: "Stature",
  weight: "Weight",
  chest: "Chest",
  muscle: "Muscle",
  age: "Age",
};
const ORDER: readonly Trait["name"][] = ["weight", "muscle", "chest", "stature", "age"];

const signed = (value: number) =>
  `${value > 0 ? "+" : value < 0 ? "−" : ""}${Math.abs(value).toFixed(1)}`;

/** The choice of a body and of its shape: by what people call it, and by its ten coefficients. */
export class BodyPanel {
  readonly #store: PageStore;
  readonly #coefficients: Slider[];
  #traitSliders: { trait: Trait; slider: Slider }[] = [];
  readonly #figures: Figures;
  /** What the sliders have asked for, and the shape that came of it: another one begins anew. */
  #wish: { words: Partial<Words>; shape: readonly number[] } | null = null;
  /** The slider that is being moved. */
  #moving: Trait["name"] | null = null;

  constructor(store: PageStore) {
    this.#store = store;
    this.#figures = new Figures(store);
    const { state } = store;
    byId("sex").addEventListener("change", (event) => {
      const { value } = event.target as HTMLInputElement;
      chooseBody(store, value === "male" ? "male" : "female");
    });
    this.#coefficients = state.shape.map((_, idx) =>
      createSlider({
        id: `shape-${idx}`,
        label: `Shape ${idx + 1}`,
        ...{ min: -SHAPE_LIMIT, max: SHAPE_LIMIT, step: 0.1, value: 0 },
        format: (beta) => `${signed(beta)} σ`,
        onInput: (beta) => this.#setShape(withinBound(state.shape.with(idx, beta), idx)),
      }),
    );
    fillSliders("shape-coefficients", this.#coefficients);
    byId("shape-reset").addEventListener("click", () => this.#setShape(state.shape.map(() => 0)));
    byId("shape-random").addEventListener("click", () => {
      const shape = this.#figures.shapeOf(randomWords(traits[state.sex]));
      if (shape) this.#setShape(shape);
    });
    this.#makeTraits();
    store.on(
      () => [state.sex],
      () => this.#makeTraits(),
    );
    store.show(() => checkRadio("sex", state.sex));
    store.show(() => this.#showShape(state.shape));
  }

  /** The sliders of a body, whose traits are its own. */
  #makeTraits(): void {
    const { sex, shape } = this.#store.state;
    const own = traits[sex];
    this.#traitSliders = ORDER.flatMap((name) => own.filter((trait) => trait.name === name)).map(
      (trait) => {
        const [low, high] = trait.range;
        const slider = createSlider({
          id: `trait-${trait.name}`,
          label: LABELS[trait.name],
          ...{ min: Math.floor(low), max: Math.ceil(high), step: 0.1, value: trait.mean },
          format: (value) => `${Math.round(value)} ${trait.unit}`,
          onInput: (value) => this.#setTrait(trait, value),
        });
        // The thumb goes back to as far as bodies reach.
        slider.element.addEventListener("change", () => this.#showShape(this.#store.state.shape));
        slider.set(traitOf(trait, shape));
        return { trait, slider };
      },
    );
    fillSliders(
      "shape-traits",
      this.#traitSliders.map(({ slider }) => slider),
    );
  }

  /** With the stature and the weight as they are, and what else the sliders have asked for; the rest follows. */
  #setTrait(trait: Trait, value: number): void {
    const { shape } = this.#store.state;
    const now = this.#figures.measure(shape);
    if (!now) return;
    const { stature, weight } = now;
    const before = this.#wish?.shape === shape ? this.#wish.words : { stature, weight };
    const words = { ...before, [trait.name]: value };
    const next = this.#figures.shapeOf(words);
    if (!next) return;
    this.#wish = { words, shape: next };
    this.#moving = trait.name;
    this.#store.change({ shape: next });
    this.#moving = null;
  }

  #setShape(next: readonly number[]): void {
    this.#store.change({ shape: next });
  }

  /** Shows the shape in all sliders but the one that is being moved. */
  #showShape(shape: readonly number[]): void {
    const measured = this.#figures.measure(shape);
    for (const { trait, slider } of this.#traitSliders) {
      if (trait.name === this.#moving) continue;
      slider.set(measured?.[trait.name] ?? traitOf(trait, shape));
    }
    this.#coefficients.forEach((slider, idx) => {
      slider.set(shape[idx] ?? 0);
    });
  }
}
