import { type Avatar, Motion } from "dynaskin";
import { describeActors } from "./about.js";
import { type ActorKind, actorLabel } from "./actors.js";
import { ByHand, type Playable } from "./by-hand.js";
import { Capture } from "./capture.js";
import type { Cast } from "./cast.js";
import { codeFor } from "./code.js";
import { Comparison } from "./comparison.js";
import { bindDialogs } from "./dialogs.js";
import { byId } from "./dom.js";
import { Handles } from "./handles.js";
import { Hud } from "./hud.js";
import { drawLegend, HEAT_SCALES } from "./legend.js";
import { Loader } from "./loader.js";
import type { LoadingBar } from "./loading.js";
import { Panel, regionLabel } from "./panel.js";
import { Playback } from "./playing.js";
import { Program } from "./program.js";
import { showFileProblem, showFileReport } from "./report.js";
import { DEFAULTS, type Settings, writeSettings } from "./settings.js";
import { Stage } from "./stage.js";
import { showError, showNote } from "./toast.js";
import type { View } from "./view.js";
import { Wipe } from "./wipe.js";

/** Share of the way to the body that the camera covers per second, as a rate. */
const FOLLOW_PER_SECOND = 5;
/** Largest file that is read into memory, in bytes. */
const MAX_FILE_BYTES = 64e6;
/** How long the camera must stand still before it is put into the page's address. */
const CAMERA_RESTS_MS = 400;

/** The page: one or two actors, what they play, and the controls. */
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
  #cast: Cast | null = null;
  #playback: Playback | null = null;
  /** Whether the motion is to be made anew before the next picture. */
  #motionIsStale = false;
  #lastFrame: number | null = null;
  #cameraMoved = { place: "", atMs: 0 };
  #failed = false;
  /** Whether the picture is no longer what the settings say; a paused page draws only then. */
  #stale = true;

  constructor(settings: Settings, view: View, loading: LoadingBar) {
    this.settings = settings;
    this.#view = view;
    this.#program = new Program(settings);
    this.stage = new Stage(settings, this.#program);
    this.#loader = new Loader(settings, this.#program, view, loading, {
      shown: () => this.#cast,
      show: (cast) => this.#show(cast),
      restored: () => this.#changed(() => this.#showSettings()),
      downloaded: (megabytes) => this.hud.setFact("downloaded", `${megabytes.toFixed(2)} MB`),
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
    });
    this.#panel = new Panel(settings, {
      setSex: () => this.#setSex(),
      setShape: () => this.#setShape(),
      setMotion: () => this.#setMotion(),
      setMotionOptions: () => this.#changed(() => this.#remakeMotion()),
      setDynamics: () => this.#changed(() => this.#retune()),
      setHeat: () => this.#changed(() => this.#showHeat()),
      setHud: () => this.#changed(() => {}),
      setSpeed: () => this.#changed(() => this.#applySpeed()),
      setPaused: () => this.#changed(() => this.#applySpeed()),
      setStrength: (strength) => {
        this.stage.tuning.strength = strength;
        this.#retune();
      },
      setRegionGain: (region, gain) => {
        this.stage.tuning.gains.set(region, gain);
        this.#retune();
      },
      stepFrame: () => this.#changed(() => this.#play((playback) => playback.step())),
      seek: (timeSeconds) =>
        this.#changed(() => this.#play((playback) => playback.seek(timeSeconds))),
      resetView: () => view.camera.reset(),
      copyHud: () => this.#copyHud(),
      hold: (side) => this.#wipe.hold(side),
      focusBody: () => {
        this.#showHandles();
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
    this.#capture = new Capture(view, () => this.draw(0));
    bindDialogs(() => codeFor(settings, this.stage.tuning, this.#program.played));
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

  /** The body on the screen with its networks, once it is there. */
  get cast(): Cast | null {
    return this.#cast;
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

  /** Plays a BVH file; one that cannot be played is explained, and what played goes on. */
  async openFile(file: File): Promise<void> {
    try {
      if (file.size > MAX_FILE_BYTES) {
        throw new Error(`It has ${(file.size / 1e6).toFixed(0)} MB; the page reads up to 64 MB.`);
      }
      const bytes = new Uint8Array(await file.arrayBuffer());
      if (!this.#playback)
        throw new Error("The body is still being loaded. Try again in a moment.");
      const motion = Motion.fromBvh(bytes, this.#playback.avatar);
      this.#playback.setMotion(motion);
      this.#program.setFile({ name: file.name, bytes });
      this.#motionIsStale = false;
      this.#stale = true;
      this.#panel.showPlaying(file.name);
      showFileReport(file.name, motion);
      this.#leaveClip();
      this.#announce();
    } catch (error) {
      showFileProblem(file.name, error);
      showError(`${file.name} cannot be played`, error);
    }
  }

  /** Where no clip plays there is no ground truth to show. */
  #leaveClip(): void {
    const { settings } = this;
    if (settings.clip === null && !this.#program.truth) return;
    settings.clip = null;
    if (settings.left === "truth") settings.left = DEFAULTS.left;
    if (settings.right === "truth") settings.right = DEFAULTS.right;
    settings.heatOf = DEFAULTS.heatOf;
    this.#comparison.show();
    this.#changed(() => void this.#loader.recast());
  }

  /** Makes the motion anew if a control asked for that; sliders ask more often than pictures. */
  applyChanges(): void {
    if (!this.#motionIsStale) return;
    this.#motionIsStale = false;
    try {
      const playback = this.#playback;
      playback?.setAvatars(playback.avatars, this.#program.makeMotion(playback.avatar));
    } catch (error) {
      showError("That did not work", error);
    }
  }

  /** Shows the settings' actors of a cast; the present ones stay if the motion does not suit them. */
  #show(cast: Cast): void {
    this.#stale = true;
    const { compare, left, right } = this.settings;
    const before = this.#playback?.avatars ?? [];
    const kinds: ActorKind[] = compare && this.#playback ? [right, left] : [right];
    const made = this.stage.createAvatars(cast, kinds);
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
    if (cast.body !== this.#cast?.body) this.#view.setBody(cast.body);
    for (const avatar of before) avatar.dispose();
    if (cast !== this.#cast) this.#cast?.dispose();
    this.#cast = cast;
    this.#loader.remember();
    this.#wipe.setNames(actorLabel(left), actorLabel(right));
    this.#wipe.setOn(kinds.length === 2);
    this.#applySpeed();
    this.#showHeat();
    this.#describe();
    this.hud.clear();
    this.#announce();
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
      showFileProblem(refused?.name ?? "", error);
      showError(`${refused?.name} cannot be played to its end`, error);
    }
  }

  #setSex(): void {
    const { settings } = this;
    settings.clip = null;
    settings.left = DEFAULTS.left;
    settings.right = DEFAULTS.right;
    this.#comparison.show();
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
        if (!settings.compare) Object.assign(settings, { compare: true, left: "truth" });
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
    const { compare, left, right, region } = this.settings;
    const kinds = compare ? [right, left] : [right];
    const bundleOf = (kind: ActorKind) => this.#cast?.bundleOf(kind) ?? null;
    const truth = this.#program.truth;
    describeActors(
      kinds.map((kind) => ({ kind, bundle: bundleOf(kind) })),
      truth?.simulatorMethod ?? null,
    );
    const leftName = compare ? actorLabel(left) : null;
    this.stage.traces.describe(regionLabel(region), leftName, actorLabel(right), truth !== null);
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
    history.replaceState(null, "", `${location.pathname}${writeSettings(this.settings)}`);
  }

  #announce(): void {
    byId("now-playing").textContent = `${this.#program.label} · ${this.#cast?.sex} body`;
  }

  async #copyHud(): Promise<void> {
    await navigator.clipboard.writeText(this.hud.text);
    showNote("Copied", "The timings are on the clipboard as text.");
  }

  #frame(now: number): void {
    requestAnimationFrame((next) => this.#frame(next));
    const elapsed = this.#lastFrame === null ? 0 : now - this.#lastFrame;
    this.#lastFrame = now;
    if (document.hidden || this.#failed) return;
    this.hud.show(now);
    this.stage.traces.show(now);
    this.#rememberCamera(now);
    if (this.#playback?.paused && !this.#stale && !this.#view.isStale) return;
    if (elapsed > 0) this.hud.addInterval(elapsed);
    try {
      this.draw(elapsed / 1000);
    } catch (error) {
      this.#failed = true;
      showError("The picture stopped; reload the page to start again", error);
    }
  }

  #showHandles(): void {
    const motion = this.#playback?.motion;
    this.#handles.attach(motion instanceof ByHand ? motion : null);
    this.#handles.show();
  }

  #rememberCamera(nowMs: number): void {
    const { place } = this.#view.camera;
    const text = `${place}`;
    if (text !== this.#cameraMoved.place) this.#cameraMoved = { place: text, atMs: nowMs };
    const rests = nowMs - this.#cameraMoved.atMs > CAMERA_RESTS_MS;
    if (rests && text !== `${this.settings.camera}`) {
      this.#changed(() => {
        this.settings.camera = place;
      });
    }
  }

  /** Advances by `elapsedSeconds` of real time and draws. */
  draw(elapsedSeconds: number): void {
    this.#stale = false;
    this.applyChanges();
    const playback = this.#playback;
    if (playback) {
      this.#play(() => playback.frame(elapsedSeconds));
      if (!playback.paused) this.hud.addStep(playback.avatar);
      // A hand pulls the body against a camera that stands still.
      const [x = 0, , z = 0] = playback.motion instanceof ByHand ? [] : playback.pose;
      // A jump in time takes the camera along.
      const share = elapsedSeconds === 0 ? 1 : 1 - Math.exp(-FOLLOW_PER_SECOND * elapsedSeconds);
      this.#view.camera.follow(x, z, share);
      this.hud.timed("upload", () => {
        const [right, left] = this.stage.appearances(playback.avatars);
        if (right) this.#view.upload(right, left ?? null);
      });
      this.#panel.showTime(playback.timeSeconds, playback.motion.durationSeconds);
    }
    this.hud.timed("render", () => this.#view.draw());
    this.#showHandles();
    this.#capture.afterDraw();
  }
}
