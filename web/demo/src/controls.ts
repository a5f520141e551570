import { byId } from "./dom.js";
import { type Control, SETTING_NAMES, SETTINGS, type Settings } from "./settings.js";
import type { PageStore } from "./state.js";

/** Binds the elements that `settings.ts` names to their settings, in both directions. */
export function bindControls(store: PageStore): void {
  for (const name of SETTING_NAMES) {
    const { control, values = [] } = SETTINGS[name];
    if (control) bind(store, name, control, values);
  }
}

/** Keys that press controls, as `settings.ts` names them. */
export function controlKeys(): Record<string, () => void> {
  const keys = SETTING_NAMES.flatMap((name) => {
    const control = SETTINGS[name].control;
    if (control?.kind !== "switch" || control.key === undefined) return [];
    return [[control.key, () => byId(control.id).click()] as const];
  });
  return Object.fromEntries(keys);
}

function bind(
  store: PageStore,
  name: keyof Settings,
  { kind, id }: Control,
  values: readonly unknown[],
): void {
  const element = byId(id);
  const set = (value: unknown) => store.change({ [name]: value });
  const parsed = (text: string) => values.find((value) => `${value}` === text) ?? store.state[name];
  if (kind === "switch") {
    element.addEventListener("click", () => set(!store.state[name]));
    store.show(() => setSwitch(id, store.state[name] === true));
    return;
  }
  element.addEventListener("change", ({ target }) =>
    set(parsed((target as HTMLInputElement | HTMLSelectElement).value)),
  );
  store.show(() => {
    if (kind === "radios") checkRadio(id, `${store.state[name]}`);
    else (element as HTMLSelectElement).value = `${store.state[name]}`;
  });
}

/** Checks the radio button of this name and value. */
export function checkRadio(name: string, value: string): void {
  for (const input of document.querySelectorAll<HTMLInputElement>(`input[name=${name}]`)) {
    input.checked = input.value === value;
  }
}

/** Shows a switch on or off. */
function setSwitch(id: string, on: boolean): void {
  byId(id).setAttribute("aria-checked", `${on}`);
}
