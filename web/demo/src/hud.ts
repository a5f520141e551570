import type { Avatar } from "dynaskin";
import { byId, create } from "./dom.js";
import { downloadFacts } from "./downloads.js";

const FRAMES = 120;

/** The median of the last frames. `performance.now()` has coarse steps; medians hide them. */
export class RollingMedian {
  readonly #values: number[] = [];
  #next = 0;

  /** Adds a value, which replaces the oldest. */
  add(value: number): void {
    this.#values[this.#next] = value;
    this.#next = (this.#next + 1) % FRAMES;
  }

  /** The median, or null before the first value. */
  get value(): number | null {
    if (this.#values.length === 0) return null;
    const sorted = [...this.#values].sort((a, b) => a - b);
    return sorted[Math.floor(sorted.length / 2)] ?? null;
  }

  /** Forgets everything. */
  clear(): void {
    this.#values.length = 0;
    this.#next = 0;
  }
}

/** The stages of a frame in the order in which they run, and what the page calls them. */
const STAGES = {
  features: "features",
  predict: "predict",
  decode: "decode",
  apply: "apply + normals",
  upload: "upload",
  render: "skin + draw (submit)",
} as const;

/** A stage of a frame. */
export type Stage = keyof typeof STAGES;

/** The timings card. */
export class Hud {
  readonly #stages = new Map(Object.keys(STAGES).map((key) => [key as Stage, new RollingMedian()]));
  readonly #interval = new RollingMedian();
  readonly #facts = new Map<string, string>();
  #shownAt = 0;

  /** Adds how long a stage took in this frame. */
  add(stage: Stage, milliseconds: number): void {
    this.#stages.get(stage)?.add(milliseconds);
  }

  /** Runs a stage and adds how long it took. */
  timed(stage: Stage, work: () => void): void {
    const start = performance.now();
    work();
    this.add(stage, performance.now() - start);
  }

  /** Adds what an avatar's last step cost, if it ticked. */
  addStep(avatar: Avatar): void {
    if (!avatar.dynamics) return;
    const { featuresMs, predictMs, decodeMs, applyMs, ticks } = avatar.timings;
    if (ticks === 0) return;
    this.add("features", featuresMs);
    this.add("predict", predictMs);
    this.add("decode", decodeMs);
    this.add("apply", applyMs);
  }

  /** Adds the time between two displayed frames. */
  addInterval(milliseconds: number): void {
    this.#interval.add(milliseconds);
  }

  /** A line that is no timing, such as the graphics backend. */
  setFact(name: string, value: string): void {
    this.#facts.set(name, value);
  }

  /** Forgets all timings; they belong to another body or setting. */
  clear(): void {
    for (const median of this.#stages.values()) median.clear();
    this.#interval.clear();
  }

  /** Rewrites the card four times a second. */
  show(now: number): void {
    const card = byId("hud");
    if (card.hidden || now - this.#shownAt < 250) return;
    this.#shownAt = now;
    const rows = this.#rows().flatMap((row) =>
      row
        ? [
            create("dt", { textContent: row[0] }),
            create("dd", { textContent: row[1], title: row[1] }),
          ]
        : [create("div", { className: "group" })],
    );
    byId("hud-rows").replaceChildren(...rows);
  }

  /** The card as plain text, for a bug report. */
  get text(): string {
    const lines = this.#rows().map((row) => (row ? `${row[0]}: ${row[1]}` : ""));
    return ["dynaskin timings (medians of 120 frames)", ...lines, navigator.userAgent].join("\n");
  }

  #rows(): ([string, string] | null)[] {
    const rows: ([string, string] | null)[] = [];
    let sum = 0;
    for (const [stage, median] of this.#stages) {
      const { value } = median;
      if (value !== null && stage !== "upload" && stage !== "render") sum += value;
      rows.push([STAGES[stage], value === null ? "–" : `${value.toFixed(2)} ms`]);
      if (stage === "apply") rows.push(["tissue, together", `${sum.toFixed(2)} ms`], null);
    }
    const interval = this.#interval.value;
    rows.push(["frames per second", interval ? (1000 / interval).toFixed(0) : "–"], null);
    rows.push(...this.#facts, ...downloadFacts());
    return rows;
  }
}
