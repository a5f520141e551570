import { type BodyActions, BodyPanel } from "./body-panel.js";
import { BY_HAND } from "./by-hand.js";
import { byId, create } from "./dom.js";
import { lessMotion } from "./less-motion.js";
import { findMotion, MOTION_NAMES, MOTIONS, type MotionChoice, motionLabel } from "./motions.js";
import type { Settings, Sex } from "./settings.js";
import { createSlider, fillSliders, type Slider, showFill } from "./slider.js";
import { TissuePanel } from "./tissue-panel.js";
import { clipLabel, clipNamesOf } from "./truth.js";

/** What the controls do. Each is called after `settings` has changed. */
export interface PanelActions extends BodyActions {
  setMotion(): void;
  setMotionOptions(): void;
  setDynamics(): void;
  setHeat(): void;
  setHud(): void;
  setSpeed(): void;
  setPaused(): void;
  setTuning(): void;
  stepFrame(): void;
  seek(timeSeconds: number): void;
  resetView(): void;
  copyHud(): void;
  /** Shows actors alone, under a divider or beside each other: the next of these. */
  nextLayout(): void;
  /** Puts the keyboard's focus on the body that is moved by hand. */
  focusBody(): void;
  /** Shows the first or the second actor alone; null: all again. */
  hold(side: "left" | "right" | null): void;
}

/** Value of the list's entry for a file. */
const FILE_MOTION = "file:";
/** Begins the values of the list's entries for ground-truth clips. */
const CLIP_MOTION = "clip:";

const option = (value: string, textContent: string) => create("option", { value, textContent });

/** The controls: reads them into the settings and shows the settings in them. */
export class Panel {
  readonly #settings: Settings;
  readonly #actions: PanelActions;
  readonly #body: BodyPanel;
  #scrubbing = false;
  /** The body whose clips the list has. */
  #clipsOf: Sex | null = null;

  constructor(settings: Settings, actions: PanelActions) {
    this.#settings = settings;
    this.#actions = actions;
    this.#body = new BodyPanel(settings, actions);
    this.#bindMotion();
    this.#bindTissue();
    this.#bindTransport();
    this.#bindKeys();
    this.#bindSheet();
    this.show();
  }

  /** Shows the settings in the controls that are not sliders. */
  show(): void {
    const { dynamics, heat, hud, speed, paused, sex } = this.#settings;
    setSwitch("dynamics", dynamics);
    byId("dynamics-note").textContent = dynamics
      ? "on: the network moves the skin"
      : "off: plain skinning";
    setSwitch("heat", heat);
    setSwitch("hud-toggle", hud);
    byId("legend").hidden = !heat;
    byId("hud").hidden = !hud;
    byId<HTMLSelectElement>("speed").value = `${speed}`;
    const play = byId("play");
    play.classList.toggle("paused", paused);
    play.setAttribute("aria-label", paused ? "Play" : "Pause");
    byId("still-note").hidden = !(paused && lessMotion.matches);
    this.#body.show();
    if (this.#clipsOf !== sex) this.#showClips(sex);
  }

  /** Puts the ground-truth clips of a body into the list of motions. */
  #showClips(sex: Sex): void {
    this.#clipsOf = sex;
    byId("motion-clips").replaceChildren(
      ...clipNamesOf(sex).map((name) =>
        option(CLIP_MOTION + name, `${clipLabel(name)}, simulated`),
      ),
    );
  }

  /** Shows where in the motion the clock is; what has no end has no timeline. */
  showTime(timeSeconds: number, durationSeconds: number): void {
    const input = byId<HTMLInputElement>("time");
    const ends = Number.isFinite(durationSeconds);
    input.disabled = !ends;
    if (!ends) {
      showText("time-text", `${timeSeconds.toFixed(1)} s`);
      return;
    }
    input.max = `${durationSeconds}`;
    if (!this.#scrubbing) input.value = `${timeSeconds}`;
    showFill(input);
    showText("time-text", `${timeSeconds.toFixed(1)} / ${durationSeconds.toFixed(1)} s`);
  }

  /** Selects what plays in the list, which holds at most one file; null: the settings' motion. */
  showPlaying(fileName: string | null): void {
    const select = byId<HTMLSelectElement>("motion");
    select.querySelector(`option[value="${FILE_MOTION}"]`)?.remove();
    const { motion, clip } = this.#settings;
    byId("hand-hint").hidden = fileName !== null || clip !== null || motion !== BY_HAND;
    if (fileName === null) {
      select.value = clip === null ? motion : CLIP_MOTION + clip;
      this.#showMotionOptions(clip === null ? findMotion(motion) : null);
      return;
    }
    select.append(create("option", { value: FILE_MOTION, textContent: fileName, selected: true }));
    this.#showMotionOptions(null);
  }

  /** The sliders that belong to a motion; none for a file. */
  #showMotionOptions(choice: MotionChoice | null): void {
    const sliders: Slider[] = [];
    const add = (
      id: string,
      label: string,
      [min, usual, max]: [number, number, number],
      now: number | null,
      format: (value: number) => string,
      apply: (value: number) => void,
    ) => {
      const onInput = (value: number) => {
        apply(value);
        this.#actions.setMotionOptions();
      };
      const range = { min, max, step: id === "tempo" ? 0.05 : 0.005, value: usual };
      const slider = createSlider({ id, label, ...range, format, onInput });
      slider.set(now ?? usual);
      sliders.push(slider);
    };
    const settings = this.#settings;
    if (choice) {
      const hertz = (value: number) => `${value.toFixed(1)} Hz`;
      add("tempo", "Tempo", choice.tempoHz, settings.tempoHz, hertz, (value) => {
        settings.tempoHz = +value.toFixed(3);
      });
      const centimetres = (value: number) => `${Math.round(value * 100)} cm`;
      add("height", "Height", choice.heightM, settings.heightM, centimetres, (value) => {
        settings.heightM = +value.toFixed(3);
      });
    }
    fillSliders("motion-params", sliders);
  }

  #bindMotion(): void {
    const select = byId<HTMLSelectElement>("motion");
    const group = (label: string, options: HTMLElement[], id = "") =>
      create("optgroup", { label, id }, options);
    select.replaceChildren(
      group(
        "Made by formula",
        MOTIONS.map(({ name, label }) => option(name, label)),
      ),
      group("Yours", [option(BY_HAND, motionLabel(BY_HAND))]),
      group("With simulated ground truth", [], "motion-clips"),
    );
    this.#showClips(this.#settings.sex);
    this.showPlaying(null);
    select.addEventListener("change", () => {
      const choice = MOTION_NAMES.find((name) => name === select.value);
      const clips = clipNamesOf(this.#settings.sex);
      const clip = clips.find((name) => CLIP_MOTION + name === select.value) ?? null;
      if (!choice && clip === null) return;
      this.#settings.clip = clip;
      if (choice) this.#settings.motion = choice;
      this.#settings.tempoHz = null;
      this.#settings.heightM = null;
      this.#actions.setMotion();
    });
  }

  #bindTissue(): void {
    const toggle = (id: string, key: "dynamics" | "heat" | "hud", done: () => void) => {
      byId(id).addEventListener("click", () => {
        this.#settings[key] = !this.#settings[key];
        this.show();
        done();
      });
    };
    toggle("dynamics", "dynamics", () => this.#actions.setDynamics());
    toggle("heat", "heat", () => this.#actions.setHeat());
    toggle("hud-toggle", "hud", () => this.#actions.setHud());
    byId("hud-copy").addEventListener("click", () => this.#actions.copyHud());
    new TissuePanel(this.#settings, () => this.#actions.setTuning());
  }

  #bindTransport(): void {
    byId("play").addEventListener("click", () => this.#togglePaused());
    byId("frame-step").addEventListener("click", () => this.#stepFrame());
    const speed = byId<HTMLSelectElement>("speed");
    speed.addEventListener("change", () => {
      this.#settings.speed = Number(speed.value);
      this.#actions.setSpeed();
    });
    const time = byId<HTMLInputElement>("time");
    time.addEventListener("input", () => {
      this.#scrubbing = true;
      this.#actions.seek(time.valueAsNumber);
    });
    time.addEventListener("change", () => {
      this.#scrubbing = false;
    });
  }

  #takeInHand(): void {
    const select = byId<HTMLSelectElement>("motion");
    if (select.value !== BY_HAND) {
      select.value = BY_HAND;
      select.dispatchEvent(new Event("change"));
    }
    this.#actions.focusBody();
  }

  #togglePaused(): void {
    this.#settings.paused = !this.#settings.paused;
    this.show();
    this.#actions.setPaused();
  }

  #stepFrame(): void {
    if (!this.#settings.paused) this.#togglePaused();
    this.#actions.stepFrame();
  }

  #bindKeys(): void {
    const keys: Record<string, () => void> = {
      " ": () => this.#togglePaused(),
      ".": () => this.#stepFrame(),
      d: () => byId("dynamics").click(),
      m: () => byId("heat").click(),
      t: () => byId("hud-toggle").click(),
      r: () => this.#actions.resetView(),
      c: () => this.#actions.nextLayout(),
      x: () => byId("swap").click(),
      a: () => this.#actions.hold("left"),
      b: () => this.#actions.hold("right"),
      g: () => byId("plots-toggle").click(),
      p: () => byId("picture").click(),
      v: () => byId("record").click(),
      u: () => byId("code-open").click(),
      k: () => byId("benchmark-open").click(),
      h: () => this.#takeInHand(),
      "?": () => byId("keys-open").click(),
    };
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (document.querySelector("dialog[open]")) return;
      if (isOwnKey(event.target as HTMLElement, event.key)) return;
      const action = keys[event.key.toLowerCase()];
      if (!action) return;
      event.preventDefault();
      action();
    });
    addEventListener("keyup", (event) => {
      if (["a", "b"].includes(event.key.toLowerCase())) this.#actions.hold(null);
    });
  }

  /** On narrow screens the panel is a sheet that slides up from the bottom. */
  #bindSheet(): void {
    const panel = byId("panel");
    const handle = byId("sheet-handle");
    const setOpen = (open: boolean) => {
      panel.classList.toggle("open", open);
      handle.setAttribute("aria-expanded", `${open}`);
    };
    handle.addEventListener("click", () => setOpen(!panel.classList.contains("open")));
    byId("view").addEventListener("pointerdown", () => setOpen(false));
  }
}

/** Whether a control does something of its own with a key, so that it is no shortcut there. */
function isOwnKey(control: HTMLElement, key: string): boolean {
  // Fields take text, and a list jumps to what is typed.
  const takesText = "textarea, select, input:not([type=range], [type=radio], [type=checkbox])";
  if (control.matches(takesText)) return key.length === 1;
  return key === " " && control.matches("button, summary, input:not([type=range])");
}

/** Shows a switch on or off. */
export function setSwitch(id: string, on: boolean): void {
  byId(id).setAttribute("aria-checked", `${on}`);
}

function showText(id: string, text: string): void {
  const output = byId(id);
  if (output.textContent !== text) output.textContent = text;
}
