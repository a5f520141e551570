import type { Sex } from "./actors.js";
import { BodyPanel } from "./body-panel.js";
import { BY_HAND } from "./by-hand.js";
import { bindControls, controlKeys } from "./controls.js";
import { byId, create } from "./dom.js";
import { lessMotion } from "./less-motion.js";
import {
  findMotion,
  MOTION_NAMES,
  MOTIONS,
  type MotionChoice,
  type MotionName,
  motionLabel,
} from "./motions.js";
import { createSlider, fillSliders, type Slider, showFill } from "./slider.js";
import { type PageStore, showsError, swapFirstTwo, wait } from "./state.js";
import { TissuePanel } from "./tissue-panel.js";
import { clipLabel, clipNamesOf } from "./truth.js";

/** What controls ask for that is no setting. */
export interface PanelActions {
  /** Plays a motion of the list, or a clip, from its beginning. */
  play(motion: MotionName, clip: string | null): void;
  stepFrame(): void;
  resetView(): void;
  copyHud(): void;
  /** Shows actors alone, under a divider or beside each other: the next of these. */
  nextLayout(): void;
  /** Puts the keyboard's focus on the body that is moved by hand. */
  focusBody(): void;
}

/** Value of the list's entry for a file. */
const FILE_MOTION = "file:";
/** Begins the values of the list's entries for ground-truth clips. */
const CLIP_MOTION = "clip:";

/** The buttons that Space is not meant for once they have been clicked. */
const TAKES_SPACE = "#panel button, #transport button, #story button";

/** The keys that the story has. */
const STORY_KEYS = [" ", ".", "a", "b", "r", "p", "v", "u", "?"];

const option = (value: string, textContent: string) => create("option", { value, textContent });

/** The controls of body, motion, tissue and playback: what is shown in them is what the store has. */
export class Panel {
  readonly #store: PageStore;
  readonly #actions: PanelActions;
  #scrubbing = false;

  constructor(store: PageStore, actions: PanelActions) {
    this.#store = store;
    this.#actions = actions;
    bindControls(store);
    new BodyPanel(store);
    new TissuePanel(store);
    this.#bindMotion();
    this.#bindTransport();
    this.#bindKeys();
    this.#bindSheet();
    byId("grab").addEventListener("click", () => this.#takeInHand());
    byId("hud-copy").addEventListener("click", () => actions.copyHud());
    store.show(() => this.#showSwitches());
  }

  /** Shows what stands beside the switches, and what they show and hide. */
  #showSwitches(): void {
    const { dynamics, heat, hud, paused } = this.#store.state;
    byId("dynamics-note").textContent = dynamics
      ? "on: the network moves the skin"
      : "off: plain skinning";
    byId("heat-note").textContent = showsError(this.#store.state)
      ? "distance from ground truth"
      : "distance from plain skinning";
    byId("legend").hidden = !heat;
    byId("hud").hidden = !hud;
    const play = byId("play");
    play.classList.toggle("paused", paused);
    play.setAttribute("aria-label", paused ? "Play" : "Pause");
    byId("still-note").hidden = !(paused && lessMotion.matches);
  }

  /** Puts the ground-truth clips of a body into the list of motions. */
  #showClips(sex: Sex): void {
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

  /** Selects what plays in the list, which holds at most one file. */
  showPlaying(): void {
    const { motion, clip, file } = this.#store.state;
    const fileName = file?.name ?? null;
    const select = byId<HTMLSelectElement>("motion");
    select.querySelector(`option[value="${FILE_MOTION}"]`)?.remove();
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
      const onInput = apply;
      const range = { min, max, step: id === "tempo" ? 0.05 : 0.005, value: usual };
      const slider = createSlider({ id, label, ...range, format, onInput });
      slider.set(now ?? usual);
      sliders.push(slider);
    };
    const { tempoHz, heightM } = this.#store.state;
    const change = this.#store.change.bind(this.#store);
    if (choice) {
      const hertz = (value: number) => `${value.toFixed(1)} Hz`;
      add("tempo", "Tempo", choice.tempoHz, tempoHz, hertz, (value) => {
        change({ tempoHz: +value.toFixed(3) });
      });
      const centimetres = (value: number) => `${Math.round(value * 100)} cm`;
      add("height", "Height", choice.heightM, heightM, centimetres, (value) => {
        change({ heightM: +value.toFixed(3) });
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
        "Procedural",
        MOTIONS.map(({ name, label }) => option(name, label)),
      ),
      group("Yours", [option(BY_HAND, motionLabel(BY_HAND))]),
      group("With simulated ground truth", [], "motion-clips"),
    );
    const { state } = this.#store;
    this.#showClips(state.sex);
    this.showPlaying();
    this.#store.on(
      () => [state.sex, state.file, state.motion, state.clip],
      () => {
        this.#showClips(state.sex);
        this.showPlaying();
      },
    );
    select.addEventListener("change", () => {
      const choice = MOTION_NAMES.find((name) => name === select.value);
      const clips = clipNamesOf(state.sex);
      const clip = clips.find((name) => CLIP_MOTION + name === select.value) ?? null;
      if (!choice && clip === null) return;
      this.#actions.play(choice ?? state.motion, clip);
    });
  }

  #bindTransport(): void {
    byId("play").addEventListener("click", () => this.#togglePaused());
    byId("frame-step").addEventListener("click", () => this.#stepFrame());
    const time = byId<HTMLInputElement>("time");
    time.addEventListener("input", () => {
      this.#scrubbing = true;
      wait(this.#store, { seekSeconds: time.valueAsNumber });
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
    this.#store.change({ paused: !this.#store.state.paused });
  }

  #stepFrame(): void {
    if (!this.#store.state.paused) this.#togglePaused();
    this.#actions.stepFrame();
  }

  #bindKeys(): void {
    const hold = (held: "left" | "right" | null) => this.#store.change({ held });
    const keys: Record<string, () => void> = {
      ...controlKeys(),
      " ": () => this.#togglePaused(),
      ".": () => this.#stepFrame(),
      r: () => this.#actions.resetView(),
      c: () => this.#actions.nextLayout(),
      x: () => swapFirstTwo(this.#store),
      a: () => hold("left"),
      b: () => hold("right"),
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
      const key = event.key.toLowerCase();
      // What is not to be seen in the story cannot be changed there.
      if (this.#store.state.chapter && !STORY_KEYS.includes(key)) return;
      const action = keys[key];
      if (!action) return;
      event.preventDefault();
      action();
    });
    // A button that was clicked would take the next Space for itself; one that Tab came to keeps it.
    addEventListener("click", (event) => {
      const button = (event.target as HTMLElement).closest<HTMLElement>(TAKES_SPACE);
      if (event.detail > 0) button?.blur();
    });
    addEventListener("keyup", (event) => {
      if (["a", "b"].includes(event.key.toLowerCase())) hold(null);
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

function showText(id: string, text: string): void {
  const output = byId(id);
  if (output.textContent !== text) output.textContent = text;
}
