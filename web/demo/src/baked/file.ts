/**
 * The file of a baked loop: triangles, and what changes over the loop as a few shapes that are mixed. All numbers are
 * whole ones of seven bits a byte, the lowest first; those that may be negative alternate (0, -1, 1, -2, ...). A value
 * of a vertex is stored as its difference from what its neighbours let expect, because neighbours move alike.
 *
 * Order: {@link FORMAT}, frames, vertices, triangles, hundredths of a millimetre in a step of length; the triangles; 18
 * numbers of each palette in thousandths; four tracks, as {@link TRACKS} has them: the still value of every plane and
 * vertex, the count of shapes, each shape likewise, and the shares of the shapes in each frame, which differ from those
 * of the frame before. Nothing follows.
 *
 * A triangle is found across the oldest edge that has one on one side only, and is one number: what its third vertex is,
 * 0 for no triangle, 1 for the next new one, 2 for the newest, 3 for the one before. Where no edge is left, three
 * such numbers begin anew.
 */

/** What a file begins with, which no page that a server sends in its place begins with. */
export const FORMAT = 0xd5b1;

/**
 * The tracks of a file, in order, and one step of each number that a vertex has. Steps of length are multiples of the
 * file's. The distance from the camera is the coarsest: it shows where places move with it, at the picture's edges.
 */
export const TRACKS = {
  /** Where the skin without tissue is: right, up and towards the camera from its target. */
  places: { steps: [1, 1, 2], isLength: true },
  /** How far the skin with tissue is from there. */
  tissue: { steps: [0.7, 0.7, 2], isLength: true },
  /** How much light it has, 1 is white plaster. */
  light: { steps: [1 / 64], isLength: false },
  /** How far from the hem it is: 0 is skin 5 cm from it, 0.5 at it, 1 cloth 5 cm from it; does not change. */
  cloth: { steps: [1 / 160], isLength: false },
} as const;

/** One step of each number of a track, lengths in metres, where the file's step has so many hundredths of a millimetre. */
export function stepsOf(name: keyof typeof TRACKS, hundredths: number): number[] {
  const { steps, isLength } = TRACKS[name];
  return steps.map((step) => (isLength ? step * hundredths * 1e-5 : step));
}

/** One step of a shape's share in a frame. */
export const SHARE_STEP = 1 / 1023;

/** Something that every vertex has, plane by plane, as it changes over the loop. */
export interface Track {
  /** What does not change: one number a plane and vertex, lengths in metres. */
  still: Float32Array;
  /** As many numbers for each shape. */
  shapes: Float32Array[];
  /** How much of each shape there is in each frame: `[frame][shape]` flattened. */
  shares: Float32Array;
}

export interface BakedFile {
  frames: number;
  vertices: number;
  /** Three vertices each, the highest last, in the order of their highest; front faces turn left. */
  triangles: Uint16Array;
  /**
   * Colours of skin and cloth in the light `l`, in the light scheme and in the dark one: red, green and blue of the three
   * factors of 1, l and l².
   */
  palettes: [light: Float32Array, dark: Float32Array];
  tracks: Record<keyof typeof TRACKS, Track>;
}

/**
 * Goes from triangle to triangle: `third` is told the edge of the next one and gives its third vertex, or null if there
 * is none; where no edge is left, `first` gives a whole one. The vertices turn left.
 */
export function walkTriangles(
  count: number,
  vertices: number,
  first: () => [number, number, number],
  third: (from: number, to: number) => number | null,
): [number, number, number][] {
  const open = new Set<number>();
  const walked: [number, number, number][] = [];
  while (walked.length < count) {
    const [edge] = open;
    let triangle: [number, number, number];
    if (edge === undefined) {
      triangle = first();
    } else {
      open.delete(edge);
      // The neighbour runs along the edge the other way.
      const [to, from] = [Math.floor(edge / vertices), edge % vertices];
      const corner = third(from, to);
      if (corner === null) continue;
      triangle = [from, to, corner];
    }
    walked.push(triangle);
    const [a, b, c] = triangle;
    const edges = edge === undefined ? [[a, b] as const] : [];
    for (const [from, to] of [...edges, [b, c] as const, [c, a] as const]) {
      if (!open.delete(to * vertices + from)) open.add(from * vertices + to);
    }
  }
  return walked;
}

/** Triangles with the highest vertex last, in the order of their highest. */
export function byHighest(triangles: readonly [number, number, number][]): Uint16Array {
  const turned = triangles.map(([a, b, c]) =>
    a > b && a > c ? [b, c, a] : b > c ? [c, a, b] : [a, b, c],
  );
  return Uint16Array.from(turned.sort((one, other) => (one[2] ?? 0) - (other[2] ?? 0)).flat());
}

/** For each corner of {@link predictors} what stands for none. */
const NONE = 0xffff;

/**
 * What each triangle lets expect of its highest vertex: its two others and the vertex across their edge, all lower. The
 * four are about a parallelogram.
 */
export function predictors(triangles: Uint16Array, vertices: number): Uint16Array {
  const across = new Map<number, number>();
  const corners = new Uint16Array(triangles.length);
  for (let at = 0; at < triangles.length; at += 3) {
    const [a = 0, b = 0, c = 0] = triangles.subarray(at, at + 3);
    const opposite = across.get(b * vertices + a) ?? NONE;
    corners.set([a, b, opposite < c ? opposite : NONE], at);
    across.set(a * vertices + b, c);
    across.set(b * vertices + c, a);
    across.set(c * vertices + a, b);
  }
  return corners;
}

/** Fills a plane vertex by vertex: `next` is told what the vertices before let expect, in steps. */
export function fillPlane(
  plane: Float32Array,
  triangles: Uint16Array,
  corners: Uint16Array,
  next: (expected: number, vertex: number) => number,
): void {
  let at = 0;
  for (let vertex = 0; vertex < plane.length; vertex += 1) {
    let [sum, count] = [0, 0];
    for (; triangles[at + 2] === vertex; at += 3) {
      const [a = 0, b = 0, opposite = NONE] = corners.subarray(at, at + 3);
      const [one = 0, other = 0] = [plane[a], plane[b]];
      sum += opposite === NONE ? (one + other) / 2 : one + other - (plane[opposite] ?? 0);
      count += 1;
    }
    // Without a triangle the vertex before has to do.
    const expected = count > 0 ? sum / count : (plane[vertex - 1] ?? 0);
    plane[vertex] = next(Math.round(expected), vertex);
  }
}

/** @throws RangeError where the bytes are no such file */
export function readBaked(bytes: Uint8Array): BakedFile {
  let place = 0;
  const count = () => {
    let value = 0;
    for (let factor = 1; ; factor *= 128) {
      const byte = bytes[place];
      if (byte === undefined) throw new RangeError("The baked loop ends too early.");
      place += 1;
      value += (byte & 127) * factor;
      if (byte < 128) return value;
    }
  };
  const signed = () => {
    const value = count();
    return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
  };
  if (count() !== FORMAT) throw new RangeError("This is no baked loop.");
  const [frames, vertices, triangleCount, hundredths] = [count(), count(), count(), count()];
  let newest = -1;
  const corner = (symbol: number) => {
    if (symbol > 1) return newest - symbol + 2;
    newest += 1;
    return newest;
  };
  const walked = walkTriangles(
    triangleCount,
    vertices,
    () => [corner(count()), corner(count()), corner(count())],
    () => {
      const symbol = count();
      return symbol === 0 ? null : corner(symbol);
    },
  );
  const triangles = byHighest(walked);
  const palette = () => Float32Array.from({ length: 18 }, () => signed() / 1000);
  const palettes: BakedFile["palettes"] = [palette(), palette()];
  const corners = predictors(triangles, vertices);
  const values = (steps: readonly number[]) => {
    const all = new Float32Array(steps.length * vertices);
    for (const [plane, step] of steps.entries()) {
      const one = all.subarray(plane * vertices, (plane + 1) * vertices);
      fillPlane(one, triangles, corners, (expected) => expected + signed());
      one.set(one.map((value) => value * step));
    }
    return all;
  };
  const track = (name: keyof typeof TRACKS): Track => {
    const steps = stepsOf(name, hundredths);
    const still = values(steps);
    const shapes = Array.from({ length: count() }, () => values(steps));
    const shares = new Float32Array(frames * shapes.length);
    for (let at = 0; at < shares.length; at += 1) {
      shares[at] = (shares[at - shapes.length] ?? 0) + signed();
    }
    return { still, shapes, shares: shares.map((share) => share * SHARE_STEP) };
  };
  const tracks = {
    places: track("places"),
    tissue: track("tissue"),
    light: track("light"),
    cloth: track("cloth"),
  };
  if (place !== bytes.length) throw new RangeError("The baked loop does not end where it should.");
  return { frames, vertices, triangles, palettes, tracks };
}

/** Weights of four frames around a moment between the middle two: a Catmull-Rom spline. */
function splineWeights(share: number): [number, number, number, number] {
  const [one, two, three] = [share, share * share, share * share * share];
  return [
    (-one + 2 * two - three) / 2,
    (2 - 5 * two + 3 * three) / 2,
    (one + 4 * two - 3 * three) / 2,
    (three - two) / 2,
  ];
}

/** Mixes a track at a moment of the loop, from 0 to 1; the loop's end is its beginning. */
export function mix(track: Track, frames: number, moment: number, out: Float32Array): void {
  const at = (((moment % 1) + 1) % 1) * frames;
  const frame = Math.floor(at);
  const weights = splineWeights(at - frame);
  out.set(track.still);
  for (const [idx, shape] of track.shapes.entries()) {
    const share = weights.reduce((sum, weight, ahead) => {
      const row = (frame + ahead - 1 + frames) % frames;
      return sum + weight * (track.shares[row * track.shapes.length + idx] ?? 0);
    }, 0);
    for (let vertex = 0; vertex < out.length; vertex += 1) {
      out[vertex] = (out[vertex] ?? 0) + share * (shape[vertex] ?? 0);
    }
  }
}
