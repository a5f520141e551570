import { type Avatar, type Body, load, type Model, Motion, type RegionName } from "dynaskin";
import { describeModel } from "./about.js";
import { byId } from "./dom.js";
import { Hud } from "./hud.js";
import type { LoadingBar } from "./loading.js";
import { findMotion, motionOptions } from "./motions.js";
import { Panel } from "./panel.js";
import { Playback } from "./playing.js";
import { showFileProblem, showFileReport } from "./report.js";
import { type Settings, writeSettings } from "./settings.js";
import { showError, showNote } from "./toast.js";
import type { View } from "./view.js";

/** Share of the way to the body that the camera covers per second, as a rate. */
const FOLLOW_PER_SECOND = 5;
/** Largest file that is read into memory, in bytes. */
const MAX_FILE_BYTES = 64e6;

/** A motion file's name and content, to make its motion again for another body or shape. */
interface MotionFile {
  name: string;
  bytes: Uint8Array;
}

/** The page: one avatar, what it plays, and the controls. */
export class App {
  readonly settings: Settings;
  readonly hud = new Hud();
  readonly #loading: LoadingBar;
  readonly #view: View;
  readonly #panel: Panel;
  #body: Body | null = null;
  /** Which body is shown; the settings say which is wanted. */
  #sex: Settings["sex"] | null = null;
  #model: Model | null = null;
  #avatar: Avatar | null = null;
  #playback: Playback | null = null;
  /** The file that plays; null: the motion of the settings. */
  #file: MotionFile | null = null;
  /** What played before the file, to go back to if the avatar refuses one of its poses. */
  #fileBefore: MotionFile | null = null;
  /** Whether the motion is to be made anew before the next picture. */
  #motionIsStale = false;
  #strength = 1;
  readonly #gains = new Map<RegionName, number>();
  /** Stops the latest download of a model. */
  #download: AbortController | null = null;
  #lastFrame: number | null = null;
  #failed = false;
  /** Whether the picture is no longer what the settings say; a paused page draws only then. */
  #stale = true;

  constructor(settings: Settings, view: View, loading: LoadingBar) {
    this.settings = settings;
    this.#view = view;
    this.#loading = loading;
    view.setHeat(settings.heat);
    this.hud.setFact("graphics", view.renderer.backend);
    this.hud.setFact("adapter", view.renderer.adapter);
    this.#panel = new Panel(settings, {
      setSex: () => this.#setSex(),
      setShape: () => this.#setShape(),
      setMotion: () => this.#setMotion(),
      setMotionOptions: () => this.#changed(() => this.#remakeMotion()),
      setDynamics: () => this.#setDynamics(),
      setHeat: () => this.#changed(() => view.setHeat(settings.heat)),
      setHud: () => this.#changed(() => {}),
      setSpeed: () => this.#changed(() => this.#applySpeed()),
      setPaused: () => this.#changed(() => this.#applySpeed()),
      setStrength: (strength) => {
        this.#strength = strength;
        this.#withAvatar(() => {});
      },
      setRegionGain: (region, gain) => {
        this.#gains.set(region, gain);
        this.#withAvatar(() => {});
      },
      stepFrame: () => this.#changed(() => this.#play((playback) => playback.step())),
      seek: (timeSeconds) =>
        this.#changed(() => this.#play((playback) => playback.seek(timeSeconds))),
      resetView: () => view.camera.reset(),
      copyHud: () => this.#copyHud(),
    });
    document.addEventListener("visibilitychange", () => {
      this.#lastFrame = null;
    });
    requestAnimationFrame((now) => this.#frame(now));
  }

  /** What plays, once the body is there. */
  get playback(): Playback | null {
    return this.#playback;
  }

  /** The model with its networks, once they are there. */
  get model(): Model | null {
    return this.#model;
  }

  /**
   * Loads the model of the settings. The first body appears with plain skinning as soon as it is
   * there, and its networks follow; later, what plays goes on until all of the next model is there.
   * A failure is explained, and leaves what plays as it was.
   */
  async openModel(): Promise<void> {
    this.#download?.abort();
    const download = new AbortController();
    this.#download = download;
    const { sex } = this.settings;
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
    const model = await load({
      model: new URL(`${sex}/`, document.baseURI),
      signal,
      onProgress: ({ loadedBytes, totalBytes }) => {
        if (!signal.aborted) this.#loading.report("model", loadedBytes, totalBytes);
      },
      onBody: (body) => {
        if (signal.aborted || this.#playback) return;
        this.#loading.say("Loading the networks");
        this.#show(sex, body, body.createAvatar({ shape: this.settings.shape }));
      },
    });
    try {
      signal.throwIfAborted();
      this.#show(sex, model.body, model.createAvatar({ shape: this.settings.shape }));
    } catch (error) {
      model.dispose();
      throw error;
    }
    this.#model?.dispose();
    this.#model = model;
    this.hud.setFact("downloaded", `${this.#loading.loadedMegabytes.toFixed(2)} MB`);
    describeModel(model.bundle);
  }

  #explainLoad(sex: Settings["sex"], error: unknown): void {
    if (this.#sex === null) {
      showError("The page could not start", error);
      return;
    }
    const what = this.#sex === sex && !this.#model ? `networks of the ${sex} body` : `${sex} body`;
    showError(`The ${what} could not be loaded`, error);
    this.settings.sex = this.#sex;
    this.#changed(() => this.#panel.show());
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
      this.#fileBefore = this.#file;
      this.#file = { name: file.name, bytes };
      this.#motionIsStale = false;
      this.#stale = true;
      this.#panel.showPlaying(file.name);
      showFileReport(file.name, motion);
      this.#announce();
    } catch (error) {
      showFileProblem(file.name, error);
      showError(`${file.name} cannot be played`, error);
    }
  }

  /** Makes the motion anew if a control asked for that; sliders ask more often than pictures. */
  applyChanges(): void {
    if (!this.#motionIsStale) return;
    this.#motionIsStale = false;
    try {
      const playback = this.#playback;
      playback?.setAvatar(playback.avatar, this.#makeMotion(playback.avatar));
    } catch (error) {
      showError("That did not work", error);
    }
  }

  /** Shows an avatar instead of the present one, which stays if the motion does not suit it. */
  #show(sex: Settings["sex"], body: Body, avatar: Avatar): void {
    this.#stale = true;
    try {
      this.#tune(avatar);
      const motion = this.#playback ? this.#makeMotion(avatar) : this.#makeFirstMotion(avatar);
      if (this.#playback) this.#playback.setAvatar(avatar, motion);
      else this.#playback = new Playback(avatar, motion);
    } catch (error) {
      avatar.dispose();
      throw error;
    }
    this.#motionIsStale = false;
    if (body !== this.#body) this.#view.setBody(body);
    this.#avatar?.dispose();
    this.#body = body;
    this.#sex = sex;
    this.#avatar = avatar;
    this.#applySpeed();
    this.hud.clear();
    this.#announce();
  }

  #makeMotion(avatar: Avatar): Motion {
    if (this.#file) return Motion.fromBvh(this.#file.bytes, avatar);
    const { motion, tempoHz, heightM } = this.settings;
    const choice = findMotion(motion);
    return Motion.procedural(choice.name, avatar, motionOptions(choice, tempoHz, heightM));
  }

  /** The link's motion; at its usual tempo and height, where the link's do not go together. */
  #makeFirstMotion(avatar: Avatar): Motion {
    try {
      return this.#makeMotion(avatar);
    } catch (error) {
      this.settings.tempoHz = null;
      this.settings.heightM = null;
      const motion = this.#makeMotion(avatar);
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
      const refused = this.#file;
      if (!refused) throw error;
      this.#file = this.#fileBefore;
      this.#fileBefore = null;
      this.#playback.setMotion(this.#makeMotion(this.#playback.avatar));
      this.#panel.showPlaying(this.#file?.name ?? null);
      this.#announce();
      showFileProblem(refused.name, error);
      showError(`${refused.name} cannot be played to its end`, error);
    }
  }

  #setSex(): void {
    this.#changed(() => void this.openModel());
  }

  #setShape(): void {
    this.#changed(() => {
      this.#avatar?.setShape(this.settings.shape);
      // Longer legs take other steps.
      this.#remakeMotion();
    });
  }

  #setMotion(): void {
    this.#changed(() => {
      this.#file = null;
      this.#fileBefore = null;
      byId("file-report").hidden = true;
      this.#panel.showPlaying(null);
      this.#playback?.setMotion(this.#makeMotion(this.#playback.avatar));
      this.#motionIsStale = false;
      this.#announce();
    });
  }

  #remakeMotion(): void {
    this.#motionIsStale = true;
  }

  #setDynamics(): void {
    this.#changed(() => this.#withAvatar(() => {}));
  }

  /** Gives an avatar the settings that are its own. */
  #tune(avatar: Avatar): void {
    // The networks run on, so that both states of the same moment can be compared.
    avatar.strength = this.settings.dynamics ? this.#strength : 0;
    for (const [region, gain] of this.#gains) avatar.setRegionGain(region, gain);
  }

  #applySpeed(): void {
    if (!this.#playback) return;
    this.#playback.speed = this.settings.speed;
    this.#playback.paused = this.settings.paused;
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

  #withAvatar(work: (avatar: Avatar) => void): void {
    this.#stale = true;
    if (!this.#avatar) return;
    work(this.#avatar);
    this.#tune(this.#avatar);
    if (this.#playback?.paused) this.#play((playback) => playback.refresh());
  }

  #announce(): void {
    const what = this.#file?.name ?? findMotion(this.settings.motion).label;
    byId("now-playing").textContent = `${what} · ${this.#sex} body`;
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
    if (this.#playback?.paused && !this.#stale && !this.#view.isStale) return;
    if (elapsed > 0) this.hud.addInterval(elapsed);
    try {
      this.draw(elapsed / 1000);
    } catch (error) {
      this.#failed = true;
      showError("The picture stopped; reload the page to start again", error);
    }
  }

  /** Advances by `elapsedSeconds` of real time and draws. */
  draw(elapsedSeconds: number): void {
    this.#stale = false;
    this.applyChanges();
    const playback = this.#playback;
    if (playback) {
      this.#play(() => playback.frame(elapsedSeconds));
      this.#addTimings(playback.avatar);
      const [x = 0, , z = 0] = playback.pose;
      // A jump in time takes the camera along.
      const share = elapsedSeconds === 0 ? 1 : 1 - Math.exp(-FOLLOW_PER_SECOND * elapsedSeconds);
      this.#view.camera.follow(x, z, share);
      this.#timed("upload", () => this.#view.upload(playback.avatar));
      this.#panel.showTime(playback.timeSeconds, playback.motion.durationSeconds);
    }
    this.#timed("render", () => this.#view.draw());
  }

  #addTimings(avatar: Avatar): void {
    if (this.#playback?.paused || !avatar.dynamics) return;
    const { featuresMs, predictMs, decodeMs, applyMs, ticks } = avatar.timings;
    if (ticks === 0) return;
    this.hud.add("features", featuresMs);
    this.hud.add("predict", predictMs);
    this.hud.add("decode", decodeMs);
    this.hud.add("apply", applyMs);
  }

  #timed(stage: "upload" | "render", work: () => void): void {
    const start = performance.now();
    work();
    this.hud.add(stage, performance.now() - start);
  }
}
