import { byId, create } from "./dom.js";

/** A labelled slider with its value beside it. */
export interface SliderOptions {
  id: string;
  label: string;
  min: number;
  max: number;
  step: number;
  value: number;
  /** The value as text, with its unit. */
  format: (value: number) => string;
  onInput: (value: number) => void;
}

/** A slider in the page; `set` moves it without calling `onInput`. */
export interface Slider {
  element: HTMLElement;
  set: (value: number) => void;
}

/** Builds a slider. A double click puts it back to its first value. */
export function createSlider(options: SliderOptions): Slider {
  const { id, label, min, max, step, value, format, onInput } = options;
  const input = create("input", { type: "range", id });
  Object.assign(input, { min: `${min}`, max: `${max}`, step: `${step}` });
  const output = create("output");
  output.htmlFor.add(id);
  const name = create("label", { htmlFor: id, textContent: label });
  const set = (next: number) => {
    input.value = `${next}`;
    showFill(input);
    output.textContent = format(input.valueAsNumber);
  };
  input.addEventListener("input", () => {
    set(input.valueAsNumber);
    onInput(input.valueAsNumber);
  });
  input.addEventListener("dblclick", () => {
    set(value);
    onInput(value);
  });
  set(value);
  return { element: create("div", { className: "slider" }, [name, input, output]), set };
}

/** Replaces the sliders in a container. */
export function fillSliders(containerId: string, sliders: Slider[]): void {
  byId(containerId).replaceChildren(...sliders.map((slider) => slider.element));
}

/** Colours the part of the track left of the thumb, which browsers do not do alike. */
export function showFill(input: HTMLInputElement): void {
  const { min, max, valueAsNumber } = input;
  const share = (valueAsNumber - +min) / (+max - +min || 1);
  input.style.setProperty("--fill", `${(share * 100).toFixed(2)}%`);
}
