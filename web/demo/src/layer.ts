import type { Avatar, Body } from "dynaskin";
import {
  type Backend,
  type BodyHandle,
  type Camera,
  createRenderer,
  type Renderer,
} from "dynaskin/renderer";
import { showLoss } from "./loss.js";

/** A displacement on the floor: along x and z of the world, in metres. */
export type Place = readonly [xM: number, zM: number];

/** What a picture shows of an actor. */
export interface Appearance {
  avatar: Avatar;
  /** What the heat map colours it by: offsets of every vertex, metres; null: the avatar's own. */
  heatM: Float32Array | null;
  /** Where it stands, from where its pose is. */
  placeM: Place;
}

/** Largest ratio of canvas pixels to page pixels; phones have up to 4, at four times the cost. */
const MAX_PIXEL_RATIO = 2;

type Colour = [number, number, number];
const BACKGROUNDS: Record<"light" | "dark", { center: Colour; edge: Colour }> = {
  light: { center: [0.93, 0.94, 0.955], edge: [0.74, 0.76, 0.79] },
  dark: { center: [0.3, 0.32, 0.355], edge: [0.085, 0.09, 0.105] },
};
const darkScheme = matchMedia("(prefers-color-scheme: dark)");

/** One canvas with one actor or some beside each other. Two canvases, one clipped, make a split picture. */
export class Layer {
  readonly renderer: Renderer;
  readonly canvas: HTMLCanvasElement;
  /** Called when the picture is empty after a loss and has to be drawn again. */
  onRecovered: () => void = () => {};
  #shown: Body | null = null;
  #bodies: BodyHandle[] = [];
  #sculpture = true;
  /** The screen's pixels a CSS pixel that the picture has been made for. */
  #pixelRatio = 0;

  private constructor(canvas: HTMLCanvasElement, renderer: Renderer) {
    this.canvas = canvas;
    this.renderer = renderer;
    const paint = () => renderer.setBackground(BACKGROUNDS[darkScheme.matches ? "dark" : "light"]);
    darkScheme.addEventListener("change", paint);
    paint();
    new ResizeObserver(() => this.fit()).observe(canvas);
    this.fit();
    void this.#watchLoss();
  }

  /** Brings the picture back whenever the graphics card is lost. */
  async #watchLoss(): Promise<void> {
    while ((await this.renderer.lost) !== null) {
      if (!(await showLoss(() => this.renderer.recover()))) return;
      this.onRecovered();
    }
  }

  /** Starts drawing on a canvas. */
  static async create(
    canvas: HTMLCanvasElement,
    backend: Backend | "auto",
    adaptiveResolution: boolean,
    onProgress: (loadedBytes: number, totalBytes: number) => void,
  ): Promise<Layer> {
    const renderer = await createRenderer(canvas, {
      backend,
      adaptiveResolution,
      onProgress: ({ loadedBytes, totalBytes }) => onProgress(loadedBytes, totalBytes),
    });
    return new Layer(canvas, renderer);
  }

  /** The actors' bodies as the renderer knows them. */
  get bodies(): readonly BodyHandle[] {
    return this.#bodies;
  }

  /** Shows so many actors with a body, instead of those that were there. */
  setBodies(body: Body, count: number): void {
    if (body === this.#shown && count === this.#bodies.length) return;
    const before = this.#bodies;
    this.#bodies = Array.from({ length: count }, () => this.renderer.addBody(body));
    this.#shown = body;
    this.setLook(this.#sculpture);
    for (const handle of before) handle.remove();
  }

  /** Shows the bodies as matt plaster, or as they are painted; clothes span either way. */
  setLook(sculpture: boolean): void {
    this.#sculpture = sculpture;
    for (const handle of this.#bodies) handle.setLook({ sculpture, draped: true });
  }

  /** Hands the present surfaces of all actors to the graphics card. */
  upload(appearances: readonly Appearance[]): void {
    for (const [idx, { avatar, heatM, placeM }] of appearances.entries()) {
      const handle = this.#bodies[idx];
      handle?.setPlacement({ positionM: [placeM[0], 0, placeM[1]] });
      if (heatM) {
        const { positions, normals, skinMatrices } = avatar;
        handle?.update({ positions, normals, skinMatrices, offsets: heatM });
      } else {
        handle?.update(avatar);
      }
    }
  }

  /** Draws one picture, one that will stand with all pixels. */
  draw(camera: Camera, stands = false): void {
    // A window dragged to another screen keeps its size in CSS pixels, and no event says so reliably.
    if (devicePixelRatio !== this.#pixelRatio) this.fit();
    this.renderer.setCamera(camera);
    this.renderer.render({ allPixels: stands });
  }

  /** Gives the picture the size that the canvas has now. */
  fit(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.#pixelRatio = devicePixelRatio;
    this.renderer.resize(clientWidth, clientHeight, Math.min(devicePixelRatio, MAX_PIXEL_RATIO));
  }
}
