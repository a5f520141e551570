import { BENCHMARK_COLUMNS, type BenchmarkRow, benchmarkText, runBenchmark } from "./benchmark.js";
import type { Cast } from "./cast.js";
import { copyText } from "./clipboard.js";
import { byId, create } from "./dom.js";
import type { PageStore } from "./state.js";

/** The overlay that measures all methods on the visitor's machine and shows the table. */
export class BenchmarkDialog {
  readonly #store: PageStore;
  readonly #openWhole: () => Promise<Cast>;
  readonly #dialog = byId<HTMLDialogElement>("benchmark-dialog");
  #running: AbortController | null = null;
  #text = "";

  /** `openWhole` gives the cast with the core that runs every method's networks. */
  constructor(store: PageStore, openWhole: () => Promise<Cast>) {
    this.#store = store;
    this.#openWhole = openWhole;
    byId("benchmark-again").addEventListener("click", () => void this.#run());
    byId("benchmark-copy").addEventListener("click", () => void this.#copy());
    this.#dialog.addEventListener("close", () => this.#running?.abort());
  }

  /** Opens it, and measures. */
  open(): void {
    this.#dialog.showModal();
    void this.#run();
  }

  async #run(): Promise<void> {
    if (!this.#store.state.cast?.model) {
      this.#say("The networks are still being loaded. Try again in a moment.");
      return;
    }
    this.#running?.abort();
    const running = new AbortController();
    this.#running = running;
    this.#setBusy(true);
    try {
      this.#say("Loading the methods …");
      const cast = await this.#openWhole();
      running.signal.throwIfAborted();
      const rows = await runBenchmark(cast, running.signal, (text) => this.#say(`${text} …`));
      this.#show(cast, rows);
    } catch (error) {
      if (running.signal.aborted) return;
      this.#say(`It stopped: ${error instanceof Error ? error.message : String(error)}`);
    } finally {
      if (this.#running === running) {
        this.#running = null;
        this.#setBusy(false);
      }
    }
  }

  #show(cast: Cast, rows: readonly BenchmarkRow[]): void {
    const cell = (tag: "td" | "th", textContent: string) => create(tag, { textContent });
    const head = BENCHMARK_COLUMNS.map(([heading]) => {
      const th = cell("th", heading) as HTMLTableCellElement;
      th.scope = "col";
      return th;
    });
    const lines = rows.map((row) =>
      create(
        "tr",
        { className: row.kind === "dynaskin" ? "own" : "" },
        BENCHMARK_COLUMNS.map(([heading, of], idx) => {
          const made = cell(idx === 0 ? "th" : "td", of(row));
          // A phone has no row of headings.
          made.dataset.heading = heading;
          return made;
        }),
      ),
    );
    byId("benchmark-table").replaceChildren(
      create("thead", {}, [create("tr", {}, head)]),
      create("tbody", {}, lines),
    );
    const facts = [
      `${cast.sex} body of ${cast.body.vertexCount.toLocaleString("en")} vertices; one avatar, one thread, ` +
        "medians of nine rounds of 60 frames of a hop.",
      "Errors: mean distance from the simulation in the soft regions on held-out motions, as each bundle " +
        "states it; only time is measured here.",
      "Narrow: with fewer weights than published, and so no measure of what the published method can do. " +
        "Files are the ONNX form of the networks; the spring bones' file is large because it writes 18 learned " +
        "numbers out as a network over all vertices.",
    ];
    this.#say(facts.join(" "));
    this.#text = benchmarkText(rows, [...facts, navigator.userAgent]);
  }

  async #copy(): Promise<void> {
    if (await copyText(this.#text, "The table is on the clipboard as text.")) this.#dialog.close();
  }

  #say(text: string): void {
    byId("benchmark-note").textContent = text;
  }

  #setBusy(busy: boolean): void {
    // Drawing would be measured, too.
    this.#store.change({ isMeasuring: busy });
    byId("benchmark-table").setAttribute("aria-busy", `${busy}`);
    for (const id of ["benchmark-again", "benchmark-copy"]) {
      byId<HTMLButtonElement>(id).disabled = busy || (id === "benchmark-copy" && this.#text === "");
    }
  }
}
