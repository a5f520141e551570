import traits from "virtual:traits";
import { checkRadio } from "./controls.js";
import { byId } from "./dom.js";
import { moveTrait, randomShape, type Trait, withinBound } from "./likely.js";
import { SHAPE_LIMIT } from "./settings.js";
import { createSlider, fillSliders, type Slider } from "./slider.js";
import { chooseBody, type PageStore } from "./state.js";
import { traitOf } from "./traits.js";

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
  /** The slider that is being moved and the shape that it began from. */
  #moving: { name: Trait["name"]; from: readonly number[] } | null = null;
  #isMoving = false;

  constructor(store: PageStore) {
    this.#store = store;
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
        onInput: (beta) => this.#setShape(withinBound(state.shape.with(idx, beta))),
      }),
    );
    fillSliders("shape-coefficients", this.#coefficients);
    byId("shape-reset").addEventListener("click", () => this.#setShape(state.shape.map(() => 0)));
    byId("shape-random").addEventListener("click", () =>
      this.#setShape(randomShape(traits[state.sex])),
    );
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
    this.#moving = null;
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
        // The thumb goes back to as far as the coefficients reach.
        slider.element.addEventListener("change", () =>
          slider.set(traitOf(trait, this.#store.state.shape)),
        );
        slider.set(traitOf(trait, shape));
        return { trait, slider };
      },
    );
    fillSliders(
      "shape-traits",
      this.#traitSliders.map(({ slider }) => slider),
    );
  }

  /** From the shape at which the slider was taken, so that going back undoes going forth. */
  #setTrait(trait: Trait, value: number): void {
    if (this.#moving?.name !== trait.name) {
      this.#moving = { name: trait.name, from: this.#store.state.shape };
    }
    this.#isMoving = true;
    const kept = traits[this.#store.state.sex].filter(({ name }) => name === "stature");
    this.#store.change({ shape: moveTrait(this.#moving.from, trait, value, kept) });
    this.#isMoving = false;
  }

  #setShape(next: readonly number[]): void {
    this.#moving = null;
    this.#store.change({ shape: next });
  }

  /** Shows the shape in all sliders but the one that is being moved. */
  #showShape(shape: readonly number[]): void {
    for (const { trait, slider } of this.#traitSliders) {
      if (!this.#isMoving || trait.name !== this.#moving?.name) slider.set(traitOf(trait, shape));
    }
    this.#coefficients.forEach((slider, idx) => {
      slider.set(shape[idx] ?? 0);
    });
  }
}
