import type { OrbitCamera } from "./orbit.js";
import { type Settings, writeSettings } from "./settings.js";

/** How long the camera must stand still before it is put into the page's address. */
const CAMERA_RESTS_MS = 400;
/** How long to wait when the browser refuses a new address. */
const AGAIN_MS = 2000;

/** Keeps the settings in the page's address. */
export class Address {
  readonly #settings: Settings;
  readonly #camera: OrbitCamera;
  #timer = 0;
  #moved = { place: "", atMs: 0 };

  constructor(settings: Settings, camera: OrbitCamera) {
    this.#settings = settings;
    this.#camera = camera;
  }

  /** Writes it. Browsers refuse that when it comes too often, as from a slider; then it is done later. */
  write(): void {
    clearTimeout(this.#timer);
    try {
      history.replaceState(null, "", `${location.pathname}${writeSettings(this.#settings)}`);
    } catch {
      this.#timer = window.setTimeout(() => this.write(), AGAIN_MS);
    }
  }

  /** Writes the camera's place once it stands still. */
  rememberCamera(nowMs: number): void {
    const { place } = this.#camera;
    const text = `${place}`;
    if (text !== this.#moved.place) this.#moved = { place: text, atMs: nowMs };
    if (nowMs - this.#moved.atMs <= CAMERA_RESTS_MS || text === `${this.#settings.camera}`) return;
    this.#settings.camera = place;
    this.write();
  }
}
