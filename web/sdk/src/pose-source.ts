import { DynaSkinError } from "./error.js";

/**
 * Where an avatar's poses come from, which decides how they are conditioned before they drive the tissue. The
 * skeleton shows every pose at once.
 *
 * - `display`: the page's own animation, or poses that are held over several frames. If every frame
 *   brings a new pose they are used as given; repeated poses are resampled to their source's clock, with a
 *   latency of one of its intervals.
 * - `tracker`: a webcam or another noisy tracker: noise is removed as well, for another half interval.
 * - `network`: poses that arrive unevenly: evened out, without removing noise.
 * - `as-given`: poses are used as given.
 */
export type PoseSource = "display" | "tracker" | "network" | "as-given";

/** What an avatar has detected about the source of its poses. */
export interface SourceReport {
  /** Whether poses repeat from frame to frame while the body moves. */
  repeats: boolean;
  /** Milliseconds between two new poses; null until poses repeat and their interval is known. */
  intervalMs: number | null;
  /** Jitter of the arrivals beyond that of the display's frames: root mean square, milliseconds. */
  jitterMs: number;
  /** Noise of the joints about each axis, in degrees; 0 if it cannot be distinguished from motion. */
  noiseDegrees: number;
  /** Latency of the tissue in milliseconds, in addition to the sixtieth of a second that it always has. */
  latencyMs: number;
  /** The source that would work better; null if the present one is the best. */
  advice: PoseSource | null;
}

const SOURCES: readonly PoseSource[] = ["display", "tracker", "network", "as-given"];

/**
 * The number of a source in the core.
 *
 * @internal
 */
export function poseSourceIndex(source: PoseSource): number {
  const idx = SOURCES.indexOf(source);
  if (idx >= 0) return idx;
  const known = SOURCES.join(", ");
  throw new DynaSkinError(
    "argument",
    `There is no source of poses ${String(source)}; there are ${known}.`,
  );
}

/**
 * The source with that number.
 *
 * @internal
 */
export function poseSourceOf(idx: number): PoseSource {
  return SOURCES[idx] ?? "display";
}

/**
 * What the core's numbers say.
 *
 * @internal
 */
export function sourceReportOf(numbers: Float64Array): SourceReport {
  const [repeats = 0, interval = 0, jitterMs = 0, latencyMs = 0, noiseDegrees = 0, advice = -1] =
    numbers;
  return {
    repeats: repeats !== 0,
    intervalMs: interval > 0 ? interval : null,
    jitterMs,
    noiseDegrees,
    latencyMs,
    advice: SOURCES[advice] ?? null,
  };
}
