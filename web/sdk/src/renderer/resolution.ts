/** A longer pause is a hidden tab or a still picture, not a slow one; two in a row are slow pictures. */
const LONGEST_INTERVAL_MS = 1_000;
/** Frames that are judged together, by their median: one stall says nothing. */
const WINDOW_FRAMES = 30;
/** Where frames take this long together, fewer are enough: whoever waits longest is helped first. */
const WINDOW_MS = 1_500;
const LEAST_FRAMES = 5;
/** Shares of the aimed interval beyond which frames are too slow, and below which they are in time. */
const TOO_SLOW = 1.25;
const IN_TIME = 1.1;
/** One step down leaves 70 % of the pixels. */
const STEP = Math.sqrt(0.7);
/** How long frames have to be in time before more pixels are tried; doubles when that was too many. */
const FIRST_WAIT_MS = 2_000;
const LONGEST_WAIT_MS = 60_000;
/** Fewer pixels have to gain this much, or pixels are not what takes the time. */
const LEAST_GAIN = 0.95;
const STEPS_BEFORE_GIVING_UP = 2;

/**
 * Lowers the resolution while frames take too long and raises it again once they are in time. What
 * was raised too early is tried again later and later; where fewer pixels do not help (a display of
 * 30 Hz, a busy processor) the sharp picture comes back. Knows no clock: it is told the time.
 */
export class AdaptiveResolution {
  readonly #aimMs: number;
  readonly #leastScale: number;
  #scale = 1;
  #beforeMs: number | null = null;
  #intervalsMs: number[] = [];
  /** Whether the interval before was longer than {@link LONGEST_INTERVAL_MS}. */
  #pausedBefore = false;
  #changedMs = 0;
  #waitMs = FIRST_WAIT_MS;
  #lastWasUp = false;
  /** Where the present fall began. */
  #fall: { scale: number; medianMs: number; steps: number } | null = null;
  /** Until then fewer pixels are not tried, since they did not help. */
  #givenUpUntilMs = Number.NEGATIVE_INFINITY;

  /**
   * Aims at so many frames a second and goes down to `leastScale` times the pixel ratio. It begins there where the
   * processor draws: the first pictures would otherwise take the longest of all.
   */
  constructor(framesPerSecond = 60, leastScale = 0.5, isDrawnInSoftware = false) {
    this.#aimMs = 1000 / framesPerSecond;
    this.#leastScale = leastScale;
    if (isDrawnInSoftware) this.#scale = leastScale;
  }

  /** What to multiply the pixel ratio by, `leastScale` to 1. */
  get scale(): number {
    return this.#scale;
  }

  /** Notes that a frame begins at `nowMs`; whether {@link scale} changed. */
  frame(nowMs: number): boolean {
    const intervalMs = this.#beforeMs === null ? null : nowMs - this.#beforeMs;
    this.#beforeMs = nowMs;
    if (intervalMs === null) return false;
    const isPause = intervalMs > LONGEST_INTERVAL_MS;
    const isSlow = isPause && this.#pausedBefore;
    this.#pausedBefore = isPause;
    if (isPause && !isSlow) {
      this.#intervalsMs = [];
      return false;
    }
    this.#intervalsMs.push(intervalMs);
    const count = this.#intervalsMs.length;
    const sumMs = this.#intervalsMs.reduce((sum, value) => sum + value, 0);
    const isFull =
      count >= WINDOW_FRAMES || (count >= LEAST_FRAMES && sumMs >= WINDOW_MS) || isSlow;
    if (!isFull) return false;
    const sorted = this.#intervalsMs.sort((a, b) => a - b);
    const medianMs = sorted[Math.floor(count / 2)] ?? 0;
    this.#intervalsMs = [];
    const before = this.#scale;
    if (medianMs > this.#aimMs * TOO_SLOW) this.#lower(medianMs, nowMs);
    else if (medianMs < this.#aimMs * IN_TIME) this.#raise(nowMs);
    if (this.#scale === before) return false;
    this.#changedMs = nowMs;
    return true;
  }

  #lower(medianMs: number, nowMs: number): void {
    if (nowMs < this.#givenUpUntilMs) return;
    if (this.#lastWasUp) {
      this.#waitMs = Math.min(this.#waitMs * 2, LONGEST_WAIT_MS);
      this.#lastWasUp = false;
    }
    const fall = this.#fall ?? { scale: this.#scale, medianMs, steps: 0 };
    this.#fall = fall;
    if (fall.steps >= STEPS_BEFORE_GIVING_UP && medianMs > fall.medianMs * LEAST_GAIN) {
      this.#scale = fall.scale;
      this.#fall = null;
      this.#givenUpUntilMs = nowMs + LONGEST_WAIT_MS;
      return;
    }
    fall.steps += 1;
    this.#scale = Math.max(this.#leastScale, this.#scale * STEP);
  }

  #raise(nowMs: number): void {
    this.#fall = null;
    if (this.#scale === 1 || nowMs - this.#changedMs < this.#waitMs) return;
    // What was raised and held has proved itself.
    if (this.#lastWasUp) this.#waitMs = FIRST_WAIT_MS;
    this.#lastWasUp = true;
    const raised = this.#scale / STEP;
    this.#scale = raised > 0.999 ? 1 : raised;
  }
}
