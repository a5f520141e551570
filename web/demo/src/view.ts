import type { Body } from "dynaskin";
import type { Backend, BodyHandle, Camera, Renderer } from "dynaskin/renderer";
import { byId } from "./dom.js";
import { type Appearance, Layer } from "./layer.js";
import { lowScreen, narrowScreen, shortScreen } from "./narrow.js";
import { OrbitCamera } from "./orbit.js";

/** Vertical angle of view, in radians. */
const FOV_Y_RADIANS = 0.6;
/** Widths over heights of a picture in which one body has room, and what each further one needs. */
const ASPECT = { one: 0.62, close: 0.78, row: 0.68, further: 0.42 };
/** The panel with its margin: `--panel` in base.css and one gap. */
const PANEL_WIDTH_PX = { usual: 348, short: 288 };
/** Plots and timings, or the narrower caption, with their margins. */
const READINGS_WIDTH_PX = { usual: 302, caption: 248 };
const SHEET_HEIGHT_PX = 160;
/** Title and names of a phone that shows plots. */
const PLOTS_TITLE_PX = 92;
/** Title and names of other pictures with the controls below them: of a phone, and of a tablet. */
const SHEET_TITLE_PX = { phone: 118, tablet: 168 };
const phoneScreen = matchMedia("(max-width: 620px)");
/** Title with names, and the playback bar: low pictures have no room for a body behind them. */
const SHORT_COVERED_PX = { top: 96, bottom: 70 };
/** The same in pictures that are high enough for the body, but not for the names over its head as well. */
const LOW_COVERED_PX = { top: 144, bottom: 80 };
/** Share of the height that is free which a standing body takes. */
const SHORT_BODY = 0.72;

/** What the story's text and chapters cover: a body close by fills the picture, but for a phone's. */
function storyCoveredPixels(chapter: string): { top: number; right: number; bottom: number } {
  if (narrowScreen.matches) return { top: 70, right: 0, bottom: 230 };
  // Arms reach to the left: the row stands a little to the right.
  if (chapter === "bodies") return { top: 40, right: -40, bottom: shortScreen.matches ? 100 : 190 };
  return { top: 0, right: 0, bottom: chapter === "grab" ? 60 : 0 };
}

/** Whether the canvases are square, for a film, without anything over them. */
const isFilming = () => document.documentElement.classList.contains("filming");

/** What the controls cover of the canvas: the body stands in the middle of the rest. */
export function coveredPixels(): { top: number; right: number; bottom: number } {
  if (isFilming()) return { top: 0, right: 0, bottom: 0 };
  const { chapter } = document.documentElement.dataset;
  if (chapter && chapter !== "lab") return storyCoveredPixels(chapter);
  if (narrowScreen.matches) {
    const isShown = byId("caption").checkVisibility();
    if (!isShown && byId("readings").offsetHeight > 0) {
      const { top } = byId("readings").getBoundingClientRect();
      return { top: PLOTS_TITLE_PX, right: 0, bottom: innerHeight - top };
    }
    const top = phoneScreen.matches ? SHEET_TITLE_PX.phone : SHEET_TITLE_PX.tablet;
    const captionTop = byId("caption").getBoundingClientRect().top;
    return { top, right: 0, bottom: isShown ? innerHeight - captionTop : SHEET_HEIGHT_PX };
  }
  return shortScreen.matches
    ? { ...SHORT_COVERED_PX, right: PANEL_WIDTH_PX.short }
    : { top: 0, right: PANEL_WIDTH_PX.usual, bottom: 0 };
}

/** What is covered of a canvas, in pixels from its edges. */
type Covered = ReturnType<typeof coveredPixels>;

/**
 * How much further away the camera must be for a body to fit what is free of a canvas; `wanted` is the aspect that it
 * fits, `freeWidth` what is free of the width; `isLow`: little of the height is free.
 */
function retreatFor(
  wanted: number,
  freeWidth: number,
  height: number,
  covered: Covered,
  isLow = false,
): number {
  const aspect = Math.max(1, freeWidth) / Math.max(1, height);
  const free = Math.max(0.1, 1 - (covered.top + covered.bottom) / Math.max(1, height));
  const low = isLow || shortScreen.matches ? SHORT_BODY / free : 1;
  return Math.max(1, low, wanted / aspect);
}

/** How far the camera is moved, in pixels to the right and up, so that the body is in the middle of what is free. */
function shiftPx({ top, right, bottom }: Covered, left: number): [right: number, up: number] {
  return [(right - left) / 2, (top - bottom) / 2];
}

/**
 * Where the camera is for one body close by, from its target: how far away, and how far it is moved to the right and
 * up, in metres. `distanceM` is the visitor's distance, `canvas` what is drawn on.
 */
export function closeUpFraming(
  { clientWidth, clientHeight }: HTMLCanvasElement,
  distanceM: number,
) {
  const covered = coveredPixels();
  const reachM = distanceM * retreatFor(ASPECT.close, clientWidth, clientHeight, covered);
  const metresPerPixel = (2 * reachM * Math.tan(FOV_Y_RADIANS / 2)) / Math.max(1, clientHeight);
  const [right, up] = shiftPx(covered, 0);
  return {
    ...{ reachM, fovYRadians: FOV_Y_RADIANS },
    ...{ rightM: right * metresPerPixel, upM: up * metresPerPixel },
  };
}

type Vector = [number, number, number];

function add(a: Vector, b: Vector): Vector {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

/** The picture: actors beside each other, or two of them left and right of a divider; one camera. */
export class View {
  readonly camera: OrbitCamera;
  readonly #main: Layer;
  readonly #backend: Backend | "auto";
  readonly #adaptiveResolution: boolean;
  readonly #darkScheme = matchMedia("(prefers-color-scheme: dark)");
  #left: Layer | null = null;
  #opening: Promise<Layer> | null = null;
  #shown: Body | null = null;
  #heatRangeMm: number | null = null;
  #sculpture = true;
  /** Share of the canvas, from its left edge, that shows the left actor. */
  #leftShare = 0;
  /** Whether the left actor and the right one have a camera each, in the middle of their halves. */
  #isPaired = false;
  /** Everything the last picture depended on, apart from the bodies. */
  #drawn = "";

  private constructor(main: Layer, backend: Backend | "auto", adaptiveResolution: boolean) {
    this.#main = main;
    this.#backend = backend;
    this.#adaptiveResolution = adaptiveResolution;
    this.camera = new OrbitCamera(main.canvas);
    main.onRecovered = () => this.#forgetPicture();
  }

  /** Starts drawing on the page's canvas. */
  static async create(
    backend: Backend | "auto",
    adaptiveResolution: boolean,
    onProgress: (loadedBytes: number, totalBytes: number) => void,
  ): Promise<View> {
    const canvas = byId<HTMLCanvasElement>("view");
    const main = await Layer.create(canvas, backend, adaptiveResolution, onProgress);
    return new View(main, backend, adaptiveResolution);
  }

  /** The renderer of the right actor, for what the page does not do itself. */
  get renderer(): Renderer {
    return this.#main.renderer;
  }

  /** The bodies of the actors beside each other, or of the right one, as the renderer knows them. */
  get bodies(): readonly BodyHandle[] {
    return this.#main.bodies;
  }

  /** The body of the left actor of a divider; null where there is none. */
  get leftBody(): BodyHandle | null {
    return this.#left?.bodies[0] ?? null;
  }

  /** The canvases that the picture is made of, from the bottom up, and where each begins and ends. */
  get parts(): { canvas: HTMLCanvasElement; from: number; to: number }[] {
    const share = this.#left ? this.#leftShare : 0;
    const parts = [{ canvas: this.#main.canvas, from: share, to: 1 }];
    if (this.#left) parts.push({ canvas: this.#left.canvas, from: 0, to: share });
    // Without an outline it has no pixels.
    const ghost = byId<HTMLCanvasElement>("ghost");
    if (ghost.width > 0) parts.push({ canvas: ghost, from: 0, to: 1 });
    return parts;
  }

  /** Makes the canvases square for a film, which has room for all actors, or gives them the window again. */
  setFilming(on: boolean): void {
    document.documentElement.classList.toggle("filming", on);
    this.#main.fit();
    this.#left?.fit();
    this.#drawn = "";
  }

  /** Size of the picture in pixels, and what share of the screen's pixels that is along each side. */
  get resolution(): string {
    const { canvas, renderer } = this.#main;
    const share = renderer.resolutionScale;
    const lowered = share < 1 ? ` (${Math.round(share * 100)} %)` : "";
    return `${canvas.width} × ${canvas.height}${lowered}`;
  }

  /** Makes the canvas of the left actor, the first time it is asked for. */
  async openLeft(): Promise<void> {
    const canvas = byId<HTMLCanvasElement>("view-left");
    this.#opening ??= Layer.create(canvas, this.#backend, this.#adaptiveResolution, () => {});
    const layer = await this.#opening;
    if (this.#left) return;
    this.#left = layer;
    layer.onRecovered = () => this.#forgetPicture();
    layer.renderer.setHeatMap(this.#heatRangeMm);
    layer.setLook(this.#sculpture);
    if (this.#shown) layer.setBodies(this.#shown, 1);
    this.setLeftShare(this.#leftShare);
  }

  /** Shows a body, so many times beside each other. */
  setBodies(body: Body, beside: number): void {
    this.#shown = body;
    this.#main.setBodies(body, beside);
    this.#left?.setBodies(body, 1);
    this.#drawn = "";
  }

  /** Colours the bodies from 0 to so many millimetres; null: as they are painted. */
  setHeat(rangeMm: number | null): void {
    this.#heatRangeMm = rangeMm;
    this.#main.renderer.setHeatMap(rangeMm);
    this.#left?.renderer.setHeatMap(rangeMm);
  }

  /** Shows the bodies as matt plaster, or as they are painted. */
  setLook(sculpture: boolean): void {
    this.#sculpture = sculpture;
    this.#main.setLook(sculpture);
    this.#left?.setLook(sculpture);
    this.#drawn = "";
  }

  /** Whether the canvas of the left actor is there. */
  get hasLeft(): boolean {
    return this.#left !== null;
  }

  /** Gives the actors left and right a camera each, in the middle of their halves, or one in the middle of all. */
  setPaired(isPaired: boolean): void {
    this.#isPaired = isPaired;
    this.#drawn = "";
  }

  /** How far from the middle of the picture an actor stands whose camera is its own, in pixels to the right. */
  asidePx(side: "left" | "right"): number {
    if (!this.#isPaired) return 0;
    const quarter = (this.#main.canvas.clientWidth - coveredPixels().right) / 4;
    return side === "left" ? -quarter : quarter;
  }

  /** Gives the left actor a share of the canvas, from its left edge. */
  setLeftShare(share: number): void {
    this.#leftShare = share;
    const canvas = byId<HTMLCanvasElement>("view-left");
    canvas.style.clipPath = `inset(0 ${((1 - share) * 100).toFixed(3)}% 0 0)`;
    canvas.style.visibility = this.#left && share > 0 ? "visible" : "hidden";
    this.#drawn = "";
  }

  /** Hands the actors' present surfaces to the graphics card; `left` is the one of the divider. */
  upload(main: readonly Appearance[], left: Appearance | null): void {
    if (this.#leftShare < 1) this.#main.upload(main);
    if (left && this.#leftShare > 0) this.#left?.upload([left]);
  }

  /** Whether the camera, the window or the colour scheme has changed since the last picture. */
  get isStale(): boolean {
    return this.#drawn !== this.#state;
  }

  get #state(): string {
    const { camera } = this;
    const { clientWidth, clientHeight } = this.#main.canvas;
    const scheme = this.#darkScheme.matches;
    // A tenth of a millimetre and of a milliradian is nothing to see.
    const view = [...camera.eyeWorldM, ...camera.targetWorldM].map((value) => value.toFixed(4));
    return [...view, clientWidth, clientHeight, devicePixelRatio, scheme].join(" ");
  }

  /** The next round draws, even where nothing moves. */
  #forgetPicture(): void {
    this.#drawn = "";
  }

  /** Draws, a picture that will stand with all pixels. */
  draw(stands = false): void {
    this.#drawn = this.#state;
    if (this.#leftShare < 1 || !this.#left) {
      this.#main.draw(this.#cameraAside(this.asidePx("right")), stands);
    }
    if (this.#leftShare > 0) this.#left?.draw(this.#cameraAside(this.asidePx("left")), stands);
  }

  /** Whether pixels were left out of the last picture. */
  get isCoarse(): boolean {
    return this.#main.renderer.resolutionScale < 1;
  }

  /**
   * Where a point of the world (metres) is in the picture, in CSS pixels from its top left corner, and
   * how many metres a pixel is there.
   */
  project(pointWorldM: Vector): { xPx: number; yPx: number; metresPerPixel: number } {
    const { clientWidth, clientHeight } = this.#main.canvas;
    const { eyeWorldM, targetWorldM, fovYRadians } = this.#camera;
    const from = (place: readonly number[]) =>
      pointWorldM.map((value, axis) => value - (place[axis] ?? 0));
    const along = (a: readonly number[], b: readonly number[]) =>
      a.reduce((sum, value, axis) => sum + value * (b[axis] ?? 0), 0);
    const away = this.camera.awayM;
    const depthM = Math.max(0.05, along(from(eyeWorldM), away));
    const metresPerPixel = (2 * depthM * Math.tan(fovYRadians / 2)) / Math.max(1, clientHeight);
    const offset = from(targetWorldM);
    return {
      xPx: clientWidth / 2 + along(offset, this.camera.shiftM(1, 0)) / metresPerPixel,
      yPx: clientHeight / 2 - along(offset, this.camera.shiftM(0, 1)) / metresPerPixel,
      metresPerPixel,
    };
  }

  /** {@link project} for many points: where the picture has them, in CSS pixels. */
  projector(): (xM: number, yM: number, zM: number) => [xPx: number, yPx: number] {
    const { clientWidth, clientHeight } = this.#main.canvas;
    const { eyeWorldM, targetWorldM, fovYRadians } = this.#camera;
    const [awayX, awayY, awayZ] = this.camera.awayM;
    const [rightX, rightY, rightZ] = this.camera.shiftM(1, 0);
    const [upX, upY, upZ] = this.camera.shiftM(0, 1);
    const [eyeX, eyeY, eyeZ] = eyeWorldM;
    const [targetX, targetY, targetZ] = targetWorldM;
    const perDepth = Math.max(1, clientHeight) / (2 * Math.tan(fovYRadians / 2));
    return (x, y, z) => {
      const depthM = (x - eyeX) * awayX + (y - eyeY) * awayY + (z - eyeZ) * awayZ;
      const scale = perDepth / Math.max(0.05, depthM);
      const [dx, dy, dz] = [x - targetX, y - targetY, z - targetZ];
      return [
        clientWidth / 2 + (dx * rightX + dy * rightY + dz * rightZ) * scale,
        clientHeight / 2 - (dx * upX + dy * upY + dz * upZ) * scale,
      ];
    };
  }

  get #camera(): Camera {
    return this.#cameraAside(0);
  }

  /** The camera whose target is so many pixels right of the middle of what is free. */
  #cameraAside(asidePx: number): Camera {
    const fovYRadians = FOV_Y_RADIANS;
    this.camera.retreat = this.#retreat;
    // Pixels of the canvas to metres at the body.
    const height = Math.max(1, this.#main.canvas.clientHeight);
    const metresPerPixel = (2 * this.camera.reachM * Math.tan(fovYRadians / 2)) / height;
    const left = this.#isPaired ? 0 : this.coveredLeftPx;
    const [right, up] = shiftPx(this.#coveredPixels, left);
    const shift = this.camera.shiftM((right - asidePx) * metresPerPixel, up * metresPerPixel);
    return {
      eyeWorldM: add(this.camera.eyeWorldM, shift),
      targetWorldM: add(this.camera.targetWorldM, shift),
      fovYRadians,
    };
  }

  /** Whether the Lab shows whole bodies: those close by fill the picture. */
  get #showsWholeLab(): boolean {
    return document.documentElement.dataset.chapter === "lab" && !this.camera.isClose;
  }

  /** Whether the names of a row would hang over faces, because the title is where they had room. */
  get #isLowLab(): boolean {
    const isRow = this.#main.bodies.length > 1;
    const isOther = narrowScreen.matches || shortScreen.matches || isFilming();
    return isRow && this.#showsWholeLab && lowScreen.matches && !isOther;
  }

  get #coveredPixels(): { top: number; right: number; bottom: number } {
    return this.#isLowLab ? { ...coveredPixels(), ...LOW_COVERED_PX } : coveredPixels();
  }

  /** What plots, timings and the caption cover of a row of actors. */
  get coveredLeftPx(): number {
    const isRow = this.#isPaired || this.#main.bodies.length > 1;
    const isLab = document.documentElement.dataset.chapter === "lab";
    if (!isRow || !isLab || narrowScreen.matches || isFilming()) return 0;
    if (!byId("plots").hidden || !byId("hud").hidden) return READINGS_WIDTH_PX.usual;
    return byId("caption").checkVisibility() ? READINGS_WIDTH_PX.caption : 0;
  }

  /** How much further away the camera must be for all actors to fit the width that is free. */
  get #retreat(): number {
    const { clientWidth, clientHeight } = this.#main.canvas;
    const further = this.#isPaired ? 1 : Math.max(0, this.#main.bodies.length - 1);
    // One body may stand partly behind the panel's edge; a row may not.
    const covered =
      further > 0 ? coveredPixels().right + (this.#isPaired ? 0 : this.coveredLeftPx) : 0;
    const wanted =
      further > 0
        ? ASPECT.row + further * ASPECT.further
        : this.camera.isClose
          ? ASPECT.close
          : ASPECT.one;
    const isNarrowLab = this.#showsWholeLab && narrowScreen.matches;
    const isLow = isNarrowLab || this.#isLowLab;
    return retreatFor(wanted, clientWidth - covered, clientHeight, this.#coveredPixels, isLow);
  }
}
