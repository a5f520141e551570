import { type LoadOptions, load as loadWhole, type Model } from "dynaskin";
import { load as loadSlim } from "dynaskin/slim";
import { actorLabel, isMethod } from "./actors.js";
import { Cast } from "./cast.js";
import { filesIn, type LoadingBar } from "./loading.js";
import { type Settings, USUAL } from "./settings.js";
import { needsWholeCore, type PageStore, type State, wantedActors } from "./state.js";
import { showError } from "./toast.js";
import { clipFile, loadClip } from "./truth.js";
import type { View } from "./view.js";

/** The settings that say who is on the screen, of which body, and in which clip. */
type ActorSettings = Pick<
  Settings,
  "chapter" | "sex" | "layout" | "left" | "right" | "third" | "fourth" | "clip"
>;

function pick(settings: Readonly<Settings>): ActorSettings {
  const { chapter, sex, layout, left, right, third, fourth, clip } = settings;
  return { chapter, sex, layout, left, right, third, fourth, clip };
}

/** Tells the bar of everything that a page with these settings is going to download. */
export function announceDownloads(state: Readonly<State>, loading: LoadingBar): void {
  const isWhole = needsWholeCore(state);
  loading.expect("renderer", ["renderer"]);
  loading.expect("model", [isWhole ? "core" : "slim", ...modelFiles(state.sex, isWhole)]);
  announceActors(state, loading, () => true);
}

/** The files of dynaskin's own model: its networks as the core of the page takes them. */
function modelFiles(sex: string, isWhole: boolean): string[] {
  const others = isWhole ? ".lowered" : ".onnx";
  return filesIn(`${sex}/`).filter((file) => !file.endsWith(others));
}

/** Tells the bar of the clip and of the networks of those actors whose networks are `missing`. */
function announceActors(
  state: Readonly<State>,
  loading: LoadingBar,
  missing: (kind: string) => boolean,
): void {
  const { sex, clip } = state;
  for (const { kind } of wantedActors(state)) {
    if (!isMethod(kind) || !missing(kind)) continue;
    loading.expect(kind, filesIn(`${sex}/methods/${kind}/`));
  }
  if (clip !== null && missing(clip)) loading.expect(clip, [clipFile(sex, clip)]);
}

/** Fetches bodies, networks and clips for the settings. A failure leaves what plays as it was. */
export class Loader {
  readonly #store: PageStore;
  readonly #view: View;
  readonly #loading: LoadingBar;
  readonly #show: (cast: Cast) => void;
  /** The settings that the present actors and clip came from, to go back to. */
  #shown: ActorSettings = pick(USUAL);
  #following = Promise.resolve();
  /** The body of the latest download. */
  #sex: Settings["sex"];
  /** Whether the whole core has been asked for: it stays. */
  #isWhole = false;
  /** Stops the latest download of a model, and that of other networks and clips. */
  #download: AbortController | null = null;
  #recasting: AbortController | null = null;
  /** What was said of downloads that failed, until what they were for is on the screen after all. */
  #said: { isRight: () => boolean; unsay: () => void }[] = [];

  /** `show` shows the settings' actors of a cast; what it throws leaves the present ones there. */
  constructor(store: PageStore, view: View, loading: LoadingBar, show: (cast: Cast) => void) {
    this.#store = store;
    this.#view = view;
    this.#loading = loading;
    this.#show = (cast) => {
      show(cast);
      this.#shown = { ...pick(store.state), sex: cast.sex };
      this.#unsay();
    };
    this.#sex = store.state.sex;
  }

  /** Goes after the settings: another body, or other actors of the present one. */
  follow(): void {
    const { state } = this.#store;
    const isLoaded = state.sex === this.#sex && (this.#isWhole || !needsWholeCore(state));
    this.#following = isLoaded ? this.#recast() : this.openModel();
  }

  /**
   * The cast with the core that runs any network and reads motion files. It is not what a visitor waits for at first:
   * the page begins with one of a fifth of its size.
   *
   * @throws Error where it cannot be loaded; the page has said why then
   */
  async openWhole(): Promise<Cast> {
    if (!this.#isWhole) {
      this.#isWhole = true;
      this.#following = this.openModel();
    }
    await this.#following;
    const { cast } = this.#store.state;
    if (cast?.isWhole) return cast;
    this.#isWhole = false;
    throw new Error("What it needs could not be loaded.");
  }

  /** Resolves when what the settings last asked for is on the screen, or has failed. */
  get following(): Promise<void> {
    return this.#following;
  }

  /**
   * Loads the model of the settings. The first body appears with plain skinning as soon as it is
   * there, and its networks follow; later, what plays goes on until all of the next model is there.
   * A failure is explained, and leaves what plays as it was.
   */
  async openModel(): Promise<void> {
    this.#download?.abort();
    this.#recasting?.abort();
    this.#recasting = null;
    const download = new AbortController();
    this.#download = download;
    const { sex, cast: shown } = this.#store.state;
    this.#sex = sex;
    this.#isWhole ||= needsWholeCore(this.#store.state);
    // A visitor who went back before the other body had come has all there is.
    if (shown?.model && shown.sex === sex && shown.isWhole === this.#isWhole) this.#goBack();
    else
      await this.#load(sex, download.signal).catch((error) => this.#explainLoad(download, error));
    this.#finish(download);
  }

  /** Takes messages away about what is there by now. */
  #unsay(): void {
    for (const { isRight, unsay } of this.#said) if (isRight()) unsay();
    this.#said = this.#said.filter(({ isRight }) => !isRight());
  }

  /** Takes the bar away once nothing is being downloaded any more. */
  #finish(download: AbortController): void {
    if (download === this.#download) this.#download = null;
    if (download === this.#recasting) this.#recasting = null;
    if (!this.#download && !this.#recasting) this.#loading.finish();
  }

  /** Puts the settings back to what is on the screen. */
  #goBack(): void {
    this.#sex = this.#shown.sex;
    this.#store.change(this.#shown);
  }

  async #load(sex: Settings["sex"], signal: AbortSignal): Promise<void> {
    const isWhole = this.#isWhole;
    const before = this.#store.state.cast;
    if (before) {
      const core = isWhole && !before.isWhole ? ["core"] : [];
      this.#loading.expect("model", [...core, ...modelFiles(sex, isWhole)]);
    }
    this.#loading.say("Loading the body");
    let early: Cast | null = null;
    // The graphics card makes the divider's second canvas while files are on their way; who needs it waits for it below.
    if (this.#store.state.layout === "wipe") this.#view.openLeft().catch(() => {});
    const load: (options: LoadOptions) => Promise<Model> = isWhole ? loadWhole : loadSlim;
    const model = await load({
      model: new URL(`${sex}/`, document.baseURI),
      signal,
      onProgress: ({ loadedBytes, totalBytes }) => {
        if (!signal.aborted) this.#loading.report("model", loadedBytes, totalBytes);
      },
      onBody: (body) => {
        if (signal.aborted || this.#store.state.cast) return;
        this.#loading.say("Loading the networks");
        early = new Cast(sex, body, isWhole);
        this.#show(early);
      },
    });
    const cast = early ?? new Cast(sex, model.body, isWhole);
    cast.setModel(model);
    try {
      signal.throwIfAborted();
      // A comparison that cannot be loaded must not keep the model away.
      await this.#prepare(cast, signal).catch((error) => {
        signal.throwIfAborted();
        this.#explainActors(error, { ...pick(USUAL), sex });
        this.#store.change({ truth: null });
      });
      signal.throwIfAborted();
      this.#show(cast);
    } catch (error) {
      cast.dispose();
      throw error;
    }
  }

  #explainLoad(download: AbortController, error: unknown): void {
    if (download.signal.aborted) return;
    // The other files are of no use any more.
    download.abort();
    const { cast: shown } = this.#store.state;
    const wanted = pick(this.#store.state);
    const tryAgain = () => {
      this.#store.change(wanted);
      if (!this.#download) void this.openModel();
    };
    const { sex } = wanted;
    const say = (title: string) => {
      const isRight = () => this.#shown.sex === sex && Boolean(this.#store.state.cast?.model);
      this.#said.push({ isRight, unsay: showError(title, error, tryAgain) });
    };
    if (!shown) {
      say("The page could not start");
      return;
    }
    const what = shown.sex === sex && !shown.model ? `networks of the ${sex} body` : `${sex} body`;
    say(`The ${what} could not be loaded`);
    this.#goBack();
  }

  /** Fetches what the settings' actors and clip need, also those that are chosen meanwhile. */
  async #prepare(cast: Cast, signal: AbortSignal): Promise<void> {
    const wanted = JSON.stringify(pick(this.#store.state));
    await this.#fetchFor(cast, signal);
    if (wanted !== JSON.stringify(pick(this.#store.state))) await this.#prepare(cast, signal);
  }

  async #fetchFor(cast: Cast, signal: AbortSignal): Promise<void> {
    const { clip, layout, truth: last } = this.#store.state;
    const present = clip !== null && last?.isOf(clip, cast.body) ? last : null;
    announceActors(this.#store.state, this.#loading, (name) =>
      name === clip ? !present : !cast.bundleOf(name),
    );
    const report = (part: string, loaded: number, total: number) => {
      if (!signal.aborted) this.#loading.report(part, loaded, total);
    };
    const say = (what: string) => this.#loading.say(`Loading ${what}`);
    let truth = present;
    if (!truth && clip !== null) {
      say("the clip");
      const onProgress = (loaded: number) => report(clip, loaded, loaded);
      truth = await loadClip(clip, cast, { signal, onProgress });
    }
    for (const { kind } of wantedActors(this.#store.state)) {
      if (isMethod(kind) && !cast.bundleOf(kind)) say(actorLabel(kind));
      const onProgress = (loaded: number, total: number) => report(kind, loaded, total);
      await cast.prepare(kind, { signal, onProgress });
    }
    if (layout === "wipe") await this.#view.openLeft();
    signal.throwIfAborted();
    this.#store.change({ truth });
  }

  /** Whether the settings' actors are those on the screen already. */
  get #isShown(): boolean {
    const { state } = this.#store;
    const { sex: _, ...actors } = pick(state);
    const { sex: __, ...present } = this.#shown;
    const places = ({ slot, kind }: { slot: string; kind: string }) => `${slot} ${kind}`;
    return (
      JSON.stringify(actors) === JSON.stringify(present) &&
      `${wantedActors(state).map(places)}` === `${state.shown.map(places)}`
    );
  }

  /** Shows other actors or another clip, once all that they need is there. */
  async #recast(): Promise<void> {
    this.#recasting?.abort();
    const recasting = new AbortController();
    this.#recasting = recasting;
    const { cast } = this.#store.state;
    try {
      if (!cast || this.#isShown) return;
      await this.#prepare(cast, recasting.signal);
      if (recasting.signal.aborted || cast !== this.#store.state.cast || this.#isShown) return;
      this.#show(cast);
    } catch (error) {
      if (recasting.signal.aborted) return;
      // Another body may be on its way, and is still wanted.
      this.#explainActors(error, { ...this.#shown, sex: this.#store.state.sex });
    } finally {
      this.#finish(recasting);
    }
  }

  /** Says why actors or a clip could not be had, and shows those of `instead`. */
  #explainActors(error: unknown, instead: ActorSettings): void {
    const wanted = pick(this.#store.state);
    const again = () => this.#store.change(wanted);
    const unsay = showError("That comparison could not be loaded", error, again);
    const isRight = () => JSON.stringify(this.#shown) === JSON.stringify(wanted);
    this.#said.push({ isRight, unsay });
    this.#store.change(instead);
  }
}
