import { REGION_NAMES } from "dynaskin";
import { actorLabel, actorsOf, SLOTS } from "./actors.js";
import { checkRadio } from "./controls.js";
import { byId, create } from "./dom.js";
import { LAYOUTS, type Layout } from "./settings.js";
import { type PageStore, swapFirstTwo } from "./state.js";
import { regionLabel } from "./tissue-panel.js";

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
  readonly #store: PageStore;

  constructor(store: PageStore) {
    this.#store = store;
    byId("region").append(
      ...REGION_NAMES.map((value) => create("option", { value, textContent: regionLabel(value) })),
    );
    this.#bind();
    store.show(() => this.#showActors());
    store.show(() => this.#showClothes());
    store.show(() => this.#showReadings());
  }

  #showActors(): void {
    const { state } = this.#store;
    const { sex, clip, layout, isNarrow } = state;
    byId("swap").hidden = layout === "one";
    byId("swap").textContent = layout === "side" ? "Swap the first two" : "Swap sides";
    byId("narrow-note").hidden = !(layout === "side" && isNarrow);
    const kinds = actorsOf(sex, clip !== null);
    for (const [idx, slot] of SLOTS.entries()) {
      const name = PLACES[layout][idx] ?? "";
      byId(`field-${slot}`).hidden = name === "" || (isNarrow && idx > 1);
      byId(`label-${slot}`).textContent = name;
      const select = byId<HTMLSelectElement>(`actor-${slot}`);
      const nobody = idx > 1 ? [create("option", { value: "", textContent: "Nobody" })] : [];
      select.replaceChildren(
        ...nobody,
        ...kinds.map((value) => create("option", { value, textContent: actorLabel(value) })),
      );
      select.value = state[slot] ?? "";
    }
  }

  #showClothes(): void {
    const { clip, clothes } = this.#store.state;
    checkRadio("clothes", clip ? "unsupported" : clothes);
    byId<HTMLFieldSetElement>("clothes").disabled = clip !== null;
    byId<HTMLFieldSetElement>("shape").disabled = clip !== null;
    byId("clothes-note").textContent = clip
      ? "Ground truth was simulated on this one body, without support."
      : CLOTHES_NOTES[clothes];
  }

  #showReadings(): void {
    const { heat, clip, plots } = this.#store.state;
    byId("heat-of").hidden = !heat || clip === null;
    byId("plots").hidden = !plots;
  }

  #bind(): void {
    const store = this.#store;
    for (const slot of SLOTS) {
      byId<HTMLSelectElement>(`actor-${slot}`).addEventListener("change", (event) => {
        const { value } = event.target as HTMLSelectElement;
        store.change({ [slot]: value || null });
      });
    }
    byId("swap").addEventListener("click", () => swapFirstTwo(store));
    byId("clothes").addEventListener("change", (event) => {
      const { value } = event.target as HTMLInputElement;
      store.change({ clothes: value === "unsupported" ? "unsupported" : "sportswear" });
    });
  }

  /** The next way in which actors share the picture. */
  nextLayout(): void {
    const next = LAYOUTS[(LAYOUTS.indexOf(this.#store.state.layout) + 1) % LAYOUTS.length];
    document.querySelector<HTMLInputElement>(`input[name=layout][value=${next}]`)?.click();
  }
}
