import { byId } from "./dom.js";

/** The one progress bar, over everything the page downloads. */
export class LoadingBar {
  readonly #parts = new Map<string, { loaded: number; total: number }>();
  #text = "Loading the body";

  /** Progress of one download, in bytes. */
  report(part: string, loaded: number, total: number): void {
    this.#parts.set(part, { loaded, total });
    this.#show();
  }

  /** What is being waited for. */
  say(text: string): void {
    this.#text = text;
    this.#show();
  }

  /** Shows the bar again, for another model. */
  start(text: string): void {
    this.#parts.clear();
    byId("loading").classList.remove("done");
    this.say(text);
  }

  /** Shows the bar again for a further part. */
  reopen(text: string): void {
    byId("loading").classList.remove("done");
    this.say(text);
  }

  /** Fades out. */
  finish(): void {
    byId("loading").classList.add("done");
  }

  /** Downloaded megabytes so far. */
  get loadedMegabytes(): number {
    return this.#sum("loaded") / 1e6;
  }

  #sum(key: "loaded" | "total"): number {
    return [...this.#parts.values()].reduce((sum, part) => sum + part[key], 0);
  }

  #show(): void {
    const total = this.#sum("total");
    const share = total > 0 ? this.#sum("loaded") / total : 0;
    byId("loading-fill").style.width = `${Math.min(100, share * 100)}%`;
    const amount =
      total > 0 ? ` · ${this.loadedMegabytes.toFixed(1)} of ${(total / 1e6).toFixed(1)} MB` : "";
    byId("loading-text").textContent = this.#text + amount;
  }
}
