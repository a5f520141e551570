import type { OrbitCamera } from "./orbit.js";
import { writeSettings } from "./settings.js";
import { type PageStore, settingsOf } from "./state.js";

/** How long the camera must stand still before it is put into the page's address. */
const CAMERA_RESTS_MS = 400;
/** How long to wait when the browser refuses a new address. */
const AGAIN_MS = 2000;

/** Keeps the settings and the camera in the page's address. */
export class Address {
  readonly #store: PageStore;
  readonly #camera: OrbitCamera;
  #timer = 0;
  #moved = { place: "", atMs: 0 };

  constructor(store: PageStore, camera: OrbitCamera) {
    this.#store = store;
    this.#camera = camera;
    store.on(
      () => Object.values(settingsOf(store.state)),
      () => this.#write(),
    );
  }

  /** Writes it. Browsers refuse that when it comes too often, as from a slider; then it is done later. */
  #write(): void {
    clearTimeout(this.#timer);
    try {
      history.replaceState(null, "", `${location.pathname}${writeSettings(this.#store.state)}`);
    } catch {
      this.#timer = window.setTimeout(() => this.#write(), AGAIN_MS);
    }
  }

  /** Writes the camera's place once it stands still. */
  rememberCamera(nowMs: number): void {
    const { place } = this.#camera;
    const text = `${place}`;
    if (text !== this.#moved.place) this.#moved = { place: text, atMs: nowMs };
    if (nowMs - this.#moved.atMs <= CAMERA_RESTS_MS || text === `${this.#store.state.camera}`)
      return;
    this.#store.change({ camera: place });
  }
}
