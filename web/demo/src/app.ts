import type { Avatar } from "dynaskin";
import type { Slot } from "./actors.js";
import { Address } from "./address.js";
import type { BakedLoop } from "./baked/loop.js";
import type { BenchmarkDialog } from "./benchmark-dialog.js";
import { ByHand, type Playable } from "./by-hand.js";
import { Capture } from "./capture.js";
import type { Cast } from "./cast.js";
import { isLoop } from "./chapters.js";
import { copyText } from "./clipboard.js";
import { Comparison } from "./comparison.js";
import { bindDialogs } from "./dialogs.js";
import { byId } from "./dom.js";
import { type Extent, extentsOf, largestGapPx } from "./extent.js";
import { followStore } from "./follow.js";
import { Ghost } from "./ghost.js";
import { Hud } from "./hud.js";
import { Loader } from "./loader.js";
import type { LoadingBar } from "./loading.js";
import { FrameLoop } from "./loop.js";
import type { MotionName } from "./motions.js";
import { announcePlaying, filmTexts } from "./now-playing.js";
import { openMotionFile } from "./open-file.js";
import { Overlays } from "./overlays.js";
import { pairUp } from "./pair.js";
import { Panel } from "./panel.js";
import { Playback } from "./playing.js";
import { Program } from "./program.js";
import { showReadings } from "./readings.js";
import { hideFileReport, showFileProblem } from "./report.js";
import { readSettings } from "./settings.js";
import { Stage } from "./stage.js";
import {
  bodyCount,
  chooseMotion,
  hasTwoPictures,
  leaveClip,
  NOTHING_WAITS,
  type PageStore,
  wait,
  wantedActors,
} from "./state.js";
import { Story } from "./story.js";
import { showError } from "./toast.js";
import type { View } from "./view.js";
import { Wipe } from "./wipe.js";

/** The page: what follows from the store's values, and the loop that draws. */
export class App {
  readonly store: PageStore;
  readonly hud = new Hud();
  readonly stage: Stage;
  readonly #loader: Loader;
  readonly #view: View;
  readonly #program: Program;
  readonly #panel: Panel;
  readonly #capture: Capture;
  readonly #overlays: Overlays;
  readonly #wipe: Wipe;
  readonly #loop: FrameLoop;
  readonly #story: Story;
  readonly #baked: BakedLoop;
  #playback: Playback | null = null;
  #benchmark: BenchmarkDialog | null = null;

  constructor(store: PageStore, view: View, loading: LoadingBar, baked: BakedLoop) {
    this.store = store;
    this.#baked = baked;
    const { state } = store;
    this.#view = view;
    this.#program = new Program(store);
    this.stage = new Stage(store, this.#program);
    this.#loader = new Loader(store, view, loading, (cast) => this.#show(cast));
    if (state.camera) view.camera.place = state.camera;
    this.#story = new Story(store, view, new Ghost(view));
    this.hud.setFact("graphics", view.renderer.backend);
    this.hud.setFact("adapter", view.renderer.adapter);
    this.#wipe = new Wipe(store, (share) => view.setLeftShare(share));
    const comparison = new Comparison(store);
    this.#panel = new Panel(store, {
      play: (motion, clip) => this.#changed(() => this.#playChosen(motion, clip)),
      stepFrame: () => {
        this.applyChanges();
        this.#changed(() => this.#play((playback) => playback.step()));
      },
      resetView: () => view.camera.reset(),
      copyHud: () => void copyText(this.hud.text, "The timings are on the clipboard as text."),
      nextLayout: () => comparison.nextLayout(),
      focusBody: () => {
        this.#overlays.focusBody(this.#playback);
      },
    });
    this.#overlays = new Overlays(store, this.stage, view);
    byId("caption-close").addEventListener("click", () => store.change({ caption: false }));
    this.#capture = new Capture(view, () => this.draw(0));
    byId("share-clip").addEventListener("click", () => {
      byId<HTMLDialogElement>("share-dialog").close();
      void this.#film();
    });
    bindDialogs(store, async () => {
      const { codeFor } = await import("./code.js");
      return codeFor(state, this.#program.played, this.mainAvatar?.controls ?? null);
    });
    byId("benchmark-open").addEventListener("click", () => void this.#openBenchmark());
    followStore(
      store,
      {
        actors: () => this.#loader.follow(),
        shape: () => this.#reshape(),
        motion: () => wait(store, { motion: true }),
        tissue: () => this.#retune(),
        // Fills the plots with the seconds before.
        plots: () => this.#play((playback) => playback.seek(playback.timeSeconds)),
        clock: () => this.#applySpeed(),
        bodies: () => state.cast && view.setBodies(state.cast.body, bodyCount(state)),
        measuring: () => this.#loop.skip(),
      },
      (work) => this.#changed(work),
    );
    showReadings(store, {
      view,
      names: this.#overlays.names,
      wipe: this.#wipe,
      traces: this.stage.traces,
    });
    this.#loop = new FrameLoop({
      ...{ store, view, hud: this.hud, traces: this.stage.traces, capture: this.#capture },
      address: new Address(store, view.camera),
      // Pictures beneath the loop would only keep the networks waiting.
      isCovered: () => this.#baked.isShown && !store.state.isComplete,
      isPaused: () => this.#playback?.paused ?? false,
      draw: (elapsedSeconds) => this.draw(elapsedSeconds),
    });
  }

  /** What plays, once the body is there. */
  get playback(): Playback | null {
    return this.#playback;
  }

  /** The moment of the motion that the baked loop shows; null before and after it. */
  get bakedSeconds(): number | null {
    return this.#baked.timeSeconds;
  }

  /** The avatar that the panel's timings and the program are about: dynaskin's, unless chosen otherwise. */
  get mainAvatar(): Avatar | null {
    return this.avatarAt("right");
  }

  /** The avatar at a place of the settings; null where nobody stands there. */
  avatarAt(slot: Slot): Avatar | null {
    const idx = this.store.state.shown.findIndex((actor) => actor.slot === slot);
    return this.#playback?.avatars[idx] ?? null;
  }

  /** Where the bodies are in the picture, as they were last stepped. */
  get bodiesPx(): Extent[] {
    const avatars = this.#playback?.avatars ?? [];
    return extentsOf(avatars, this.stage.placesM(avatars.length), this.#view);
  }

  /** Largest distance in the picture between the same point of two actors, as they were last stepped; pixels. */
  get gapPx(): number {
    const [one, other] = this.#playback?.avatars ?? [];
    return one && other ? largestGapPx(one, other, this.#view) : 0;
  }

  /** Goes to where the story's loop begins, or to a moment of its first round. */
  restartStory(timeSeconds: number | null = null): void {
    if (!this.#playback) return;
    this.#goTo(timeSeconds ?? this.#story.startSeconds);
    this.#playback.rounds = 0;
  }

  /** Goes on by `seconds` of real time in the story, whatever the clock of the page says. */
  advanceStory(seconds: number): void {
    const playback = this.#playback;
    if (!playback) return;
    this.#story.direct(playback);
    playback.advance(seconds * playback.speed);
    this.#story.follow(playback, true);
  }

  /** Saves a film of what is on the screen, which moves in it even where it stands still now. */
  async #film(): Promise<void> {
    const playback = this.#playback;
    const { paused } = this.store.state;
    if (!playback || this.#capture.isBusy) return;
    const { timeSeconds } = playback;
    if (paused) this.store.change({ paused: false });
    this.#view.setFilming(true);
    try {
      const texts = { ...filmTexts(this.store.state), middles: () => this.#nameMiddles };
      await this.#capture.saveClip(texts, (seconds) => this.draw(seconds));
    } finally {
      this.#view.setFilming(false);
      this.#loop.skip();
      if (paused) {
        this.store.change({ paused });
        this.#goTo(timeSeconds);
      }
    }
  }

  /** Where actors beside each other are in the picture, as shares of its width from the left; null: they are not. */
  get #nameMiddles(): number[] | null {
    const { isPaired, shownLayout } = this.store.state;
    const playback = this.#playback;
    if (!playback || shownLayout !== "side") return null;
    const crownsM = this.stage.crownsM(playback.avatars);
    const placesM = this.stage.placesM(crownsM.length);
    const { clientWidth } = this.#view.parts[0]?.canvas ?? document.body;
    return crownsM.map(([x, y, z], idx) => {
      const [asideM, aheadM] = placesM[idx] ?? [0, 0];
      const { xPx } = this.#view.project([x + asideM, y, z + aheadM]);
      const aside = isPaired ? this.#view.asidePx(idx === 0 ? "left" : "right") : 0;
      return (xPx + aside) / Math.max(1, clientWidth);
    });
  }

  /** Loads the model of the settings; see {@link Loader.openModel}. */
  openModel(): Promise<void> {
    return this.#loader.openModel();
  }

  /** Goes on with the settings of a link, but for its graphics, as if the page had begun with them. */
  async openLink(search: string): Promise<void> {
    const { backend: _, resolution: __, ...settings } = readSettings(search);
    this.store.change({ ...settings, file: null, fileBefore: null, held: null });
    await this.#loader.following;
    hideFileReport();
    this.#changed(() => {
      this.#playback?.setMotion(this.#program.makeMotion(this.#playback.avatar));
      announcePlaying(this.store.state, this.#program.label);
    });
    this.#view.camera.place = settings.camera && [...settings.camera];
    wait(this.store, { motion: false, camera: true });
    this.#panel.showPlaying();
    this.#goTo(settings.timeSeconds);
  }

  /** Opens the benchmark, whose code comes when it is first asked for. */
  async #openBenchmark(): Promise<void> {
    try {
      const { BenchmarkDialog } = await import("./benchmark-dialog.js");
      this.#benchmark ??= new BenchmarkDialog(this.store, () => this.#loader.openWhole());
      this.#benchmark.open();
    } catch (error) {
      showError("The benchmark could not be loaded", error, () => void this.#openBenchmark());
    }
  }

  /** Plays a motion file; one that cannot be played is explained, and what played goes on. */
  openFile(file: File): Promise<void> {
    return openMotionFile(file, {
      leaveStory: () => this.#story.leave(),
      avatar: async () => {
        if (!this.#playback) {
          throw new Error("The body is still being loaded. Try again in a moment.");
        }
        await this.#loader.openWhole();
        return this.#playback.avatar;
      },
      play: (motion, { name, bytes }) => {
        this.#playback?.setMotion(motion.turnToFront());
        this.#program.setFile({ name, bytes });
        wait(this.store, { motion: false });
        leaveClip(this.store);
        // A link cannot hold the file.
        const avatar = this.#playback?.avatar;
        const nearest = avatar && motion.nearestProcedural(avatar);
        if (nearest) this.store.change({ motion: nearest, tempoHz: null, heightM: null });
        announcePlaying(this.store.state, this.#program.label);
      },
    });
  }

  /** Makes the motion anew and jumps, if controls asked for that: sliders ask more often than pictures. */
  applyChanges(): void {
    const { motion, seekSeconds: seconds } = this.store.state.waiting;
    if (motion) {
      wait(this.store, { motion: false });
      this.#changed(() => {
        const playback = this.#playback;
        playback?.setAvatars(playback.avatars, this.#program.makeMotion(playback.avatar));
      });
    }
    if (seconds !== null) {
      wait(this.store, { seekSeconds: null, camera: true });
      this.#changed(() => this.#play((playback) => playback.seek(seconds)));
    }
  }

  /** Shows the settings' actors of a cast; the present ones stay if the motion does not suit them. */
  #show(cast: Cast): void {
    const { store } = this;
    store.change({ held: null });
    const { layout, cast: castBefore } = store.state;
    const before = this.#playback?.avatars ?? [];
    const all = wantedActors(store.state);
    // A divider needs a second canvas, which is made along with the networks.
    const early = layout === "wipe" && !this.#playback;
    const shown = early ? all.filter(({ slot }) => slot === "right") : all;
    const made = this.stage.createAvatars(cast, shown);
    try {
      const [avatar] = made as [Avatar];
      const motion = this.#playback
        ? this.#program.makeMotion(avatar)
        : this.#makeFirstMotion(avatar);
      if (this.#playback) this.#playback.setAvatars(made, motion);
      else this.#playback = new Playback(made, motion, this.stage.afterStep);
    } catch (error) {
      for (const avatar of made) avatar.dispose();
      throw error;
    }
    this.#overlays.names.set(layout === "wipe" ? [] : shown);
    store.change({
      ...{ cast, shown, shownLayout: layout },
      waiting: { ...store.state.waiting, motion: false, camera: true },
    });
    for (const avatar of before) avatar.dispose();
    if (cast !== castBefore) castBefore?.dispose();
    const vertices = cast.body.vertexCount.toLocaleString("en");
    this.hud.setFact("vertices", shown.length > 1 ? `${shown.length} × ${vertices}` : vertices);
    this.#applySpeed();
    this.hud.clear();
    announcePlaying(this.store.state, this.#program.label);
    if (!cast.model) return;
    store.change({ isComplete: true });
    if (!isLoop(store.state.chapter)) this.#goToStart();
    else this.restartStory(this.#baked.timeSeconds);
  }

  /** Goes to the moment of the link once the networks are there. */
  #goToStart(): void {
    const { startSeconds } = this.store.state;
    this.store.change({ startSeconds: null });
    this.#goTo(startSeconds);
  }

  /** Goes to a moment, as far as the motion has it; null: stays. */
  #goTo(timeSeconds: number | null): void {
    const end = this.#playback?.motion.durationSeconds ?? 0;
    if (timeSeconds === null || !Number.isFinite(end)) return;
    this.#changed(() => this.#play((playback) => playback.seek(Math.min(timeSeconds, end))));
  }

  /** The link's motion; at its usual tempo and height, where the link's do not go together. */
  #makeFirstMotion(avatar: Avatar): Playable {
    try {
      return this.#program.makeMotion(avatar);
    } catch (error) {
      this.store.change({ tempoHz: null, heightM: null });
      const motion = this.#program.makeMotion(avatar);
      this.#panel.showPlaying();
      showError("The motion plays at its usual tempo and height", error);
      return motion;
    }
  }

  /** Plays on; if the avatar refuses a pose, goes back to what played before and says why. */
  #play(work: (playback: Playback) => void): void {
    if (!this.#playback) return;
    try {
      work(this.#playback);
    } catch (error) {
      if (!this.store.state.file) throw error;
      const refused = this.#program.refuseFile();
      this.#playback.setMotion(this.#program.makeMotion(this.#playback.avatar));
      announcePlaying(this.store.state, this.#program.label);
      showFileProblem(`${refused?.name} cannot be played to its end`, error, []);
    }
  }

  #playChosen(motion: MotionName, clip: string | null): void {
    hideFileReport();
    chooseMotion(this.store, motion, clip);
    // A clip plays once it is there.
    wait(this.store, { motion: false });
    if (clip !== null) return;
    this.#playback?.setMotion(this.#program.makeMotion(this.#playback.avatar));
    announcePlaying(this.store.state, this.#program.label);
  }

  #reshape(): void {
    const { shape, shown, chapter } = this.store.state;
    if (chapter) return;
    const others = (this.#playback?.avatars ?? []).filter(
      (avatar, idx) =>
        !shown[idx]?.shape && avatar.shape.some((beta, at) => beta !== Math.fround(shape[at] ?? 0)),
    );
    if (others.length === 0) return;
    for (const avatar of others) avatar.setShape(shape);
    // Longer legs take other steps.
    wait(this.store, { motion: true });
  }

  /** Gives the actors what the sliders and switches say. */
  #retune(): void {
    for (const avatar of this.#playback?.avatars ?? []) this.stage.tune(avatar);
    if (this.#playback?.paused) this.#play((playback) => playback.refresh());
  }

  #applySpeed(): void {
    if (!this.#playback) return;
    this.#playback.speed = this.store.state.speed;
    this.#playback.paused = this.store.state.paused;
  }

  /** Carries a change out, and takes note of the moment at which the motion then stands. */
  #changed(work: () => void): void {
    this.#loop.forgetPicture();
    try {
      work();
    } catch (error) {
      showError("That did not work", error);
    }
    const playback = this.#playback;
    if (!playback) return;
    const stands =
      !this.store.state.chapter &&
      playback.paused &&
      Number.isFinite(playback.motion.durationSeconds);
    this.store.change({ timeSeconds: stands ? playback.timeSeconds : null });
  }

  /** Advances by `elapsedSeconds` of real time and draws. */
  draw(elapsedSeconds: number): void {
    this.applyChanges();
    pairUp(this.store, this.#view);
    const { state } = this.store;
    // Where no frames follow, a camera on its way would stay there.
    const followSeconds = state.waiting.camera ? 0 : elapsedSeconds;
    this.store.change({ waiting: NOTHING_WAITS });
    this.#loop.noteDrawn();
    const playback = this.#playback;
    if (playback) {
      this.#story.direct(playback);
      this.#play(() => playback.frame(elapsedSeconds));
      this.#story.follow(playback);
      if (!playback.paused && this.mainAvatar) this.hud.addStep(this.mainAvatar);
      // A hand pulls the body against a camera that stands still.
      const [x = 0, , z = 0] = playback.motion instanceof ByHand ? [] : playback.pose;
      // Half a picture has no room for a trunk that leans out of it: the camera looks at its middle.
      const [headX, , headZ] = (state.isPaired && this.stage.crownsM(playback.avatars)[0]) || [
        x,
        0,
        z,
      ];
      this.#view.camera.followBody((x + headX) / 2, (z + headZ) / 2, followSeconds);
      this.hud.timed("upload", () => {
        const looks = this.stage.appearances(playback.avatars);
        const isSplit = hasTwoPictures(state);
        this.#view.upload(isSplit ? looks.slice(1) : looks, (isSplit && looks[0]) || null);
      });
      this.#panel.showTime(playback.timeSeconds, playback.motion.durationSeconds);
    }
    this.hud.timed("render", () => this.#view.draw());
    if (playback) {
      this.#story.draw(playback);
      // The body itself takes the place of its picture, and of the baked loop once it has its tissue.
      document.documentElement.classList.remove("first-view");
      if (state.isComplete) this.#baked.handOver(() => playback.timeSeconds);
    }
    this.#overlays.show(playback, followSeconds);
    this.#capture.afterDraw();
  }
}
