import type { SkinnedMesh } from "three";
import { byId, create } from "../dom.js";
import { lessMotion } from "../less-motion.js";
import { MOTIONS, type MotionName } from "../motions.js";
import { createSlider, fillSliders } from "../slider.js";
import { showError } from "../toast.js";
import type { BoundAvatar, Clothes } from "./bound-avatar.js";
import type { OwnLayout, Studio } from "./studio.js";

/** Parts of the page that there are only while something plays. */
const PARTS = [
  "own-play",
  "own-meshes",
  "own-found",
  "own-take",
  "own-name-plain",
  "own-name-tissue",
];

/** A picture that took longer is slow. */
const SLOW_SECONDS = 0.045;
const SLOW_PICTURES = 8;

/** The controls of what plays, and its clock. */
export class PlayPanel {
  readonly #changed: () => void;
  readonly #motion = byId<HTMLSelectElement>("own-motion");
  readonly #speed = byId<HTMLSelectElement>("own-speed");
  readonly #pause = byId("own-pause");
  readonly #coverage = byId("own-coverage");
  readonly #boxes = new Map<SkinnedMesh, HTMLInputElement>();
  #studio: Studio | null = null;
  #bound: BoundAvatar | null = null;
  #isPlaying = true;
  #frame = 0;
  #lastMs = 0;
  #slow = 0;

  /** `changed` is called when the program is another. */
  constructor(changed: () => void) {
    this.#changed = changed;
    this.#motion.append(
      ...MOTIONS.map(({ name, label }) => create("option", { value: name, textContent: label })),
    );
    this.#motion.addEventListener("change", () => {
      this.#try((bound) => bound.setMotion(this.#motion.value as MotionName));
      this.#showCoverage(this.#isMapped);
    });
    this.#pause.addEventListener("click", () => this.setPlaying(!this.#isPlaying));
    byId("own-moment").addEventListener("click", () => {
      this.setPlaying(false);
      this.#try((bound) => bound.seekMoment());
    });
    this.#coverage.addEventListener("click", () => {
      this.#showCoverage(!this.#isMapped);
    });
    byId("own-clothes").addEventListener("change", () => {
      this.#try((bound) => bound.setClothes(clothes()));
      this.#showCoverage(this.#isMapped);
      this.#changed();
    });
    // A round of the motion takes too long to be played at every step of the slider.
    byId("own-strength").addEventListener("change", () => this.#showCoverage(this.#isMapped));
    byId("own-layout").addEventListener("change", () => this.#showLayout());
  }

  /** Plays an avatar with the settings as they are. */
  show(studio: Studio, bound: BoundAvatar, ramp: string): void {
    [this.#studio, this.#bound] = [studio, bound];
    for (const id of PARTS) byId(id).hidden = false;
    byId("own-ramp").style.background = ramp;
    fillSliders("own-strength", [this.#strengthSlider()]);
    this.#listMeshes(bound);
    bound.setClothes(clothes());
    bound.setMotion(this.#motion.value as MotionName);
    this.#showLayout();
    this.#showCoverage(this.#isMapped);
    byId("own-still").hidden = !lessMotion.matches;
    this.setPlaying(!lessMotion.matches);
    if (lessMotion.matches) bound.seekMoment();
    this.#lastMs = performance.now();
    this.#frame = requestAnimationFrame((ms) => this.#tick(ms));
  }

  hide(): void {
    cancelAnimationFrame(this.#frame);
    [this.#studio, this.#bound] = [null, null];
    for (const id of [...PARTS, "own-divider", "own-legend"]) byId(id).hidden = true;
    byId("own-mesh-note").textContent = "";
  }

  setPlaying(isPlaying: boolean): void {
    this.#isPlaying = isPlaying;
    this.#pause.textContent = isPlaying ? "Pause" : "Play";
    if (isPlaying) byId("own-still").hidden = true;
  }

  /** Goes on by so many seconds of the motion, and draws. */
  play(seconds: number): void {
    this.#bound?.play(seconds);
    this.#studio?.draw();
  }

  /** Leaves a mesh as it is without tissue, or lets it move. */
  exclude(mesh: SkinnedMesh, isExcluded: boolean): void {
    this.#try((bound) => bound.setExcluded(mesh, isExcluded));
    this.#showCoverage(this.#isMapped);
    const isOut = this.#bound?.isExcluded(mesh) ?? false;
    const box = this.#boxes.get(mesh);
    if (box) box.checked = !isOut;
    byId("own-mesh-note").textContent = isOut
      ? `${labelOf(mesh)} stays as plain skinning has it.`
      : `${labelOf(mesh)} moves with the tissue.`;
    this.#changed();
  }

  #tick(ms: number): void {
    const seconds = Math.max(0, (ms - this.#lastMs) / 1000);
    this.#lastMs = ms;
    try {
      if (this.#isPlaying) {
        this.#notice(seconds);
        this.play(seconds * +this.#speed.value);
      } else this.#studio?.refresh();
      this.#frame = requestAnimationFrame((next) => this.#tick(next));
    } catch (error) {
      showError("The avatar stopped; open it again", error);
    }
  }

  /** Pictures that come too slowly, one after the other, lose pixels. */
  #notice(seconds: number): void {
    this.#slow = seconds > SLOW_SECONDS ? this.#slow + 1 : 0;
    if (this.#slow < SLOW_PICTURES) return;
    this.#slow = 0;
    this.#studio?.blur();
  }

  #try(work: (bound: BoundAvatar) => void): void {
    try {
      if (this.#bound) work(this.#bound);
      this.#studio?.invalidate();
    } catch (error) {
      showError("That could not be done", error);
    }
  }

  #showLayout(): void {
    const chosen = document.querySelector<HTMLInputElement>("input[name=own-layout]:checked");
    if (!this.#studio) return;
    this.#studio.layout = (chosen?.value ?? "side") as OwnLayout;
    byId("own-divider").hidden = this.#studio.layout !== "wipe";
  }

  get #isMapped(): boolean {
    return this.#coverage.getAttribute("aria-checked") === "true";
  }

  #showCoverage(isShown: boolean): void {
    this.#coverage.setAttribute("aria-checked", `${isShown}`);
    this.#try((bound) => {
      const mostM = bound.showCoverage(isShown);
      byId("own-ramp-end").textContent = `${Math.round(1000 * mostM)} mm`;
      byId("own-legend").hidden = !isShown;
    });
  }

  #strengthSlider() {
    return createSlider({
      ...{ id: "own-strength-value", label: "Strength", min: 0, max: 3, step: 0.1, value: 1 },
      format: (value) => `${value.toFixed(1)}×`,
      onInput: (value) => this.#try((bound) => bound.setStrength(value)),
    });
  }

  #listMeshes({ meshes, binding }: BoundAvatar): void {
    this.#boxes.clear();
    const found = binding.report.meshes;
    const items = meshes.map((mesh, idx) => {
      const counts = found.length === meshes.length ? found[idx] : undefined;
      const isStill = counts?.moving === 0;
      const box = create("input", { type: "checkbox", checked: !isStill, disabled: isStill });
      box.addEventListener("change", () => this.exclude(mesh, !box.checked));
      this.#boxes.set(mesh, box);
      const text = isStill
        ? "stays still by itself"
        : counts &&
          `${counts.moving.toLocaleString("en")} of ${counts.vertices.toLocaleString("en")} vertices move`;
      const label = create("label", {}, [
        box,
        create("span", {}, [
          labelOf(mesh),
          create("span", { className: "muted", textContent: text ?? "" }),
        ]),
      ]);
      return create("li", {}, [label]);
    });
    byId("own-mesh-list").replaceChildren(...items);
  }
}

function labelOf(mesh: SkinnedMesh): string {
  const { name } = [mesh.material].flat()[0] ?? { name: "" };
  return mesh.name || name || "a mesh without a name";
}

function clothes(): Clothes {
  const chosen = document.querySelector<HTMLInputElement>("input[name=own-clothes]:checked");
  return (chosen?.value ?? "sportswear") as Clothes;
}
