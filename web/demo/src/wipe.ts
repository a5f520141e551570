import { byId } from "./dom.js";
import { bindHold } from "./hold.js";
import { hasTwoPictures, isDivided, type PageStore } from "./state.js";
import { coveredPixels } from "./view.js";

const KEY_STEP = 0.02;
/** Room that a name takes beside its own width: to the divider, and to the edge of the picture. */
const NAME_MARGIN_PX = 28;

/**
 * The divider between two actors, dragged or moved with the arrow keys, and their names, which show
 * one actor alone for as long as they are held.
 */
export class Wipe {
  readonly #store: PageStore;
  readonly #setLeftShare: (share: number) => void;
  readonly #divider = byId("divider");
  /** Widths of the names as they were drawn last, in pixels. */
  readonly #widthsPx = { left: 0, right: 0 };

  /** `setLeftShare` is told what share of the canvas the left actor has, from its left edge. */
  constructor(store: PageStore, setLeftShare: (share: number) => void) {
    this.#store = store;
    this.#setLeftShare = setLeftShare;
    this.#bindDivider();
    this.#bindName("left");
    this.#bindName("right");
    const sizes = new ResizeObserver(() => {
      for (const side of ["left", "right"] as const) {
        this.#widthsPx[side] = byId(`name-${side}`).offsetWidth;
      }
      this.#show();
    });
    for (const side of ["left", "right"] as const) sizes.observe(byId(`name-${side}`));
    addEventListener("resize", () => this.#show());
    store.show(() => this.#show());
  }

  /** Names the actors. */
  setNames(left: string, right: string): void {
    byId("name-left-text").textContent = left;
    byId("name-right-text").textContent = right;
  }

  /** Width of the picture that nothing covers, in pixels. */
  get #freeWidthPx(): number {
    return innerWidth - coveredPixels().right;
  }

  /** The divider, or one actor alone. */
  #show(): void {
    const { split: free, held } = this.#store.state;
    const isOn = isDivided(this.#store.state);
    byId("wipe").hidden = !isOn;
    for (const name of ["left", "right"] as const) {
      byId(`name-${name}`).setAttribute("aria-pressed", `${isOn && name === held}`);
    }
    const split = held === "left" ? 1 : held === "right" ? 0 : free;
    const x = split * this.#freeWidthPx;
    byId("wipe").style.setProperty("--x", `${x.toFixed(1)}px`);
    byId("wipe").classList.toggle("held", held !== null);
    // A name that the picture's edge would cut goes away with the side that it names; a finger on it keeps it.
    const roomPx = { left: x, right: this.#freeWidthPx - x };
    for (const side of ["left", "right"] as const) {
      const isCut = roomPx[side] < this.#widthsPx[side] + NAME_MARGIN_PX;
      byId(`name-${side}`).classList.toggle("cut", isCut && held === null);
    }
    const percent = Math.round(free * 100);
    this.#divider.setAttribute("aria-valuenow", `${percent}`);
    this.#divider.setAttribute("aria-valuetext", `${percent} % of the picture is the left actor`);
    const { state } = this.#store;
    document.documentElement.classList.toggle("paired", state.isPaired);
    const seam = state.isPaired ? this.#freeWidthPx / 2 : x;
    document.documentElement.style.setProperty("--seam", `${seam.toFixed(1)}px`);
    // What the panel covers belongs to the side that is shown alone.
    const share = isOn && held === "left" ? 1 : seam / innerWidth;
    this.#setLeftShare(hasTwoPictures(state) ? share : 0);
  }

  #move(split: number): void {
    this.#store.change({ split: Math.max(0, Math.min(1, split)) });
  }

  #bindDivider(): void {
    const divider = this.#divider;
    divider.addEventListener("pointerdown", (event) => {
      divider.setPointerCapture(event.pointerId);
      event.preventDefault();
      divider.focus({ preventScroll: true });
    });
    divider.addEventListener("pointermove", (event) => {
      if (!divider.hasPointerCapture(event.pointerId)) return;
      this.#move(event.clientX / this.#freeWidthPx);
    });
    divider.addEventListener("dblclick", () => this.#move(0.5));
    divider.addEventListener("keydown", (event) => {
      const { split: now } = this.#store.state;
      const moves: Record<string, number> = {
        ArrowLeft: now - KEY_STEP,
        ArrowRight: now + KEY_STEP,
        Home: 0,
        End: 1,
      };
      const split = moves[event.key];
      if (split === undefined) return;
      event.preventDefault();
      this.#move(split);
    });
  }

  #bindName(side: "left" | "right"): void {
    bindHold(byId(`name-${side}`), (held) => this.#store.change({ held: held ? side : null }));
  }
}
