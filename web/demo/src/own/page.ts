import { load, type Model } from "dynaskin";
import type { SkinnedMesh } from "three";
import { byId, create } from "../dom.js";
import type { BoundAvatar } from "./bound-avatar.js";
import { PlayPanel } from "./play-panel.js";
import { bindClicks, bindDivider } from "./pointer.js";
import { programFor } from "./program.js";
import type { ReadAvatar } from "./read-file.js";
import { reportElements, sentence } from "./report.js";
import type { Studio } from "./studio.js";
import { bindTaking } from "./take.js";

type Workshop = typeof import("./workshop.js");
type Sex = "female" | "male";

/** The page: opens a file, asks what only its owner knows, binds, and plays. */
export class OwnPage {
  readonly #adult = byId<HTMLInputElement>("own-adult");
  readonly #models = new Map<Sex, Promise<Model>>();
  readonly #panel: PlayPanel;
  #workshop: Promise<Workshop> | null = null;
  #studio: Studio | null = null;
  #file: File | null = null;
  #read: ReadAvatar | null = null;
  #bound: BoundAvatar | null = null;
  #working: AbortController | null = null;
  #movingAfterMs: number | null = null;
  /** While a file is read, answers are noted; what follows from them is done when it is there. */
  #isReading = false;

  constructor() {
    this.#panel = new PlayPanel(() => this.#showProgram());
    const answered = () => void this.#bind();
    this.#adult.addEventListener("change", answered);
    byId("own-build").addEventListener("change", answered);
    byId("own-stop").addEventListener("click", () => this.#stop());
    bindTaking(() => this.#file && this.#bound && { file: this.#file, bound: this.#bound });
    this.#sayWanting();
  }

  /** What plays, once it does. */
  get bound(): BoundAvatar | null {
    return this.#bound;
  }

  get studio(): Studio | null {
    return this.#studio;
  }

  /** From when all was known, the file and both answers, to the first picture that moves, milliseconds. */
  get movingAfterMs(): number | null {
    return this.#movingAfterMs;
  }

  /** Whether the page plays by itself. */
  setPlaying(isPlaying: boolean): void {
    this.#panel.setPlaying(isPlaying);
  }

  /** Opens an avatar, in the place of the last; `sex`, if it is known, answers for its build. */
  async open(file: File, sex?: Sex): Promise<void> {
    const startMs = performance.now();
    this.#working?.abort();
    // What was said of the last avatar says nothing of this one.
    if (this.#file) this.#adult.checked = false;
    this.#clear();
    this.#file = file;
    if (sex) this.#build(sex);
    byId("own-file-name").textContent = `Open: ${file.name}`;
    await this.#work(`Reading ${file.name}`, async (signal) => {
      this.#isReading = true;
      const workshop = await this.#open();
      const read = await workshop.readAvatarFile(file);
      if (!signal.aborted) this.#read = read;
    });
    // Another was opened meanwhile, and goes its own way.
    if (this.#file !== file) return;
    this.#isReading = false;
    await this.#bind(startMs);
  }

  /** Binds once there is a file and both answers; takes the tissue away where one was taken back. */
  async #bind(startMs = performance.now()): Promise<void> {
    if (!this.#isReading) this.#working?.abort();
    this.#unbind();
    this.#sayWanting();
    const [read, sex] = [this.#read, this.#build()];
    // Also before there is a file: what is downloaded by then need not be waited for.
    if (sex) void this.#model(sex).catch(() => {});
    if (!read || !sex || !this.#adult.checked) return;
    await this.#work("Binding it to the body", async (signal) => {
      const [workshop, model] = await Promise.all([this.#open(), this.#model(sex)]);
      signal.throwIfAborted();
      const bindMs = performance.now();
      const binding = await workshop.bindAvatar(model, read.root, {
        depicts: "adult",
        ...(read.vrm && { vrm: read.vrm }),
        signal,
        onProgress: (fraction) => showProgress(fraction),
      });
      const tookMs = performance.now() - bindMs;
      this.#studio ??= this.#makeStudio(workshop);
      this.#canvasShown(true);
      this.#studio.setAvatar(read.root);
      const bound = new workshop.BoundAvatar(model, read.root, binding, this.#studio.heightUnits);
      this.#studio.setPlain(bound.plain);
      this.#bound = bound;
      this.#panel.show(this.#studio, bound, workshop.rampCss());
      const kilobytes = Math.round(binding.toBytes().length / 1000);
      const text = `Bound in ${(tookMs / 1000).toFixed(1)} s; the binding has ${kilobytes} kB.`;
      byId("own-report").replaceChildren(...reportElements(binding.report, text));
      this.#showProgram();
      this.#panel.play(1 / 60);
      this.#movingAfterMs = performance.now() - startMs;
    });
  }

  /** Does something that takes a while; a failure is told as a refusal of the file. */
  async #work(text: string, work: (signal: AbortSignal) => Promise<void>): Promise<void> {
    const working = new AbortController();
    this.#working = working;
    byId("own-progress-text").textContent = text;
    showProgress(0);
    byId("own-progress").hidden = false;
    try {
      await work(working.signal);
    } catch (error) {
      if (!working.signal.aborted) this.#refuse(error);
    } finally {
      if (this.#working === working) {
        this.#working = null;
        byId("own-progress").hidden = true;
        this.#sayWanting();
      }
    }
  }

  #stop(): void {
    this.#working?.abort();
    this.#isReading = false;
    this.#working = null;
    byId("own-progress").hidden = true;
    this.#adult.checked = false;
    this.#sayWanting();
  }

  #refuse(error: unknown): void {
    const name = this.#file?.name ?? "The file";
    this.#clear();
    byId("own-refused").replaceChildren(
      create("strong", { textContent: `${name} is not bound.` }),
      create("p", {
        textContent: sentence(error instanceof Error ? error.message : String(error)),
      }),
    );
  }

  #clear(): void {
    this.#unbind();
    this.#studio?.clear();
    this.#canvasShown(false);
    this.#read = null;
    byId("own-refused").replaceChildren();
  }

  /** Takes the tissue away; the avatar is not shown without it. */
  #unbind(): void {
    this.#panel.hide();
    this.#movingAfterMs = null;
    this.#studio?.setPlain(null);
    this.#bound?.dispose();
    this.#bound = null;
    this.#canvasShown(false);
  }

  #canvasShown(isShown: boolean): void {
    byId("own-view").hidden = !isShown;
    byId("own-empty").hidden = isShown;
  }

  #makeStudio(workshop: Workshop): Studio {
    const canvas = byId<HTMLCanvasElement>("own-view");
    const studio = new workshop.Studio(canvas);
    bindDivider(studio);
    bindClicks(canvas, (x, y) => {
      const mesh = this.#bound ? studio.pick(x, y) : null;
      if (mesh) this.#toggle(mesh);
    });
    return studio;
  }

  #toggle(mesh: SkinnedMesh): void {
    if (this.#bound) this.#panel.exclude(mesh, !this.#bound.isExcluded(mesh));
  }

  #showProgram(): void {
    const [file, sex] = [this.#file, this.#build()];
    if (!file || !sex || !this.#bound) return;
    const excluded = this.#bound.excluded.map((mesh) => mesh.name);
    byId<HTMLTextAreaElement>("own-code").value = programFor({
      fileName: file.name,
      sex,
      isSportswear: this.#bound.clothes === "sportswear",
      excluded,
    });
  }

  #sayWanting(): void {
    const wanting = [
      ...(this.#file ? [] : ["an avatar"]),
      ...(this.#adult.checked ? [] : ["that it depicts an adult"]),
      ...(this.#build() ? [] : ["its build"]),
    ];
    const list = wanting.join(wanting.length > 2 ? ", " : " and ");
    byId("own-wanting").textContent = wanting.length > 0 ? `Still needed: ${list}.` : "";
    byId("own-empty-title").textContent =
      this.#read && this.#file ? `${this.#file.name} is open` : "Drop an avatar here";
    byId("own-asked").hidden = !this.#read || wanting.length === 0;
  }

  /** What was chosen, or chooses. */
  #build(sex?: Sex): Sex | null {
    const radios = document.querySelectorAll<HTMLInputElement>("input[name=build]");
    for (const radio of radios) if (sex) radio.checked = radio.value === sex;
    const chosen = [...radios].find(({ checked }) => checked);
    return chosen ? (chosen.value as Sex) : null;
  }

  /** The chunk with three.js, once. */
  #open(): Promise<Workshop> {
    this.#workshop ??= import("./workshop.js").catch((error: unknown) => {
      this.#workshop = null;
      throw error;
    });
    return this.#workshop;
  }

  #model(sex: Sex): Promise<Model> {
    const known = this.#models.get(sex);
    if (known) return known;
    const model = load({ model: new URL(`${sex}/`, document.baseURI) });
    this.#models.set(sex, model);
    model.catch(() => this.#models.delete(sex));
    return model;
  }
}

function showProgress(fraction: number): void {
  byId<HTMLProgressElement>("own-progress-bar").value = fraction;
}

declare global {
  interface Window {
    /** What tests and curious readers of the console look at. */
    dynaskinOwn?: OwnPage;
  }
}
