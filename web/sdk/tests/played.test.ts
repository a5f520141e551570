// A binding played in WebAssembly gives the numbers of the native crate: crates/binding/tests/played.rs.
import { readFileSync, writeFileSync } from "node:fs";
import type { Model } from "dynaskin";
import { Binding, bindAvatar } from "dynaskin/three";
import * as THREE from "three";
import { expect, it } from "vitest";
import { makeInThree } from "../../../tests/avatars/made.js";
import { loadModel } from "./support.js";

interface Played {
  vertices: number;
  /** Vertex, x, y, z in the mesh's own unit. */
  offsets: [number, number, number, number][];
}

/** The generated classes, which are no part of what the package gives. */
interface CoreTissue {
  addSurface(mesh: number, ...arrays: Float32Array[]): number;
  positionsPtr(surface: number): number;
  refresh(avatar: unknown): void;
  free(): void;
}
type Opened = Binding & { open(model: Model): unknown };
interface Inside {
  core: {
    memory: WebAssembly.Memory;
    glue: { CoreTissue: new (binding: unknown, avatar: unknown) => CoreTissue };
  };
}

const golden = (name: string) => new URL(`../../../tests/golden/${name}`, import.meta.url);

it("offsets are those of the native player, within 10 micrometres", async () => {
  const model = await loadModel();
  const { core } = model as unknown as Inside;
  // After a change of the body or of the format; then the Rust test writes its numbers anew.
  if (process.env.DYNASKIN_WRITE_GOLDEN) {
    const { root } = makeInThree(THREE, model, { unitsPerM: 100, split: true });
    const bound = await bindAvatar(model, root, { depicts: "adult", worker: false });
    writeFileSync(golden("played.binding"), bound.toBytes());
  }
  const binding = Binding.fromBytes(readFileSync(golden("played.binding")), model);
  const meshes = JSON.parse(readFileSync(golden("played.json"), "utf8")) as Played[];
  expect(binding.report.meshes.map(({ vertices }) => vertices)).toEqual(
    meshes.map(({ vertices }) => vertices),
  );

  const raw = (binding as Opened).open(model);
  const avatar = model.body.createAvatar();
  const tissue = new core.glue.CoreTissue(raw, (avatar as unknown as { raw: unknown }).raw);
  for (const [idx, { vertices }] of meshes.entries()) {
    const zero = new Float32Array(3 * vertices);
    tissue.addSurface(idx, zero, new Float32Array(0), new Float32Array(0));
  }
  const wave = [
    (vertex: number) => Math.sin(0.37 * vertex),
    (vertex: number) => Math.cos(0.73 * vertex + 1),
    (vertex: number) => Math.sin(0.11 * vertex + 2),
  ];
  const offsetsM = Float32Array.from(avatar.offsets, (_, idx) => {
    return 0.02 * (wave[idx % 3] as (typeof wave)[0])(Math.floor(idx / 3));
  });
  avatar.showOffsets(offsetsM);
  tissue.refresh((avatar as unknown as { raw: unknown }).raw);
  let [compared, largest] = [0, 0];
  for (const [idx, { vertices, offsets }] of meshes.entries()) {
    const { buffer } = core.memory;
    const found = new Float32Array(buffer, tissue.positionsPtr(idx), 3 * vertices);
    for (const [vertex, ...wanted] of offsets) {
      for (const [axis, number] of wanted.entries()) {
        compared += 1;
        largest = Math.max(largest, Math.abs(number));
        // The file is in centimetres.
        expect(Math.abs((found[3 * vertex + axis] ?? 0) - number)).toBeLessThan(1e-3);
      }
    }
  }
  expect(compared).toBeGreaterThan(300);
  expect(largest).toBeGreaterThan(0.5);
  tissue.free();
  avatar.dispose();
  model.dispose();
});
