import type { Avatar, Body } from "dynaskin";
import { type Backend, type BodyHandle, createRenderer, type Renderer } from "dynaskin/renderer";
import { byId } from "./dom.js";
import { OrbitCamera } from "./orbit.js";

/** Largest ratio of canvas pixels to page pixels; phones have up to 4, at four times the cost. */
const MAX_PIXEL_RATIO = 2;

/** End of the heat map's scale in millimetres. */
export const HEAT_RANGE_MM = 30;

/** Width below which the panel is a sheet at the bottom; as in layout.css. */
const narrowScreen = matchMedia("(max-width: 760px), (max-height: 560px)");
const PANEL_WIDTH_PX = 348;
const SHEET_HEIGHT_PX = 160;

/** What the controls cover of the canvas: the body stands in the middle of the rest. */
function coveredPixels(): { right: number; bottom: number } {
  return narrowScreen.matches
    ? { right: 0, bottom: SHEET_HEIGHT_PX }
    : { right: PANEL_WIDTH_PX, bottom: 0 };
}

function add(a: Vector, b: Vector): Vector {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

type Vector = [number, number, number];
type Colour = [number, number, number];
const BACKGROUNDS: Record<"light" | "dark", { center: Colour; edge: Colour }> = {
  light: { center: [0.93, 0.94, 0.955], edge: [0.74, 0.76, 0.79] },
  dark: { center: [0.3, 0.32, 0.355], edge: [0.085, 0.09, 0.105] },
};

/** The canvas with its camera: shows one avatar. */
export class View {
  readonly camera: OrbitCamera;
  readonly #canvas: HTMLCanvasElement;
  readonly #renderer: Renderer;
  readonly #darkScheme = matchMedia("(prefers-color-scheme: dark)");
  #body: BodyHandle | null = null;
  /** Everything the last picture depended on, apart from the body. */
  #drawn = "";

  private constructor(canvas: HTMLCanvasElement, renderer: Renderer) {
    this.#canvas = canvas;
    this.#renderer = renderer;
    this.camera = new OrbitCamera(canvas);
    const paint = () =>
      renderer.setBackground(BACKGROUNDS[this.#darkScheme.matches ? "dark" : "light"]);
    this.#darkScheme.addEventListener("change", paint);
    paint();
    new ResizeObserver(() => this.#resize()).observe(canvas);
    this.#resize();
  }

  /** Starts drawing on the page's canvas. */
  static async create(
    backend: Backend | "auto",
    onProgress: (loadedBytes: number, totalBytes: number) => void,
  ): Promise<View> {
    const canvas = byId<HTMLCanvasElement>("view");
    const renderer = await createRenderer(canvas, {
      backend,
      onProgress: ({ loadedBytes, totalBytes }) => onProgress(loadedBytes, totalBytes),
    });
    return new View(canvas, renderer);
  }

  /** The renderer, for what the page does not do itself. */
  get renderer(): Renderer {
    return this.#renderer;
  }

  /** The body as the renderer knows it. */
  get body(): BodyHandle | null {
    return this.#body;
  }

  /** Shows another body instead of the present one. */
  setBody(body: Body): void {
    const before = this.#body;
    this.#body = this.#renderer.addBody(body);
    before?.remove();
  }

  /** Colours the body by its offsets, or as it is painted. */
  setHeat(on: boolean): void {
    this.#renderer.setHeatMap(on ? HEAT_RANGE_MM : null);
  }

  /** Hands the avatar's present surface and pose to the graphics card. */
  upload(avatar: Avatar): void {
    this.#body?.update(avatar);
  }

  /** Whether the camera, the window or the colour scheme has changed since the last picture. */
  get isStale(): boolean {
    return this.#drawn !== this.#state;
  }

  get #state(): string {
    const { camera } = this;
    const { clientWidth, clientHeight } = this.#canvas;
    const scheme = this.#darkScheme.matches;
    // A tenth of a millimetre and of a milliradian is nothing to see.
    const view = [...camera.eyeWorldM, ...camera.targetWorldM].map((value) => value.toFixed(4));
    return [...view, clientWidth, clientHeight, devicePixelRatio, scheme].join(" ");
  }

  /** Draws. */
  draw(): void {
    this.#drawn = this.#state;
    const fovYRadians = this.#fovYRadians;
    // Pixels of the canvas to metres at the body.
    const height = Math.max(1, this.#canvas.clientHeight);
    const metresPerPixel = (2 * this.camera.distanceM * Math.tan(fovYRadians / 2)) / height;
    const { right, bottom } = coveredPixels();
    const shift = this.camera.shiftM((right / 2) * metresPerPixel, (-bottom / 2) * metresPerPixel);
    this.#renderer.setCamera({
      eyeWorldM: add(this.camera.eyeWorldM, shift),
      targetWorldM: add(this.camera.targetWorldM, shift),
      fovYRadians,
    });
    this.#renderer.render();
  }

  /** On upright screens the body must fit the width, so the vertical angle grows. */
  get #fovYRadians(): number {
    const aspect = this.#canvas.clientWidth / Math.max(1, this.#canvas.clientHeight);
    return 2 * Math.atan(Math.tan(0.3) * Math.max(1, 0.62 / aspect));
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this.#canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.#renderer.resize(clientWidth, clientHeight, Math.min(devicePixelRatio, MAX_PIXEL_RATIO));
  }
}
