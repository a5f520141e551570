import traits, { type Trait } from "virtual:traits";
import { byId } from "./dom.js";
import { type Settings, SHAPE_LIMIT } from "./settings.js";
import { createSlider, fillSliders, type Slider } from "./slider.js";
import { traitOf, withTrait } from "./traits.js";

/** What the controls of the body do. Each is called after `settings` has changed. */
export interface BodyActions {
  setSex(): void;
  setShape(): void;
}

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
  readonly #settings: Settings;
  readonly #actions: BodyActions;
  #traitSliders: { trait: Trait; slider: Slider }[] = [];
  #coefficients: Slider[] = [];
  /** Whose sliders the traits' are. */
  #sex: Settings["sex"] | null = null;
  /** The slider that is being moved and the shape that it began from. */
  #moving: { name: Trait["name"]; from: readonly number[] } | null = null;

  constructor(settings: Settings, actions: BodyActions) {
    this.#settings = settings;
    this.#actions = actions;
    byId("sex").addEventListener("change", (event) => {
      const { value } = event.target as HTMLInputElement;
      settings.sex = value === "male" ? "male" : "female";
      this.show();
      actions.setSex();
    });
    this.#coefficients = settings.shape.map((_, idx) =>
      createSlider({
        id: `shape-${idx}`,
        label: `Shape ${idx + 1}`,
        ...{ min: -SHAPE_LIMIT, max: SHAPE_LIMIT, step: 0.1, value: 0 },
        format: (beta) => `${signed(beta)} σ`,
        onInput: (beta) => this.#setShape(settings.shape.with(idx, beta)),
      }),
    );
    fillSliders("shape-coefficients", this.#coefficients);
    byId("shape-reset").addEventListener("click", () =>
      this.#setShape(settings.shape.map(() => 0)),
    );
    byId("shape-random").addEventListener("click", () =>
      this.#setShape(settings.shape.map(randomNormal)),
    );
    this.show();
  }

  /** Shows the settings' body. */
  show(): void {
    const { sex } = this.#settings;
    for (const input of document.querySelectorAll<HTMLInputElement>("input[name=sex]")) {
      input.checked = input.value === sex;
    }
    if (sex !== this.#sex) {
      this.#sex = sex;
      this.#moving = null;
      this.#makeTraits();
    }
    this.#showShape(null);
  }

  #makeTraits(): void {
    const own = traits[this.#settings.sex];
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
        slider.element.addEventListener("change", () => this.#showShape(null));
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
      this.#moving = { name: trait.name, from: [...this.#settings.shape] };
    }
    this.#apply(withTrait(trait, this.#moving.from, value));
    this.#showShape(trait.name);
    this.#actions.setShape();
  }

  #setShape(next: readonly number[]): void {
    this.#moving = null;
    this.#apply(next);
    this.#showShape(null);
    this.#actions.setShape();
  }

  #apply(next: readonly number[]): void {
    next.forEach((value, idx) => {
      this.#settings.shape[idx] = value;
    });
  }

  /** Shows the shape in all sliders but the one that is being moved. */
  #showShape(moved: Trait["name"] | null): void {
    const { shape } = this.#settings;
    for (const { trait, slider } of this.#traitSliders) {
      if (trait.name !== moved) slider.set(traitOf(trait, shape));
    }
    this.#coefficients.forEach((slider, idx) => {
      slider.set(shape[idx] ?? 0);
    });
  }
}

/** A standard normal number (Box and Muller 1958), within the sliders' range. */
function randomNormal(): number {
  const radius = Math.sqrt(-2 * Math.log(1 - Math.random()));
  const value = radius * Math.cos(2 * Math.PI * Math.random());
  return Math.round(Math.max(-2.5, Math.min(2.5, value)) * 10) / 10;
}
