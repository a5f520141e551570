import { load } from "dynaskin";
import { actorLabel } from "./actors.js";
import { Cast } from "./cast.js";
import { shownActors } from "./lineup.js";
import type { LoadingBar } from "./loading.js";
import type { Program } from "./program.js";
import { DEFAULTS, type Settings } from "./settings.js";
import { showError } from "./toast.js";
import { loadClip } from "./truth.js";
import type { View } from "./view.js";

/** What the loader asks of the page. */
export interface LoaderActions {
  /** The cast on the screen; null before the first. */
  shown(): Cast | null;
  /** Shows the settings' actors of a cast; what it throws leaves the present ones there. */
  show(cast: Cast): void;
  /** The settings were put back to what is on the screen. */
  restored(): void;
  /** A model has arrived; what has been downloaded by then. */
  downloaded(megabytes: number): void;
}

/** The settings that say who is on the screen, and in which clip. */
const ACTOR_SETTINGS = ["layout", "left", "right", "third", "fourth", "clip"] as const;

function pick(settings: Settings): Pick<Settings, (typeof ACTOR_SETTINGS)[number]> {
  const { layout, left, right, third, fourth, clip } = settings;
  return { layout, left, right, third, fourth, clip };
}

/** Fetches bodies, networks and clips for the settings. A failure leaves what plays as it was. */
export class Loader {
  readonly #settings: Settings;
  readonly #program: Program;
  readonly #view: View;
  readonly #loading: LoadingBar;
  readonly #actions: LoaderActions;
  /** The settings that the present actors and clip came from, to go back to. */
  #shown: Pick<Settings, (typeof ACTOR_SETTINGS)[number]>;
  /** Stops the latest download of a model, and that of other networks and clips. */
  #download: AbortController | null = null;
  #recasting: AbortController | null = null;

  constructor(
    settings: Settings,
    program: Program,
    view: View,
    loading: LoadingBar,
    actions: LoaderActions,
  ) {
    this.#settings = settings;
    this.#program = program;
    this.#view = view;
    this.#loading = loading;
    this.#actions = actions;
    this.#shown = pick(DEFAULTS);
  }

  /** Takes note that the settings' actors are on the screen now. */
  remember(): void {
    this.#shown = pick(this.#settings);
  }

  /**
   * Loads the model of the settings. The first body appears with plain skinning as soon as it is
   * there, and its networks follow; later, what plays goes on until all of the next model is there.
   * A failure is explained, and leaves what plays as it was.
   */
  async openModel(): Promise<void> {
    this.#download?.abort();
    this.#recasting?.abort();
    const download = new AbortController();
    this.#download = download;
    const { sex } = this.#settings;
    try {
      await this.#load(sex, download.signal);
    } catch (error) {
      if (download.signal.aborted) return;
      this.#explainLoad(sex, error);
    }
    this.#loading.finish();
  }

  async #load(sex: Settings["sex"], signal: AbortSignal): Promise<void> {
    this.#loading.start("Loading the body");
    let early: Cast | null = null;
    const model = await load({
      model: new URL(`${sex}/`, document.baseURI),
      signal,
      onProgress: ({ loadedBytes, totalBytes }) => {
        if (!signal.aborted) this.#loading.report("model", loadedBytes, totalBytes);
      },
      onBody: (body) => {
        if (signal.aborted || this.#actions.shown()) return;
        this.#loading.say("Loading the networks");
        early = new Cast(sex, body);
        this.#actions.show(early);
      },
    });
    const cast = early ?? new Cast(sex, model.body);
    cast.setModel(model);
    try {
      signal.throwIfAborted();
      // A comparison that cannot be loaded must not keep the model away.
      await this.#prepare(cast, signal).catch((error) => this.#explainActors(signal, error));
      signal.throwIfAborted();
      this.#actions.show(cast);
    } catch (error) {
      cast.dispose();
      throw error;
    }
    this.#actions.downloaded(this.#loading.loadedMegabytes);
  }

  #explainLoad(sex: Settings["sex"], error: unknown): void {
    const shown = this.#actions.shown();
    const tryAgain = () => {
      this.#settings.sex = sex;
      this.#actions.restored();
      void this.openModel();
    };
    if (!shown) {
      showError("The page could not start", error, tryAgain);
      return;
    }
    const what = shown.sex === sex && !shown.model ? `networks of the ${sex} body` : `${sex} body`;
    showError(`The ${what} could not be loaded`, error, tryAgain);
    this.#settings.sex = shown.sex;
    this.#actions.restored();
  }

  /** Fetches what the settings' actors and clip need. */
  async #prepare(cast: Cast, signal: AbortSignal): Promise<void> {
    const { clip, layout } = this.#settings;
    const present = this.#program.truth?.name === clip ? this.#program.truth : null;
    const truth = present ?? (clip === null ? null : await loadClip(clip, cast.body, signal));
    for (const { kind } of shownActors(this.#settings)) {
      await cast.prepare(kind, {
        signal,
        onProgress: (loaded, total) => {
          if (signal.aborted) return;
          this.#loading.reopen(`Loading ${actorLabel(kind)}`);
          this.#loading.report(kind, loaded, total);
        },
      });
    }
    if (layout === "wipe") await this.#view.openLeft();
    signal.throwIfAborted();
    this.#program.truth = truth;
  }

  /** Shows other actors or another clip, once all that they need is there. */
  async recast(): Promise<void> {
    this.#recasting?.abort();
    const recasting = new AbortController();
    this.#recasting = recasting;
    const cast = this.#actions.shown();
    if (!cast) return;
    try {
      await this.#prepare(cast, recasting.signal);
      if (recasting.signal.aborted || cast !== this.#actions.shown()) return;
      this.#actions.show(cast);
    } catch (error) {
      this.#explainActors(recasting.signal, error);
    }
    this.#loading.finish();
  }

  #explainActors(signal: AbortSignal, error: unknown): void {
    if (signal.aborted) return;
    const wanted = pick(this.#settings);
    showError("That comparison could not be loaded", error, () => {
      Object.assign(this.#settings, wanted);
      this.#actions.restored();
      void this.recast();
    });
    Object.assign(this.#settings, this.#shown);
    this.#actions.restored();
  }
}
