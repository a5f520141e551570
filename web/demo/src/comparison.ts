import { REGION_NAMES, type RegionName } from "dynaskin";
import { actorLabel, actorsOf } from "./actors.js";
import { byId, create } from "./dom.js";
import { regionLabel, setSwitch } from "./panel.js";
import type { Settings } from "./settings.js";

/** What the controls do. Each is called after `settings` has changed. */
export interface ComparisonActions {
  setActors(): void;
  setClothes(): void;
  setHeatOf(): void;
  setPlots(): void;
}

const CLOTHES_NOTES = {
  sportswear: "A supported chest, which swings half as far and faster, and firmer hips and thighs.",
  unsupported: "Nothing holds the tissue: it moves as the networks predict it.",
} as const;

/** The controls of actors, clothes, heat map and plots. */
export class Comparison {
  readonly #settings: Settings;
  readonly #actions: ComparisonActions;

  constructor(settings: Settings, actions: ComparisonActions) {
    this.#settings = settings;
    this.#actions = actions;
    byId("region").append(
      ...REGION_NAMES.map((value) => create("option", { value, textContent: regionLabel(value) })),
    );
    this.#bind();
    this.show();
  }

  /** Shows the settings. */
  show(): void {
    const { sex, clip, compare, clothes, heat, heatOf, plots, region } = this.#settings;
    setSwitch("compare", compare);
    byId("field-left").hidden = !compare;
    byId("label-right").textContent = compare ? "Right" : "Actor";
    byId("swap").hidden = !compare;
    const kinds = actorsOf(sex, clip !== null);
    for (const side of ["left", "right"] as const) {
      const select = byId<HTMLSelectElement>(`actor-${side}`);
      select.replaceChildren(
        ...kinds.map((value) => create("option", { value, textContent: actorLabel(value) })),
      );
      select.value = this.#settings[side];
    }
    for (const input of document.querySelectorAll<HTMLInputElement>("input[name=clothes]")) {
      input.checked = input.value === (clip ? "unsupported" : clothes);
    }
    byId<HTMLFieldSetElement>("clothes").disabled = clip !== null;
    byId<HTMLFieldSetElement>("shape").disabled = clip !== null;
    byId("clothes-note").textContent = clip
      ? "Ground truth was simulated on this one body, without support."
      : CLOTHES_NOTES[clothes];
    byId("heat-of").hidden = !heat || clip === null;
    for (const input of document.querySelectorAll<HTMLInputElement>("input[name=heat-of]")) {
      input.checked = input.value === heatOf;
    }
    setSwitch("plots-toggle", plots);
    byId("plots").hidden = !plots;
    byId<HTMLSelectElement>("region").value = region;
  }

  #bind(): void {
    const settings = this.#settings;
    const after = (act: () => void) => {
      this.show();
      act();
    };
    byId("compare").addEventListener("click", () => {
      settings.compare = !settings.compare;
      after(() => this.#actions.setActors());
    });
    for (const side of ["left", "right"] as const) {
      byId<HTMLSelectElement>(`actor-${side}`).addEventListener("change", (event) => {
        settings[side] = (event.target as HTMLSelectElement).value;
        after(() => this.#actions.setActors());
      });
    }
    byId("swap").addEventListener("click", () => {
      [settings.left, settings.right] = [settings.right, settings.left];
      after(() => this.#actions.setActors());
    });
    byId("clothes").addEventListener("change", (event) => {
      const { value } = event.target as HTMLInputElement;
      settings.clothes = value === "unsupported" ? "unsupported" : "sportswear";
      after(() => this.#actions.setClothes());
    });
    byId("heat-of").addEventListener("change", (event) => {
      const { value } = event.target as HTMLInputElement;
      settings.heatOf = value === "error" ? "error" : "offset";
      after(() => this.#actions.setHeatOf());
    });
    byId("plots-toggle").addEventListener("click", () => {
      settings.plots = !settings.plots;
      after(() => this.#actions.setPlots());
    });
    byId<HTMLSelectElement>("region").addEventListener("change", (event) => {
      settings.region = (event.target as HTMLSelectElement).value as RegionName;
      after(() => this.#actions.setPlots());
    });
  }
}
