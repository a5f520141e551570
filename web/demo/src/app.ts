import { type Avatar, Motion } from "dynaskin";
import { describeActors } from "./about.js";
import { actorLabel, nameOf } from "./actors.js";
import { Address } from "./address.js";
import { BenchmarkDialog } from "./benchmark-dialog.js";
import { ByHand, type Playable } from "./by-hand.js";
import { describeDifference } from "./caption.js";
import { Capture } from "./capture.js";
import type { Cast } from "./cast.js";
import { copyText } from "./clipboard.js";
import { codeFor } from "./code.js";
import { Comparison } from "./comparison.js";
import { bindDialogs } from "./dialogs.js";
import { byId } from "./dom.js";
import { Handles } from "./handles.js";
import { Hud } from "./hud.js";
import { jointNames } from "./joint-names.js";
import { drawLegend, HEAT_SCALES } from "./legend.js";
import { addTruth, replaceMissing, type Shown, shownActors } from "./lineup.js";
import { Loader } from "./loader.js";
import type { LoadingBar } from "./loading.js";
import { Names } from "./names.js";
import { narrowScreen } from "./narrow.js";
import { Panel } from "./panel.js";
import { Playback } from "./playing.js";
import { Program } from "./program.js";
import { showFileProblem, showFileReport } from "./report.js";
import { DEFAULTS, type Settings } from "./settings.js";
import { Stage } from "./stage.js";
import { regionLabel } from "./tissue-panel.js";
import { showError } from "./toast.js";
import { clipNamesOf } from "./truth.js";
import type { View } from "./view.js";
import { Wipe } from "./wipe.js";

/** Largest file that is read into memory, in bytes. */
const MAX_FILE_BYTES = 64e6;

/** What a body takes of the picture, in CSS pixels from its top left corner. */
export interface Extent {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

/** The page: the actors, what they play, and the controls. */
export class App {
  readonly settings: Settings;
  readonly hud = new Hud();
  readonly stage: Stage;
  readonly #loader: Loader;
  readonly #view: View;
  readonly #program: Program;
  readonly #panel: Panel;
  readonly #comparison: Comparison;
  readonly #wipe: Wipe;
  readonly #capture: Capture;
  readonly #handles: Handles;
  readonly #names: Names;
  /** The moment to begin at; null once it has begun, or from the motion's beginning. */
  #startSeconds: number | null;
  #cast: Cast | null = null;
  /** The actors on the screen, one for each avatar. */
  #shown: readonly Shown[] = [];
  #playback: Playback | null = null;
  /** Whether the motion is to be made anew before the next picture. */
  #motionIsStale = false;
  /** The moment to jump to before the next picture; null: none. */
  #seekSeconds: number | null = null;
  /** Whether the body may be somewhere else than in the picture before, and the camera goes there at once. */
  #jumped = false;
  #isComplete = false;
  /** Whose key or name is held down. */
  #held: Shown["slot"] | null = null;
  #lastFrame: number | null = null;
  #failed = false;
  readonly #address: Address;
  /** Whether nothing is drawn, because something else is being measured. */
  #still = false;
  /** Whether the picture is no longer what the settings say; a paused page draws only then. */
  #stale = true;

  constructor(settings: Settings, view: View, loading: LoadingBar) {
    this.settings = settings;
    this.#startSeconds = settings.timeSeconds;
    this.#view = view;
    this.#address = new Address(settings, view.camera);
    this.#program = new Program(settings);
    this.stage = new Stage(settings, this.#program);
    this.#loader = new Loader(settings, this.#program, view, loading, {
      shown: () => this.#cast,
      show: (cast) => this.#show(cast),
      restored: () => this.#changed(() => this.#showSettings()),
    });
    if (settings.camera) view.camera.place = settings.camera;
    this.hud.setFact("graphics", view.renderer.backend);
    this.hud.setFact("adapter", view.renderer.adapter);
    this.#wipe = new Wipe(settings.split, {
      setLeftShare: (share) => {
        this.#stale = true;
        view.setLeftShare(share);
      },
      setSplit: (split) =>
        this.#changed(() => {
          settings.split = split;
        }),
      hold: (side) => this.#hold(side),
    });
    this.#panel = new Panel(settings, {
      setSex: () => this.#setSex(),
      setShape: () => this.#setShape(),
      setMotion: () => this.#setMotion(),
      setMotionOptions: () => this.#changed(() => this.#remakeMotion()),
      setDynamics: () => this.#changed(() => this.#retune()),
      setHeat: () => this.#changed(() => this.#showHeat()),
      setHud: () => this.#changed(() => this.#describe()),
      setSpeed: () => this.#changed(() => this.#applySpeed()),
      setPaused: () => this.#changed(() => this.#applySpeed()),
      setTuning: () => this.#changed(() => this.#retune()),
      stepFrame: () => {
        this.applyChanges();
        this.#changed(() => this.#play((playback) => playback.step()));
      },
      seek: (timeSeconds) => {
        this.#seekSeconds = timeSeconds;
        this.#stale = true;
      },
      resetView: () => view.camera.reset(),
      copyHud: () => void copyText(this.hud.text, "The timings are on the clipboard as text."),
      hold: (side) => this.#hold(side),
      nextLayout: () => this.#comparison.nextLayout(),
      focusBody: () => {
        this.#showHandles(0);
        this.#handles.focus();
      },
    });
    this.#comparison = new Comparison(settings, {
      setActors: () => this.#changed(() => void this.#loader.recast()),
      setClothes: () => this.#changed(() => this.#retune()),
      setHeatOf: () => this.#changed(() => this.#showHeat()),
      setPlots: () => this.#changed(() => this.#showPlots()),
    });
    this.#handles = new Handles(view, () => this.#wake());
    // An actor that is alone is held to see it without its tissue.
    this.#names = new Names(view, (slot) =>
      this.#hold(slot && settings.layout === "one" ? "left" : slot),
    );
    addEventListener("blur", () => this.#hold(null));
    byId("caption-close").addEventListener("click", () =>
      this.#changed(() => {
        settings.caption = false;
        this.#describe();
      }),
    );
    narrowScreen.addEventListener("change", () => {
      this.#comparison.show();
      void this.#loader.recast();
    });
    this.#capture = new Capture(view, () => this.draw(0));
    bindDialogs(() => codeFor(settings, this.#program.played, this.mainAvatar?.controls ?? null));
    new BenchmarkDialog({
      cast: () => this.#cast,
      setStill: (still) => {
        this.#still = still;
        this.#lastFrame = null;
      },
    });
    this.#showHeat();
    document.addEventListener("visibilitychange", () => {
      this.#lastFrame = null;
    });
    requestAnimationFrame((now) => this.#frame(now));
  }

  /** What plays, once the body is there. */
  get playback(): Playback | null {
    return this.#playback;
  }

  /** The avatar that the panel's timings and the program are about: dynaskin's, unless chosen otherwise. */
  get mainAvatar(): Avatar | null {
    return this.avatarAt("right");
  }

  /** The avatar at a place of the settings; null where nobody stands there. */
  avatarAt(slot: Shown["slot"]): Avatar | null {
    const idx = this.#shown.findIndex((actor) => actor.slot === slot);
    return this.#playback?.avatars[idx] ?? null;
  }

  /** The body on the screen with its networks, once it is there. */
  get cast(): Cast | null {
    return this.#cast;
  }

  /** Whether the actors, networks and clip that the settings asked for at the start are on the screen. */
  get isComplete(): boolean {
    return this.#isComplete;
  }

  /** Where the bodies are in the picture, as they were last stepped. */
  get bodiesPx(): Extent[] {
    const avatars = this.#playback?.avatars ?? [];
    const places = this.stage.placesM(avatars.length);
    return avatars.map((avatar, idx) => {
      const { positions } = avatar.skinned();
      const [asideM, aheadM] = places[idx] ?? [0, 0];
      const [xs, ys]: [number[], number[]] = [[], []];
      for (let at = 0; at < positions.length; at += 3) {
        const [x = 0, y = 0, z = 0] = positions.subarray(at, at + 3);
        const { xPx, yPx } = this.#view.project([x + asideM, y, z + aheadM]);
        xs.push(xPx);
        ys.push(yPx);
      }
      const [left, right] = [Math.min(...xs), Math.max(...xs)];
      return { left, right, top: Math.min(...ys), bottom: Math.max(...ys) };
    });
  }

  /** Loads the model of the settings; see {@link Loader.openModel}. */
  openModel(): Promise<void> {
    return this.#loader.openModel();
  }

  #showSettings(): void {
    this.#panel.show();
    this.#panel.showPlaying(this.#program.file?.name ?? null);
    this.#comparison.show();
  }

  /** Plays a motion file; one that cannot be played is explained, and what played goes on. */
  async openFile(file: File): Promise<void> {
    try {
      if (file.size > MAX_FILE_BYTES) {
        throw new Error(`It has ${(file.size / 1e6).toFixed(0)} MB; the page reads up to 64 MB.`);
      }
      const bytes = new Uint8Array(await file.arrayBuffer());
      if (!this.#playback)
        throw new Error("The body is still being loaded. Try again in a moment.");
      const motion = Motion.fromFile(bytes, this.#playback.avatar);
      this.#playback.setMotion(motion);
      this.#program.setFile({ name: file.name, bytes });
      this.#motionIsStale = false;
      this.#stale = true;
      this.#panel.showPlaying(file.name);
      showFileReport(file.name, motion);
      this.#leaveClip();
      this.#announce();
    } catch (error) {
      showFileProblem(file.name, error, await jointNames(file));
      showError(`${file.name} cannot be played`, error);
    }
  }

  /** Where no clip plays there is no ground truth to show. */
  #leaveClip(): void {
    const { settings } = this;
    if (settings.clip === null && !this.#program.truth) return;
    settings.clip = null;
    replaceMissing(settings);
    settings.heatOf = DEFAULTS.heatOf;
    this.#comparison.show();
    this.#changed(() => void this.#loader.recast());
  }

  /** Makes the motion anew and jumps, if controls asked for that: sliders ask more often than pictures. */
  applyChanges(): void {
    const seconds = this.#seekSeconds;
    this.#seekSeconds = null;
    if (this.#motionIsStale) {
      this.#motionIsStale = false;
      this.#changed(() => {
        const playback = this.#playback;
        playback?.setAvatars(playback.avatars, this.#program.makeMotion(playback.avatar));
      });
    }
    if (seconds !== null) {
      this.#jumped = true;
      this.#changed(() => this.#play((playback) => playback.seek(seconds)));
    }
  }

  /** Shows the settings' actors of a cast; the present ones stay if the motion does not suit them. */
  #show(cast: Cast): void {
    this.#stale = true;
    this.#jumped = true;
    this.#hold(null);
    const { layout } = this.settings;
    const before = this.#playback?.avatars ?? [];
    const all = shownActors(this.settings);
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
    this.#motionIsStale = false;
    this.#shown = shown;
    this.#view.setBodies(cast.body, this.#bodyCount);
    for (const avatar of before) avatar.dispose();
    if (cast !== this.#cast) this.#cast?.dispose();
    this.#cast = cast;
    this.#loader.remember(cast.sex);
    this.#wipe.setOn(layout === "wipe" && shown.length === 2);
    this.#names.set(layout === "wipe" ? [] : shown);
    this.#showNames();
    const vertices = cast.body.vertexCount.toLocaleString("en");
    this.hud.setFact("vertices", shown.length > 1 ? `${shown.length} × ${vertices}` : vertices);
    this.#applySpeed();
    this.#showHeat();
    this.#describe();
    this.hud.clear();
    this.#announce();
    if (!cast.model) return;
    this.#isComplete = true;
    this.#goToStart();
  }

  /** Goes to the moment of the link once the networks are there. */
  #goToStart(): void {
    const timeSeconds = this.#startSeconds;
    this.#startSeconds = null;
    const end = this.#playback?.motion.durationSeconds ?? 0;
    if (timeSeconds === null || !Number.isFinite(end)) return;
    this.#play((playback) => playback.seek(Math.min(timeSeconds, end)));
  }

  /** The link's motion; at its usual tempo and height, where the link's do not go together. */
  #makeFirstMotion(avatar: Avatar): Playable {
    try {
      return this.#program.makeMotion(avatar);
    } catch (error) {
      this.settings.tempoHz = null;
      this.settings.heightM = null;
      const motion = this.#program.makeMotion(avatar);
      this.#changed(() => this.#panel.showPlaying(null));
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
      if (!this.#program.file) throw error;
      const refused = this.#program.refuseFile();
      this.#playback.setMotion(this.#program.makeMotion(this.#playback.avatar));
      this.#panel.showPlaying(this.#program.file?.name ?? null);
      this.#announce();
      showFileProblem(refused?.name ?? "", error, []);
      showError(`${refused?.name} cannot be played to its end`, error);
    }
  }

  #setSex(): void {
    const { settings } = this;
    if (settings.clip !== null && !clipNamesOf(settings.sex).includes(settings.clip)) {
      settings.clip = null;
    }
    replaceMissing(settings);
    this.#comparison.show();
    this.#panel.showPlaying(this.#program.file?.name ?? null);
    this.#changed(() => void this.#loader.openModel());
  }

  #setShape(): void {
    this.#changed(() => {
      for (const avatar of this.#playback?.avatars ?? []) avatar.setShape(this.settings.shape);
      // Longer legs take other steps.
      this.#remakeMotion();
    });
  }

  #setMotion(): void {
    this.#changed(() => {
      this.#program.clearFile();
      byId("file-report").hidden = true;
      this.#panel.showPlaying(null);
      const { settings } = this;
      if (settings.clip !== null) {
        addTruth(settings);
        this.#comparison.show();
        void this.#loader.recast();
        return;
      }
      this.#leaveClip();
      this.#playback?.setMotion(this.#program.makeMotion(this.#playback.avatar));
      this.#motionIsStale = false;
      this.#announce();
    });
  }

  #remakeMotion(): void {
    this.#motionIsStale = true;
  }

  /** Gives the actors what the sliders and switches say. */
  #retune(): void {
    this.#stale = true;
    for (const avatar of this.#playback?.avatars ?? []) this.stage.tune(avatar);
    if (this.#playback?.paused) this.#play((playback) => playback.refresh());
    this.#showNames();
  }

  /** Whether anything moves the skin of the actors that is not part of their motion. */
  get #isMoved(): boolean {
    return this.settings.dynamics && this.settings.strength > 0 && !this.stage.plain;
  }

  #showNames(): void {
    const { left, right } = this.settings;
    this.#names.label(this.#isMoved);
    this.#wipe.setNames(nameOf(left, this.#isMoved), nameOf(right, this.#isMoved));
  }

  /**
   * While something is held: under a divider and in a row, shows that actor alone; where there is only
   * one, the left one is its skin without tissue. Null: all as the settings say.
   */
  #hold(slot: Shown["slot"] | null): void {
    if (slot === this.#held) return;
    this.#held = slot;
    this.#stale = true;
    const { layout } = this.settings;
    this.#wipe.hold(slot === "left" || slot === "right" ? slot : null);
    const idx = this.#shown.findIndex((actor) => actor.slot === slot);
    this.stage.alone = layout === "side" && this.#shown.length > 1 && idx >= 0 ? idx : null;
    this.#names.setHeld(slot, this.stage.alone !== null);
    if (this.#cast) this.#view.setBodies(this.#cast.body, this.#bodyCount);
    const plain = layout === "one" && slot === "left";
    if (plain === this.stage.plain) return;
    this.stage.plain = plain;
    this.#retune();
  }

  /** How many bodies the picture has side by side. */
  get #bodyCount(): number {
    return this.settings.layout === "side" && this.stage.alone === null ? this.#shown.length : 1;
  }

  #showHeat(): void {
    const shown = this.stage.showsError ? "error" : "offset";
    drawLegend(shown);
    this.#comparison.show();
    this.#view.setHeat(this.settings.heat ? HEAT_SCALES[shown].rangeMm : null);
  }

  #showPlots(): void {
    this.#describe();
    // Fills the plots with the seconds before.
    this.#play((playback) => playback.seek(playback.timeSeconds));
  }

  #describe(): void {
    const shown = shownActors(this.settings);
    const truth = this.#program.truth;
    // dynaskin first, whatever stands beside it.
    const own = (kind: string) => (kind === "dynaskin" ? 0 : 1);
    describeActors(
      shown
        .toSorted((a, b) => own(a.kind) - own(b.kind))
        .map(({ kind }) => ({ kind, bundle: this.#cast?.bundleOf(kind) ?? null })),
      truth?.simulatorMethod ?? null,
    );
    this.stage.traces.describe(regionLabel(this.settings.region), shown, truth !== null);
    describeDifference(this.settings, shown, this.#cast?.bundleOf("dynaskin") ?? null);
  }

  #applySpeed(): void {
    if (!this.#playback) return;
    this.#playback.speed = this.settings.speed;
    this.#playback.paused = this.settings.paused;
  }

  /** Who takes hold of a body that stands still wants it to move. */
  #wake(): void {
    if (!this.settings.paused) return;
    this.#changed(() => {
      this.settings.paused = false;
      this.#panel.show();
      this.#applySpeed();
    });
  }

  /** Carries a change out and puts it into the page's address. */
  #changed(work: () => void): void {
    this.#stale = true;
    try {
      work();
    } catch (error) {
      showError("That did not work", error);
    }
    const playback = this.#playback;
    if (playback) {
      const stands = playback.paused && Number.isFinite(playback.motion.durationSeconds);
      this.settings.timeSeconds = stands ? playback.timeSeconds : null;
    }
    this.#address.write();
  }

  #announce(): void {
    const playing = `${this.#program.label} · ${this.#cast?.sex} body`;
    byId("now-playing").textContent = playing;
    const actors = this.#shown.map(({ kind }) => actorLabel(kind)).join(", ");
    byId("view").setAttribute(
      "aria-label",
      `${playing}, moved by: ${actors}. Drag or use the arrow keys to orbit, scroll, pinch or press plus ` +
        "and minus to zoom, double-click to reset the view.",
    );
  }

  #frame(now: number): void {
    requestAnimationFrame((next) => this.#frame(next));
    const elapsed = this.#lastFrame === null ? 0 : now - this.#lastFrame;
    this.#lastFrame = now;
    if (document.hidden || this.#failed || this.#still) return;
    this.hud.setFact("picture", this.#view.resolution);
    this.hud.show(now);
    this.stage.traces.show(now);
    this.#address.rememberCamera(now);
    if (this.#playback?.paused && !this.#stale && !this.#view.isStale) return;
    if (elapsed > 0) this.hud.addInterval(elapsed);
    try {
      this.draw(elapsed / 1000);
    } catch (error) {
      this.#failed = true;
      showError("The picture stopped; reload the page to start again", error);
    }
  }

  /** Puts what hangs on the bodies where they are in the picture. */
  #showHandles(elapsedSeconds: number): void {
    const motion = this.#playback?.motion;
    const places = this.stage.placesM(this.#shown.length);
    const main = Math.max(
      0,
      this.#shown.findIndex(({ slot }) => slot === "right"),
    );
    this.#handles.attach(motion instanceof ByHand ? motion : null);
    this.#handles.show(places[main] ?? [0, 0]);
    const crownsM = this.stage.crownsM(this.#playback?.avatars ?? []);
    this.#names.show(crownsM, places, elapsedSeconds);
  }

  /** Advances by `elapsedSeconds` of real time and draws. */
  draw(elapsedSeconds: number): void {
    this.applyChanges();
    this.#stale = false;
    // Where no frames follow, a camera on its way would stay there.
    const followSeconds = this.#jumped ? 0 : elapsedSeconds;
    this.#jumped = false;
    const playback = this.#playback;
    if (playback) {
      this.#play(() => playback.frame(elapsedSeconds));
      if (!playback.paused && this.mainAvatar) this.hud.addStep(this.mainAvatar);
      // A hand pulls the body against a camera that stands still.
      const [x = 0, , z = 0] = playback.motion instanceof ByHand ? [] : playback.pose;
      this.#view.camera.followBody(x, z, followSeconds);
      this.hud.timed("upload", () => {
        const looks = this.stage.appearances(playback.avatars);
        const divided = this.settings.layout === "wipe" && looks.length === 2;
        this.#view.upload(divided ? looks.slice(1) : looks, (divided && looks[0]) || null);
      });
      this.#panel.showTime(playback.timeSeconds, playback.motion.durationSeconds);
    }
    this.hud.timed("render", () => this.#view.draw());
    this.#showHandles(followSeconds);
    this.#capture.afterDraw();
  }
}
