import { DynaSkinError } from "./error.js";

/**
 * Where an avatar's poses come from, which decides what is done to them before the tissue feels them. The
 * skeleton shows every pose at once.
 *
 * - `display`: the page's own animation, or poses that are held over several frames. Where every frame
 *   brings a new pose nothing is done; poses that repeat are put on their source's clock, one of its
 *   intervals late.
 * - `tracker`: a webcam's or another noisy tracker: noise is taken off as well, half an interval later.
 * - `network`: poses that arrive unevenly: evened out, noise is left alone.
 * - `as-given`: nothing is done to any pose.
 */
export type PoseSource = "display" | "tracker" | "network" | "as-given";

/** What an avatar found out about the source of its poses. */
export interface SourceReport {
  /** Whether poses repeat from frame to frame while the body moves. */
  repeats: boolean;
  /** Milliseconds between two new poses; null until poses repeat and their interval is known. */
  intervalMs: number | null;
  /** How unevenly poses arrive, beyond what the display's frames explain: root mean square, milliseconds. */
  jitterMs: number;
  /** Noise of the joints along each axis, in degrees; 0 where there is no more of it than bodies move. */
  noiseDegrees: number;
  /** Milliseconds by which the tissue is behind the poses, beside the sixtieth of a second that it always is. */
  latencyMs: number;
  /** The source to set that would help; null where the one that is set is the best. */
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
