import sizes from "virtual:sizes";
import { byId } from "./dom.js";

/** The files of a folder under `models`, as the bar names them; not those in folders below it. */
export function filesIn(folder: string): string[] {
  return Object.keys(sizes).filter((file) => file.slice(0, file.lastIndexOf("/") + 1) === folder);
}

/**
 * The one progress bar, from the first byte to the last network. It counts unpacked bytes: what a server
 * packs arrives smaller, but a page cannot see how much of that has come.
 */
export class LoadingBar {
  readonly #parts = new Map<string, { loaded: number; total: number }>();
  #text = "Loading the body";
  #done = false;

  /** Announces a download, so that the bar knows its end: files as `virtual:sizes` names them. */
  expect(part: string, files: readonly string[]): void {
    this.#wake();
    const total = files.reduce((sum, file) => sum + (sizes[file] ?? 0), 0);
    if (!this.#parts.has(part)) this.#parts.set(part, { loaded: 0, total });
    this.#show();
  }

  /** Progress of one download, in bytes; `total` counts where the page did not know its files' sizes. */
  report(part: string, loaded: number, total: number): void {
    this.#wake();
    const known = this.#parts.get(part)?.total ?? 0;
    this.#parts.set(part, { loaded, total: Math.max(loaded, known > 0 ? known : total) });
    this.#show();
  }

  /** What is being waited for. */
  say(text: string): void {
    this.#text = text;
    this.#show();
  }

  /** Fills up and fades out; what is downloaded later begins a bar of its own. */
  finish(): void {
    this.#done = true;
    byId("loading-fill").style.width = "100%";
    byId("loading").classList.add("done");
  }

  #wake(): void {
    if (!this.#done) return;
    this.#done = false;
    this.#parts.clear();
    byId("loading").classList.remove("done");
  }

  #sum(key: "loaded" | "total"): number {
    return [...this.#parts.values()].reduce((sum, part) => sum + part[key], 0);
  }

  #show(): void {
    const [loaded, total] = [this.#sum("loaded"), this.#sum("total")];
    byId("loading-fill").style.width = `${total > 0 ? (loaded / total) * 100 : 0}%`;
    const megabytes = (bytes: number) => (bytes / 1e6).toFixed(1);
    const amount = total > 0 ? ` · ${megabytes(loaded)} of ${megabytes(total)} MB, unpacked` : "";
    byId("loading-text").textContent = this.#text + amount;
  }
}
