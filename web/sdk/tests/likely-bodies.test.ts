// What the demo's sliders can reach: bodies that people have, and tissue that neither tears nor folds.
import { readFileSync } from "node:fs";
import { Motion, POSE_LENGTH, type ProceduralName, REGION_NAMES } from "dynaskin";
import { describe, expect, test } from "vitest";
import {
  STRENGTH,
  TISSUE_FACTORS,
  type TissueProperty,
  type TissueSettings,
  tuneTissue,
} from "../../demo/src/tissue.js";
import type { Trait } from "../../demo/src/traits.js";
import { figureOf, randomWords } from "../../demo/src/words.js";
import { loadModel, modelFolder } from "./support.js";

const TRAITS = JSON.parse(readFileSync(new URL("traits.json", modelFolder()), "utf8")) as Trait[];

/** The same numbers in every run (Mulberry32). */
function seeded(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let bits = Math.imul(state ^ (state >>> 15), 1 | state);
    bits = (bits + Math.imul(bits ^ (bits >>> 7), 61 | bits)) ^ bits;
    return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
  };
}

describe("likely bodies", () => {
  test("random bodies differ in weight and age", async () => {
    const avatar = (await loadModel()).body.createAvatar();
    const random = seeded(11);
    const bodies = Array.from({ length: 60 }, () => {
      avatar.setShape(figureOf(randomWords(TRAITS, random)));
      return avatar.figure;
    });
    const spreadOf = (name: "weightKg" | "age") => {
      const values = bodies.map((figure) => figure?.[name] ?? 0).toSorted((a, b) => a - b);
      return (values[54] ?? 0) - (values[6] ?? 0);
    };
    expect(spreadOf("weightKg")).toBeGreaterThan(20);
    expect(spreadOf("age")).toBeGreaterThan(20);
  });
});

const SHAPES = 50;
/** Settings of the tissue that each of the shapes gets, in one run of its motion. */
const SETTINGS_EACH = 10;
/** A body that has another shape stands still at first: so long until its tissue swings. */
const WARM_UP_TICKS = 40;
const TICKS_EACH = 4;
const TICK_SECONDS = 1 / 60;
/** Shorter edges of the mesh are left out of the strain, in metres. */
const LEAST_EDGE_M = 0.003;

/** Lengths of the edges of triangles, in metres. */
function edgeLengths(faces: Uint32Array, positions: Float32Array): Float32Array {
  const lengths = new Float32Array(faces.length);
  for (let at = 0; at < faces.length; at += 1) {
    const a = 3 * (faces[at] ?? 0);
    const b = 3 * (faces[at % 3 === 2 ? at - 2 : at + 1] ?? 0);
    const dx = (positions[a] ?? 0) - (positions[b] ?? 0);
    const dy = (positions[a + 1] ?? 0) - (positions[b + 1] ?? 0);
    const dz = (positions[a + 2] ?? 0) - (positions[b + 2] ?? 0);
    lengths[at] = Math.sqrt(dx * dx + dy * dy + dz * dz);
  }
  return lengths;
}

/** Normals of all triangles, as long as the triangles are large: `[face][x, y, z]`. */
function faceNormals(faces: Uint32Array, positions: Float32Array): Float32Array {
  const normals = new Float32Array(faces.length);
  const [u, v] = [new Float32Array(3), new Float32Array(3)] as const;
  for (let at = 0; at < faces.length; at += 3) {
    for (let axis = 0; axis < 3; axis += 1) {
      const origin = positions[3 * (faces[at] ?? 0) + axis] ?? 0;
      u[axis] = (positions[3 * (faces[at + 1] ?? 0) + axis] ?? 0) - origin;
      v[axis] = (positions[3 * (faces[at + 2] ?? 0) + axis] ?? 0) - origin;
    }
    const [ux = 0, uy = 0, uz = 0] = u;
    const [vx = 0, vy = 0, vz = 0] = v;
    normals[at] = uy * vz - uz * vy;
    normals[at + 1] = uz * vx - ux * vz;
    normals[at + 2] = ux * vy - uy * vx;
  }
  return normals;
}

/**
 * How many vertices' stars have turned inside out: their triangles together face away from where they faced. The
 * vertices' own normals tell less, because in a crease they hardly point anywhere.
 */
function countInverted(faces: Uint32Array, now: Float32Array, before: Float32Array): number {
  const facing = new Map<number, number>();
  for (let at = 0; at < faces.length; at += 3) {
    const turned =
      (now[at] ?? 0) * (before[at] ?? 0) +
      (now[at + 1] ?? 0) * (before[at + 1] ?? 0) +
      (now[at + 2] ?? 0) * (before[at + 2] ?? 0);
    for (const corner of faces.subarray(at, at + 3)) {
      facing.set(corner, (facing.get(corner) ?? 0) + turned);
    }
  }
  return [...facing.values()].filter((sum) => sum < 0).length;
}

/** A random choice of all that the page's sliders say of the tissue. */
function randomTissue(random: () => number): TissueSettings {
  const factor = ([low, , high]: readonly [number, number, number]) => {
    const least = Math.max(low, 0.1);
    return least * (high / least) ** random();
  };
  const perRegion = (property: TissueProperty) =>
    Object.fromEntries(REGION_NAMES.map((region) => [region, factor(TISSUE_FACTORS[property])]));
  return {
    preset: random() < 0.5 ? "sportswear" : "as-predicted",
    strength: STRENGTH[2] * random(),
    tissue: {
      gain: perRegion("gain"),
      stiffness: perRegion("stiffness"),
      damping: perRegion("damping"),
    },
  };
}

describe.each<ProceduralName>(["jump", "hop", "jumping-jacks", "shake-hips"])("%s", (name) => {
  test(`${SHAPES * SETTINGS_EACH} random settings leave the skin whole`, async () => {
    const model = await loadModel();
    const { faces } = model.body;
    const avatar = model.createAvatar();
    const still = model.body.createAvatar();
    const random = seeded(name.length);
    const pose = new Float64Array(POSE_LENGTH);
    let [largestStrain, largestOffsetM, inverted] = [0, 0, 0];
    for (let shape = 0; shape < SHAPES; shape += 1) {
      const figure = figureOf(randomWords(TRAITS, random));
      avatar.setShape(figure);
      still.setShape(figure);
      const motion = Motion.procedural(name, avatar);
      let timeSeconds = 1 + 4 * random();
      const play = (ticks: number) => {
        for (let tick = 0; tick < ticks; tick += 1) {
          motion.poseAt(timeSeconds, pose);
          avatar.step(pose, TICK_SECONDS);
          timeSeconds += TICK_SECONDS;
        }
      };
      play(WARM_UP_TICKS);
      const lengths = edgeLengths(faces, still.positions);
      const normalsBefore = faceNormals(faces, still.positions);
      for (let setting = 0; setting < SETTINGS_EACH; setting += 1) {
        tuneTissue(avatar, randomTissue(random));
        play(TICKS_EACH);
        for (const [edge, length] of edgeLengths(faces, avatar.positions).entries()) {
          const before = lengths[edge] ?? 0;
          if (before < LEAST_EDGE_M) continue;
          largestStrain = Math.max(largestStrain, Math.abs(length / before - 1));
        }
        inverted += countInverted(faces, faceNormals(faces, avatar.positions), normalsBefore);
        for (const offset of avatar.offsets) {
          largestOffsetM = Math.max(largestOffsetM, Math.abs(offset));
        }
      }
      motion.dispose();
    }
    console.log(
      `${name}: largest edge strain ${largestStrain.toFixed(2)}, ${inverted} stars inverted, largest ` +
        `offset ${(1000 * largestOffsetM).toFixed(0)} mm`,
    );
    expect(largestOffsetM).toBeGreaterThan(0.02);
    expect(inverted).toBe(0);
    expect(largestStrain).toBeLessThan(1);
  }, 300_000);
});
