// What the demo plays before its core is there: the story's jump, taken from the live picture as the places and the
// light of the vertices that are seen in it (web/demo/src/baked/file.ts has the format).
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { NodeIO } from "@gltf-transform/core";
import { DEMO, ROOT } from "../lib/paths.mjs";
import { say } from "../lib/run.mjs";
import { bodyOf, record, surfacesAt } from "./baked-page.mjs";
import { lowRank } from "./low-rank.mjs";
import { open } from "./open.mjs";

const FOLDER = join(DEMO, "src", "baked");
/** The widest and the tallest picture that a loop is for; how much larger what a pixel shows is there than in the first. */
const VIEWPORTS = {
  wide: { width: 1728, height: 720, coarser: 1 },
  tall: { width: 500, height: 1110, coarser: 1.3 },
};
/** Frames of the loop; the page plays a spline through them. */
const FRAMES = 50;
/** Every how many of them is taken in the dark scheme too, where the same light has other colours. */
const DARK_EVERY = 10;
/** The file's step of length, in hundredths of a millimetre: half of what a pixel shows of the body. */
const STEP_HUNDREDTHS = 50;
/** Root mean squares that are left out, in steps of the file. */
const TOLERANCES = { places: 0.5, tissue: 0.35, light: 0.9, cloth: 0 };
/** A value that is off by no more of a step than this is left as its neighbours let expect it. */
const ROUNDED_OFF = 0.6;
/** How often light is spread to the neighbours. */
const LIGHT_ROUNDS = 1;
/** Linear reflectances of plaster and of dyed plaster (crates/render/src/look.rs), to tell light from colour. */
const ALBEDO = { skin: 0.537, cloth: 0.17 };
/** Cloth has more blue than this much of its red; skin has less, also in a shadow, which is bluish. */
const BLUE = 1.12;
/** Vertices with more of the other than this are of neither colour. */
const PURE = 0.05;

/** Chromium with WebGPU in software, which hands back what it has drawn. */
const WEBGPU = [
  "--no-sandbox",
  "--disable-quic",
  "--enable-unsafe-webgpu",
  "--use-webgpu-adapter=swiftshader",
  "--enable-features=Vulkan",
  "--use-vulkan=swiftshader",
  "--use-angle=swiftshader",
  "--disable-gpu-watchdog",
];
/** Nobody looks at its pictures. */
const SMALL = { width: 240, height: 135 };

/** Writes web/demo/src/baked/loop-wide.bin and loop-tall.bin; `launch` starts a browser with arguments. */
export async function makeBaked(browser, url, launch) {
  const { runnerImport } = await import("vite");
  const codec = (await runnerImport(join(FOLDER, "file.ts"))).module;
  const { jump, surfaces } = await takeSurfaces(await launch(WEBGPU), url);
  const paths = [];
  for (const [name, { coarser, ...viewport }] of Object.entries(VIEWPORTS)) {
    const page = await open(browser, url, "chapter=look&backend=webgl2", viewport, true);
    const { faces, colors } = await page.evaluate(bodyOf);
    const cloth = clothShares(colors);
    const hems = await hemDistances(cloth);
    const take = async (idx) => {
      const moment = { timeSeconds: momentOf(jump, idx), ...surfaces[idx] };
      return unpacked(await page.evaluate(record, moment));
    };
    const frames = [];
    for (const idx of surfaces.keys()) frames.push(await take(idx));
    await page.emulateMedia({ colorScheme: "dark", reducedMotion: "reduce" });
    const dark = [];
    for (let idx = 0; idx < FRAMES; idx += DARK_EVERY) dark.push([idx, await take(idx)]);
    await page.close();
    const bytes = encode(codec, bake(codec, { frames, dark, faces, cloth, hems, coarser }));
    const path = join(FOLDER, `loop-${name}.bin`);
    writeFileSync(path, bytes);
    paths.push(path);
  }
  return paths.join(", ");
}

const momentOf = ({ fromSeconds, periodSeconds }, frame) =>
  fromSeconds + (frame / FRAMES) * periodSeconds;

/** Where the vertices are in each frame of the loop; closes the browser. */
async function takeSurfaces(browser, url) {
  try {
    const page = await open(browser, url, "chapter=look&backend=webgpu", SMALL, true);
    const { jump } = await page.evaluate(() => ({ jump: window.dynaskinDemo.jump }));
    const surfaces = [];
    for (let frame = 0; frame < FRAMES; frame += 1) {
      surfaces.push(await page.evaluate(surfacesAt, momentOf(jump, frame)));
    }
    return { jump, surfaces };
  } finally {
    await browser.close();
  }
}

function unpacked({ plain, soft, colours, seen }) {
  const bytes = (text) => new Uint8Array(Buffer.from(text, "base64"));
  const floats = (text) => new Float32Array(bytes(text).buffer);
  return {
    plain: floats(plain),
    soft: floats(soft),
    colours: bytes(colours),
    seen: bytes(seen),
  };
}

/** How much of each vertex is cloth: of the two colours that most vertices have, the one with more blue. */
function clothShares(colors) {
  const counts = new Map();
  for (let at = 0; at < colors.length; at += 4) {
    const key = colors.slice(at, at + 3).join();
    counts.set(key, (counts.get(key) ?? 0) + 1);
  }
  const [first, second] = [...counts]
    .sort(([, a], [, b]) => b - a)
    .slice(0, 2)
    .map(([key]) => key.split(",").map(Number))
    .sort(([ar, , ab], [br, , bb]) => br - bb - (ar - ab));
  const way = first.map((value, axis) => second[axis] - value);
  const length = way.reduce((sum, value) => sum + value * value, 0);
  return Float32Array.from({ length: colors.length / 4 }, (_, vertex) => {
    const along = way.reduce(
      (sum, value, axis) => sum + value * (colors[4 * vertex + axis] - first[axis]),
      0,
    );
    return Math.max(0, Math.min(1, along / length));
  });
}

/**
 * How far each vertex is from the hem, as the body's file has it for any viewer: 0.5 at the hem, more in cloth, where
 * `cloth` tells which side that is.
 */
async function hemDistances(cloth) {
  const glb = readFileSync(join(ROOT, "models", "female", "body.glb"));
  const { json, resources } = await new NodeIO().binaryToJSON(new Uint8Array(glb));
  const { attributes } = json.meshes[0].primitives[0];
  const { bufferView, count } = json.accessors[attributes.TEXCOORD_0];
  const { byteOffset, byteLength } = json.bufferViews[bufferView];
  const texels = new Uint16Array(
    resources["@glb.bin"].slice(byteOffset, byteOffset + byteLength).buffer,
  );
  const shares = Float32Array.from({ length: count }, (_, vertex) => texels[2 * vertex] / 65535);
  const alike = shares.reduce(
    (sum, share, vertex) => sum + (share - 0.5) * (cloth[vertex] - 0.5),
    0,
  );
  return alike < 0 ? shares.map((share) => 1 - share) : shares;
}

const linear = (value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);

/** How much light a colour of the picture has, so that both colours of the body agree. */
function lightOf([r, g, b], isCloth) {
  const sum = 0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
  return Math.sqrt(sum / (isCloth ? ALBEDO.cloth : ALBEDO.skin));
}

/** The vertices that are seen, renumbered along their triangles, and what they do. */
function bake(codec, { frames, dark, faces, cloth, hems, coarser }) {
  const seen = Uint8Array.from(cloth, (_, vertex) => frames.some((f) => f.seen[vertex]) && 1);
  const kept = [];
  for (let at = 0; at < faces.length; at += 3) {
    const corners = faces.slice(at, at + 3);
    if (corners.some((vertex) => seen[vertex])) kept.push(corners);
  }
  const { order, symbols, triangles } = renumbered(kept, cloth.length, codec);
  const count = order.length;
  const isCloth = order.map((vertex) => cloth[vertex] > 0.5);
  const isPure = order.map((vertex) => Math.abs(cloth[vertex] - 0.5) > 0.5 - PURE);
  const colourOf = (frame, idx) => frame.colours.subarray(3 * order[idx], 3 * order[idx] + 3);
  const isSampled = (frame, idx) => {
    if (!frame.seen[order[idx]] || !isPure[idx]) return false;
    const [r, , b] = colourOf(frame, idx);
    return isCloth[idx] === b > BLUE * r;
  };
  const light = frames.map((frame) =>
    Float32Array.from(order, (_, idx) =>
      isSampled(frame, idx) ? lightOf(colourOf(frame, idx), isCloth[idx]) : Number.NaN,
    ),
  );
  const palettes = [[...frames.entries()], dark].map((shown) =>
    [false, true].flatMap((wantsCloth) => {
      const samples = [];
      for (const [idx, frame] of shown) {
        for (let at = 0; at < count; at += 7) {
          const isKnown = isSampled(frame, at) && !Number.isNaN(light[idx][at]);
          if (isCloth[at] === wantsCloth && isKnown) {
            samples.push([light[idx][at], colourOf(frame, at)]);
          }
        }
      }
      return quadratic(samples);
    }),
  );
  const neighbours = neighboursOf(count, triangles);
  fillIn(light, neighbours);
  // A shadow's edge between two vertices is somewhere on the way, and would fray.
  const soft = light.map((frame) => smoothed(frame, neighbours, LIGHT_ROUNDS));
  const hundredths = Math.round(coarser * STEP_HUNDREDTHS);
  const track = (name, frames) => {
    const steps = codec.stepsOf(name, hundredths);
    const inSteps = frames.map((frame) =>
      frame.map((value, at) => value / steps[Math.floor(at / count)]),
    );
    return lowRank(inSteps, TOLERANCES[name]);
  };
  const planes = (of) => frames.map((frame) => planesOf(order, (vertex) => of(frame, vertex)));
  return {
    ...{ frames: frames.length, vertices: count, hundredths, symbols, triangles, palettes },
    tracks: {
      places: track(
        "places",
        planes(({ plain }, vertex) => plain.subarray(3 * vertex, 3 * vertex + 3)),
      ),
      tissue: track(
        "tissue",
        planes(({ plain, soft }, vertex) =>
          [0, 1, 2].map((axis) => soft[3 * vertex + axis] - plain[3 * vertex + axis]),
        ),
      ),
      light: track("light", soft),
      // It does not change.
      cloth: track("cloth", [Float32Array.from(order, (vertex) => hems[vertex])]),
    },
  };
}

function planesOf(order, valuesOf) {
  const count = order.length;
  const out = new Float32Array(3 * count);
  for (const [idx, vertex] of order.entries()) {
    for (const [axis, value] of [...valuesOf(vertex)].entries()) out[axis * count + idx] = value;
  }
  return out;
}

/** Numbers vertices as a walk from triangle to triangle meets them, and notes the walk. */
function renumbered(faces, vertices, { walkTriangles, byHighest }) {
  const thirds = new Map();
  for (const [a, b, c] of faces) {
    for (const [from, to, third] of [
      [a, b, c],
      [b, c, a],
      [c, a, b],
    ]) {
      thirds.set(from * vertices + to, third);
    }
  }
  const numbers = new Map();
  const order = [];
  const symbols = [];
  const corner = (vertex) => {
    const known = numbers.get(vertex);
    symbols.push(known === undefined ? 1 : order.length - 1 - known + 2);
    if (known === undefined) {
      numbers.set(vertex, order.length);
      order.push(vertex);
    }
    return numbers.get(vertex);
  };
  const left = new Map(faces.map((face) => [face.toSorted().join(), face]));
  const take = (face) => left.delete(face.toSorted().join());
  const walked = walkTriangles(
    faces.length,
    vertices,
    () => {
      const [face] = left.values();
      take(face);
      return face.map(corner);
    },
    (from, to) => {
      const [a, b] = [order[from], order[to]];
      const third = thirds.get(a * vertices + b);
      if (third === undefined || !take([a, b, third])) {
        symbols.push(0);
        return null;
      }
      return corner(third);
    },
  );
  return { order, symbols, triangles: byHighest(walked) };
}

const edgesOf = ([a, b, c]) => [
  [a, b],
  [b, c],
  [c, a],
];

/** The three factors of 1, l and l² for red, green and blue that are nearest to the samples, thousandths of 1. */
function quadratic(samples) {
  const normal = Array.from({ length: 3 }, () => new Float64Array(6));
  for (const [light, colour] of samples) {
    const powers = [1, light, light * light];
    for (const [row, power] of powers.entries()) {
      for (let at = 0; at < 3; at += 1) {
        normal[row][at] += power * powers[at];
        normal[row][3 + at] += (power * colour[at]) / 255;
      }
    }
  }
  for (let pivot = 0; pivot < 3; pivot += 1) {
    for (let row = 0; row < 3; row += 1) {
      if (row === pivot) continue;
      const factor = normal[row][pivot] / normal[pivot][pivot];
      for (let at = 0; at < 6; at += 1) normal[row][at] -= factor * normal[pivot][at];
    }
  }
  return normal.flatMap((row, idx) => [...row.subarray(3)].map((value) => value / row[idx]));
}

function neighboursOf(count, triangles) {
  const neighbours = Array.from({ length: count }, () => new Set());
  for (let at = 0; at < triangles.length; at += 3) {
    for (const [a, b] of edgesOf([...triangles.subarray(at, at + 3)])) {
      neighbours[a].add(b);
      neighbours[b].add(a);
    }
  }
  return neighbours.map((around) => [...around]);
}

/** Values of vertices, each round half its own and half its neighbours'. */
function smoothed(values, neighbours, rounds) {
  let now = values;
  for (let round = 0; round < rounds; round += 1) {
    const before = now;
    now = before.map(
      (value, vertex) =>
        0.5 * value +
        0.5 *
          neighbours[vertex].reduce(
            (sum, other) => sum + before[other] / neighbours[vertex].length,
            0,
          ),
    );
  }
  return now;
}

/** Light where none was seen: of the frames before and after, or of neighbours. */
function fillIn(light, neighbours) {
  const count = light[0].length;
  const frames = light.length;
  const unknown = [];
  for (let vertex = 0; vertex < count; vertex += 1) {
    const known = light.flatMap((frame, idx) => (Number.isNaN(frame[vertex]) ? [] : [idx]));
    if (known.length === 0) {
      unknown.push(vertex);
      continue;
    }
    for (const [idx, frame] of light.entries()) {
      if (!Number.isNaN(frame[vertex])) continue;
      const ahead = (other) => (other - idx + frames) % frames;
      const next = known.reduce((best, other) => (ahead(other) < ahead(best) ? other : best));
      const last = known.reduce((best, other) => (ahead(other) > ahead(best) ? other : best));
      const [after, before] = [ahead(next), frames - ahead(last)];
      // Filled frames are not among the known ones.
      frame[vertex] =
        (light[next][vertex] * before + light[last][vertex] * after) / (before + after);
    }
  }
  let left = unknown;
  while (left.length > 0) {
    const lit = left.map((vertex) => [
      vertex,
      neighbours[vertex].filter((other) => !Number.isNaN(light[0][other])),
    ]);
    const ready = lit.filter(([, from]) => from.length > 0);
    if (ready.length === 0) throw new Error("A part of the body is never seen.");
    for (const frame of light) {
      const means = ready.map(([, from]) =>
        from.reduce((sum, other) => sum + frame[other] / from.length, 0),
      );
      for (const [idx, [vertex]] of ready.entries()) frame[vertex] = means[idx];
    }
    left = lit.filter(([, from]) => from.length === 0).map(([vertex]) => vertex);
  }
}

/** The file's bytes. */
function encode({ FORMAT, TRACKS, SHARE_STEP, fillPlane, predictors }, baked) {
  const { frames, vertices, hundredths, symbols, triangles, palettes, tracks } = baked;
  const bytes = [];
  const count = (value) => {
    let left = value;
    for (; left >= 128; left = Math.floor(left / 128)) bytes.push((left & 127) | 128);
    bytes.push(left);
  };
  const signed = (value) => count(value < 0 ? -2 * value - 1 : 2 * value);
  for (const value of [FORMAT, frames, vertices, triangles.length / 3, hundredths]) count(value);
  for (const symbol of symbols) count(symbol);
  for (const value of palettes.flat()) signed(Math.round(1000 * value));
  const corners = predictors(triangles, vertices);
  const say1 = (name, from) => say(`    ${name}: ${bytes.length - from} bytes`);
  const values = (all) => {
    for (let from = 0; from < all.length; from += vertices) {
      fillPlane(new Float32Array(vertices), triangles, corners, (expected, vertex) => {
        const off = all[from + vertex] - expected;
        const change = Math.sign(off) * Math.max(0, Math.ceil(Math.abs(off) - ROUNDED_OFF));
        signed(change);
        return expected + change;
      });
    }
  };
  say1(`${vertices} vertices, ${triangles.length / 3} triangles`, 0);
  for (const name of Object.keys(TRACKS)) {
    const from = bytes.length;
    const { still, shapes, shares } = tracks[name];
    values(still);
    count(shapes.length);
    for (const shape of shapes) values(shape);
    let before = shapes.map(() => 0);
    for (const row of shares) {
      const now = row.map((share) => Math.round(share / SHARE_STEP));
      for (const [idx, value] of now.entries()) signed(value - before[idx]);
      before = now;
    }
    say1(`${name}, ${shapes.length} shapes`, from);
  }
  return Uint8Array.from(bytes);
}
