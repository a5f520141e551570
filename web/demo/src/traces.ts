import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { actorLabel, SLOTS } from "./actors.js";
import { byId, create } from "./dom.js";
import type { Shown } from "./state.js";

/** Seconds of motion that the plots show. */
const WINDOW_SECONDS = 4;
/** The least that they show, after a motion has begun. */
const LEAST_WINDOW_SECONDS = 1;
const REDRAW_MS = 80;
const HEIGHT_PX = 104;

/** One moment: of each actor in the order of {@link SLOTS}, in millimetres; null where there is none. */
export interface Sample {
  timeSeconds: number;
  heightMm: (number | null)[];
  errorMm: (number | null)[];
}

const colour = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(name);

/** Two plots over the motion's time: a region's height against the bone, and its error. */
export class Traces {
  readonly #samples: Sample[] = [];
  readonly #plots: { plot: uPlot; key: "heightMm" | "errorMm" }[] = [];
  #shown: readonly Shown[] = [];
  #hasTruth = false;
  #drawnAt = 0;
  #dirty = false;
  /** The ink that the plots are drawn with; style sheets may come after this script. */
  #ink = "";

  constructor() {
    this.#build();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#build());
    new ResizeObserver(() => this.#resize()).observe(byId("plots"));
  }

  /** Says what is plotted: the region and the actors. */
  describe(region: string, shown: readonly Shown[], hasTruth: boolean): void {
    byId("plot-height-title").textContent = `${region}, up and down against the bone (mm)`;
    byId("plot-error-title").textContent = `${region}, mean distance from ground truth (mm)`;
    byId("plot-error").hidden = !hasTruth;
    byId("plot-error-title").hidden = !hasTruth;
    byId("plot-now-error").hidden = !hasTruth;
    this.#shown = shown;
    this.#hasTruth = hasTruth;
    this.#resize();
  }

  /** Adds a moment; the first of a row begins the plots anew. */
  add(sample: Sample, isFirst: boolean): void {
    const last = this.#samples.at(-1);
    if (isFirst) this.#samples.length = 0;
    else if (last && last.timeSeconds >= sample.timeSeconds) this.#samples.pop();
    this.#samples.push(sample);
    const begin = sample.timeSeconds - WINDOW_SECONDS;
    while ((this.#samples[0]?.timeSeconds ?? begin) < begin) this.#samples.shift();
    this.#dirty = true;
  }

  /** The moments that are plotted, oldest first. */
  get samples(): readonly Sample[] {
    return this.#samples;
  }

  /** Draws what has been added, at most some ten times a second. */
  show(nowMs: number): void {
    if (!this.#dirty || byId("plots").hidden || nowMs - this.#drawnAt < REDRAW_MS) return;
    if (colour("--muted") !== this.#ink) this.#build();
    this.#drawnAt = nowMs;
    this.#dirty = false;
    const times = this.#samples.map(({ timeSeconds }) => timeSeconds);
    const [begin, end] = windowOf(times);
    for (const { plot, key } of this.#plots) {
      const lines = SLOTS.map((_, slot) =>
        this.#samples.map((sample) => sample[key][slot] ?? null),
      );
      plot.setData([times, ...lines], false);
      plot.batch(() => {
        plot.setScale("x", { min: begin, max: end });
        plot.setScale("y", rangeOf(lines.flat(), key === "errorMm"));
      });
    }
    this.#showNow(this.#samples.at(-1));
  }

  /** The present values, by name. */
  #showNow(sample: Sample | undefined): void {
    const cell = (value: number | null | undefined) =>
      create("td", { textContent: value == null ? "–" : `${value.toFixed(1)} mm` });
    byId("plot-now").replaceChildren(
      ...this.#shown.map(({ slot, kind }) => {
        const idx = (SLOTS as readonly string[]).indexOf(slot);
        const name = create("span", { className: `of-${slot}`, textContent: actorLabel(kind) });
        return create("tr", {}, [
          create("th", { scope: "row" }, [name]),
          cell(sample?.heightMm[idx]),
          ...(this.#hasTruth ? [cell(sample?.errorMm[idx])] : []),
        ]);
      }),
    );
  }

  #build(): void {
    for (const { plot } of this.#plots) plot.destroy();
    this.#plots.length = 0;
    this.#ink = colour("--muted");
    for (const key of ["heightMm", "errorMm"] as const) {
      const holder = byId(key === "heightMm" ? "plot-height" : "plot-error");
      const axis = {
        stroke: colour("--muted"),
        grid: { stroke: colour("--field-strong"), width: 1 },
        ticks: { show: false },
        font: "11px system-ui, sans-serif",
      };
      const plot = new uPlot(
        {
          width: Math.max(120, holder.clientWidth),
          height: HEIGHT_PX,
          cursor: { show: false },
          legend: { show: false },
          scales: { x: { time: false, auto: false }, y: { auto: false } },
          axes: [
            { ...axis, size: 22, values: (_, ticks) => ticks.map((tick) => `${tick} s`) },
            { ...axis, size: 34, space: 18 },
          ],
          series: [
            {},
            ...SLOTS.map((slot) => ({
              stroke: colour(`--${slot}`),
              width: 1.75,
              points: { show: false },
            })),
          ],
        },
        [[], ...SLOTS.map(() => [])],
        holder,
      );
      this.#plots.push({ plot, key });
    }
    this.#dirty = true;
  }

  #resize(): void {
    for (const { plot, key } of this.#plots) {
      const holder = byId(key === "heightMm" ? "plot-height" : "plot-error");
      const width = holder.clientWidth;
      if (width > 0 && width !== plot.width) plot.setSize({ width, height: HEIGHT_PX });
    }
    this.#dirty = true;
  }
}

/** The part of the motion that is shown: what there is of it, up to the window's length. */
function windowOf(times: readonly number[]): [begin: number, end: number] {
  const end = times.at(-1) ?? 0;
  const begin = Math.max(times[0] ?? 0, end - WINDOW_SECONDS);
  return [begin, Math.max(end, begin + LEAST_WINDOW_SECONDS)];
}

/** A range that shows all values with some room, at least a millimetre or two. */
function rangeOf(values: (number | null)[], fromZero: boolean): { min: number; max: number } {
  const numbers = values.filter((value) => value !== null);
  const most = Math.max(1, ...numbers.map(Math.abs)) * 1.1;
  return { min: fromZero ? 0 : -most, max: most };
}
