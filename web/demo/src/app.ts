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

/** The page: one avatar, what it plays, and the controls. */
export class App {
  readonly settings: Settings;
  readonly hud = new Hud();
  readonly #loading: LoadingBar;
  readonly #view: View;
  readonly #panel: Panel;
  #body: Body | null = null;
  #model: Model | null = null;
  #avatar: Avatar | null = null;
  #playback: Playback | null = null;
  /** The file that plays, to carry its motion over to another body. */
  #file: { name: string; bytes: Uint8Array } | null = null;
  #strength = 1;
  readonly #gains = new Map<RegionName, number>();
  #loads = 0;
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
      setMotionOptions: () => this.#setMotion(),
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
      stepFrame: () => this.#changed(() => this.#playback?.step()),
      seek: (timeSeconds) => this.#changed(() => this.#playback?.seek(timeSeconds)),
      resetView: () => view.camera.reset(),
      copyHud: () => this.#copyHud(),
    });
    this.#panel.showMotionOptions(findMotion(settings.motion));
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
   * Loads the model of the settings. Its body appears with plain skinning as soon as it is there;
   * the networks follow. What played before goes on until then, and stays if the load fails.
   */
  async loadModel(): Promise<void> {
    this.#loads += 1;
    const mine = this.#loads;
    const { sex } = this.settings;
    const stale = () => mine !== this.#loads;
    this.#loading.start("Loading the body");
    const model = await load({
      model: new URL(`${sex}/`, document.baseURI),
      onProgress: ({ loadedBytes, totalBytes }) => {
        if (!stale()) this.#loading.report("model", loadedBytes, totalBytes);
      },
      onBody: (body) => {
        if (stale()) return;
        this.#loading.say("Loading the networks");
        this.#show(body, body.createAvatar({ shape: this.settings.shape }));
      },
    });
    if (stale()) {
      model.dispose();
      return;
    }
    this.#model?.dispose();
    this.#model = model;
    this.#show(model.body, model.createAvatar({ shape: this.settings.shape }));
    this.#loading.finish();
    this.hud.setFact("downloaded", `${this.#loading.loadedMegabytes.toFixed(2)} MB`);
    describeModel(model.bundle);
  }

  /** Plays a BVH file; one that cannot be played is explained, and what played goes on. */
  async openFile(file: File): Promise<void> {
    try {
      if (file.size > MAX_FILE_BYTES) {
        throw new Error(`It has ${(file.size / 1e6).toFixed(0)} MB; the page reads up to 64 MB.`);
      }
      if (!this.#avatar) throw new Error("The body is still being loaded. Try again in a moment.");
      const bytes = new Uint8Array(await file.arrayBuffer());
      const motion = Motion.fromBvh(bytes, this.#avatar);
      this.#file = { name: file.name, bytes };
      this.#playback?.setMotion(motion);
      this.#stale = true;
      this.#panel.addFileMotion(file.name);
      showFileReport(file.name, motion);
      this.#announce();
    } catch (error) {
      showFileProblem(file.name, error);
      showError(`${file.name} cannot be played`, error);
    }
  }

  #show(body: Body, avatar: Avatar): void {
    this.#stale = true;
    const motion = this.#makeMotion(avatar);
    if (body !== this.#body) this.#view.setBody(body);
    const before = this.#avatar;
    this.#body = body;
    this.#avatar = avatar;
    this.#tune(avatar);
    if (this.#playback) this.#playback.setAvatar(avatar, motion);
    else this.#playback = new Playback(avatar, motion);
    before?.dispose();
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

  #setSex(): void {
    this.#changed(() => {
      this.loadModel().catch((error) => {
        this.#loading.finish();
        showError("The model could not be loaded", error);
      });
    });
  }

  #setShape(): void {
    this.#changed(() =>
      this.#withAvatar((avatar) => {
        avatar.setShape(this.settings.shape);
        // Longer legs take other steps.
        this.#playback?.setAvatar(avatar, this.#makeMotion(avatar));
      }),
    );
  }

  #setMotion(): void {
    this.#changed(() =>
      this.#withAvatar((avatar) => {
        this.#file = null;
        byId("file-report").hidden = true;
        this.#playback?.setMotion(this.#makeMotion(avatar));
        this.#panel.showMotionOptions(findMotion(this.settings.motion));
        this.#announce();
      }),
    );
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
    if (this.#playback?.paused) this.#playback.refresh();
  }

  #announce(): void {
    const what = this.#file?.name ?? findMotion(this.settings.motion).label;
    byId("now-playing").textContent = `${what} · ${this.settings.sex} body`;
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
    const playback = this.#playback;
    if (playback) {
      playback.frame(elapsedSeconds);
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
