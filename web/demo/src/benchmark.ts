import { type Avatar, Motion, POSE_LENGTH, SHAPE_LENGTH } from "dynaskin";
import { trainingOf } from "./about.js";
import { type ActorKind, actorLabel, isMethod, methodsOf } from "./actors.js";
import type { Cast } from "./cast.js";
import { heldOut } from "./measured.js";

/** Frames that are timed in one go; browsers' clocks step by up to a tenth of a millisecond. */
const FRAMES_A_ROUND = 60;
/** Every method has its turn in each round, so that a machine that slows down slows all of them. */
const ROUNDS = 9;
const DT_SECONDS = 1 / 60;
const AVERAGE = new Array<number>(SHAPE_LENGTH).fill(0);

/** What was found out about one method. */
export interface BenchmarkRow {
  kind: ActorKind;
  label: string;
  /** Milliseconds of one frame of one avatar: features, networks, positions and normals. */
  frameMs: number;
  /** Kilobytes of its networks as they are stored; null where the browser does not tell. */
  networksKb: number | null;
  /** Numbers that were learned; null where the bundle does not tell. */
  parameters: number | null;
  /** Frames that it learned from; null where the bundle does not tell. */
  frames: number | null;
  /** Mean error in the soft regions on held-out motions, in millimetres; null: not measured. */
  errorMm: number | null;
  /** The same over that of plain skinning; null: not measured. */
  errorShare: number | null;
}

/**
 * Measures every method of a body on this machine: plain skinning, each bundle that there is, and
 * dynaskin. Errors are those that the bundles state; nothing is measured here but time.
 *
 * @param onProgress - called with a sentence on what is being done
 * @throws what a download throws, or the reason of an aborted signal
 */
export async function runBenchmark(
  cast: Cast,
  signal: AbortSignal,
  onProgress: (text: string) => void,
): Promise<BenchmarkRow[]> {
  const kinds = ["linear", ...methodsOf(cast.sex), "dynaskin"];
  for (const kind of kinds) {
    onProgress(`Loading ${actorLabel(kind)}`);
    await cast.prepare(kind, { signal, onProgress: () => {} });
  }
  const avatars = kinds.map((kind) => cast.createAvatar(kind, AVERAGE));
  try {
    const times = await timeAll(avatars, signal, onProgress);
    return kinds.map((kind, idx) => ({ ...describe(cast, kind), frameMs: median(times[idx]) }));
  } finally {
    for (const avatar of avatars) avatar.dispose();
  }
}

/** Milliseconds a frame of each avatar, by round. */
async function timeAll(
  avatars: readonly Avatar[],
  signal: AbortSignal,
  onProgress: (text: string) => void,
): Promise<number[][]> {
  const [first] = avatars;
  if (!first) return [];
  const motion = Motion.procedural("hop", first);
  const poses = Array.from({ length: FRAMES_A_ROUND }, (_, frame) =>
    // Beyond the standing still at the beginning.
    motion.poseAt(1 + frame * DT_SECONDS, new Float64Array(POSE_LENGTH)),
  );
  motion.dispose();
  const times: number[][] = avatars.map(() => []);
  // The first round only warms up.
  for (let round = 0; round <= ROUNDS; round += 1) {
    onProgress(round === 0 ? "Warming up" : `Measuring, round ${round} of ${ROUNDS}`);
    for (const [idx, avatar] of avatars.entries()) {
      await nextTask();
      signal.throwIfAborted();
      const start = performance.now();
      for (const pose of poses) avatar.step(pose, DT_SECONDS);
      if (round > 0) times[idx]?.push((performance.now() - start) / FRAMES_A_ROUND);
    }
  }
  return times;
}

/** Lets the browser draw and answer. */
function nextTask(): Promise<void> {
  return new Promise((done) => setTimeout(done));
}

function median(values: readonly number[] = []): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? Number.NaN;
}

function describe(cast: Cast, kind: ActorKind): Omit<BenchmarkRow, "frameMs"> {
  const row = { kind, label: actorLabel(kind) };
  const bundle = cast.bundleOf(kind);
  if (!bundle) {
    // Plain skinning is what all bundles of a body are compared with.
    const own = cast.bundleOf("dynaskin");
    const staticMm = own ? (heldOut(own)?.staticMm ?? null) : null;
    const errorShare = staticMm === null ? null : 1;
    return { ...row, networksKb: 0, parameters: 0, frames: 0, errorMm: staticMm, errorShare };
  }
  const folder = isMethod(kind) ? `${cast.sex}/methods/${kind}/` : `${cast.sex}/`;
  const sizes = [bundle.predictor.file, bundle.decoder.file].map((file) =>
    fileBytes(new URL(folder + file, document.baseURI)),
  );
  const total = sizes.reduce<number | null>(
    (sum, size) => (sum === null || size === null ? null : sum + size),
    0,
  );
  const unseen = heldOut(bundle);
  const { parameters = null, frames = null } = trainingOf(bundle);
  return {
    ...row,
    parameters,
    frames,
    networksKb: total === null ? null : total / 1000,
    errorMm: unseen?.errorMm ?? null,
    errorShare: unseen ? unseen.errorMm / unseen.staticMm : null,
  };
}

/** Bytes of a file that the page has loaded, unpacked; null where the browser does not tell. */
function fileBytes(address: URL): number | null {
  const [entry] = performance.getEntriesByName(address.href, "resource");
  const size = (entry as PerformanceResourceTiming | undefined)?.decodedBodySize ?? 0;
  return size > 0 ? size : null;
}

const count = (value: number | null) => {
  if (value === 0) return "none";
  return value === null ? "not told" : value.toLocaleString("en");
};

/** The columns: heading, and the cell of a row. */
export const BENCHMARK_COLUMNS: readonly [string, (row: BenchmarkRow) => string][] = [
  ["Method", ({ label }) => label],
  ["ms a frame", ({ frameMs }) => frameMs.toFixed(frameMs < 0.1 ? 3 : 2)],
  [
    "Files",
    ({ kind, networksKb }) => {
      if (kind === "linear") return "none";
      return networksKb === null ? "not told" : `${Math.round(networksKb).toLocaleString("en")} KB`;
    },
  ],
  ["Parameters", ({ parameters }) => count(parameters)],
  ["Frames learned from", ({ frames }) => count(frames)],
  [
    "Held-out error",
    ({ errorMm }) => (errorMm === null ? "not measured" : `${errorMm.toFixed(2)} mm`),
  ],
  [
    "Error over plain skinning",
    ({ errorShare }) => (errorShare === null ? "–" : `${Math.round(100 * errorShare)} %`),
  ],
];

/** The table as text, with what it was measured on. */
export function benchmarkText(rows: readonly BenchmarkRow[], facts: readonly string[]): string {
  const table = [
    BENCHMARK_COLUMNS.map(([heading]) => heading),
    ...rows.map((row) => BENCHMARK_COLUMNS.map(([, cell]) => cell(row))),
  ];
  const widths = BENCHMARK_COLUMNS.map((_, column) =>
    Math.max(...table.map((cells) => cells[column]?.length ?? 0)),
  );
  const line = (cells: readonly string[]) =>
    cells
      .map((cell, column) =>
        column === 0 ? cell.padEnd(widths[0] ?? 0) : cell.padStart(widths[column] ?? 0),
      )
      .join("  ");
  return [...table.map(line), "", ...facts].join("\n");
}
