import { REGION_NAMES, type RegionName } from "dynaskin";
import { actorLabel, actorsOf, SLOTS } from "./actors.js";
import { byId, create } from "./dom.js";
import { narrowScreen } from "./narrow.js";
import { setSwitch } from "./panel.js";
import { LAYOUTS, type Layout, type Settings } from "./settings.js";
import { regionLabel } from "./tissue-panel.js";

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

/** What the places are called in each layout; empty where it has no such place. */
const PLACES: Readonly<Record<Layout, readonly string[]>> = {
  one: ["", "Actor", "", ""],
  wipe: ["Left", "Right", "", ""],
  side: ["First", "Second", "Third", "Fourth"],
};

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
    const { sex, clip, layout, clothes, heat, heatOf, plots, region } = this.#settings;
    for (const input of document.querySelectorAll<HTMLInputElement>("input[name=layout]")) {
      input.checked = input.value === layout;
    }
    byId("swap").hidden = layout === "one";
    byId("swap").textContent = layout === "side" ? "Swap the first two" : "Swap sides";
    byId("narrow-note").hidden = !(layout === "side" && narrowScreen.matches);
    const kinds = actorsOf(sex, clip !== null);
    for (const [idx, slot] of SLOTS.entries()) {
      const name = PLACES[layout][idx] ?? "";
      byId(`field-${slot}`).hidden = name === "" || (narrowScreen.matches && idx > 1);
      byId(`label-${slot}`).textContent = name;
      const select = byId<HTMLSelectElement>(`actor-${slot}`);
      const nobody = idx > 1 ? [create("option", { value: "", textContent: "Nobody" })] : [];
      select.replaceChildren(
        ...nobody,
        ...kinds.map((value) => create("option", { value, textContent: actorLabel(value) })),
      );
      select.value = this.#settings[slot] ?? "";
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
    byId("layout").addEventListener("change", (event) => {
      const { value } = event.target as HTMLInputElement;
      settings.layout = LAYOUTS.find((layout) => layout === value) ?? settings.layout;
      after(() => this.#actions.setActors());
    });
    for (const slot of SLOTS) {
      byId<HTMLSelectElement>(`actor-${slot}`).addEventListener("change", (event) => {
        const { value } = event.target as HTMLSelectElement;
        Object.assign(settings, { [slot]: value || null });
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

  /** The next way in which actors share the picture. */
  nextLayout(): void {
    const next = LAYOUTS[(LAYOUTS.indexOf(this.#settings.layout) + 1) % LAYOUTS.length];
    document.querySelector<HTMLInputElement>(`input[name=layout][value=${next}]`)?.click();
  }
}
