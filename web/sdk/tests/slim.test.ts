// The core without tract: the same numbers, and sentences about what it cannot play.
import { execFile } from "node:child_process";
import { readFileSync } from "node:fs";
import { promisify } from "node:util";
import { load as loadWhole } from "dynaskin";
import * as sdk from "dynaskin/slim";
import { load } from "dynaskin/slim";
import { describe, expect, it } from "vitest";
import { type Golden, replay } from "../../../tests/golden/replay.js";
import { expectError, MODEL_NAMES, modelFiles, modelFolder, readModelFile } from "./support.js";

const runFile = promisify(execFile);

/** Steps random poses and prints a hash of all offsets' bits, and the largest offset in metres. */
const PROGRAM = (entry: string, folder: string, ticks: number) => `
  import { createHash } from "node:crypto";
  import { load, Motion } from "${entry}";
  let seed = 19;
  const random = () => {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    return seed / 2 ** 32;
  };
  const model = await load({ model: "${folder}" });
  const avatar = model.createAvatar();
  const motions = ["hop", "walk", "jumping-jacks"].map((name) => Motion.procedural(name, avatar));
  const hash = createHash("sha256");
  let [largest, from] = [0, 0];
  for (let tick = 0; tick < ${ticks}; tick += 1) {
    if (tick % 500 === 0) {
      avatar.setControls({ regions: { chest: { stiffness: 0.5 + random(), damping: 0.7 + 0.8 * random() } } });
    }
    // Stretches of motions, from a random moment on: cuts are among them.
    const motion = motions[Math.floor(tick / 50) % motions.length];
    if (tick % 50 === 0) from = random() * 6;
    avatar.step(motion.poseAt(from + (tick % 50) / 60), 1 / 60);
    // What differs at one tick lives on in the state.
    if (tick % 10 !== 0) continue;
    const offsets = avatar.offsets;
    hash.update(new Uint8Array(offsets.buffer, offsets.byteOffset, offsets.byteLength));
    for (const offset of offsets) largest = Math.max(largest, Math.abs(offset));
  }
  process.stdout.write(JSON.stringify({ hash: hash.digest("hex"), largest }));
`;

async function play(entry: string, name: string, ticks: number) {
  const program = PROGRAM(entry, modelFolder(name).href, ticks);
  const args = ["--input-type=module", "--eval", program];
  const { stdout } = await runFile(process.execPath, args, { cwd: import.meta.dirname });
  return JSON.parse(stdout) as { hash: string; largest: number };
}

describe("dynaskin/slim", () => {
  it.each(MODEL_NAMES)("%s hops as the native runtime makes it hop", async (name) => {
    const file = new URL(`../../../tests/golden/${name}-hop.json`, import.meta.url);
    const golden: Golden = JSON.parse(readFileSync(file, "utf8"));
    const model = await load({ model: modelFolder(name) });
    const { largestUm, worstUm, frames } = replay(sdk, model, golden);
    console.log(`${name}: offsets to ${largestUm.toFixed(0)} µm, off by ${worstUm.toFixed(2)} µm`);
    expect(frames).toBe(300);
    expect(worstUm).toBeLessThanOrEqual(10);
    model.dispose();
  });

  it.each(MODEL_NAMES)(
    "%s moves by the same bits as with the whole core, for 10,000 ticks",
    async (name) => {
      const [slim, whole] = await Promise.all([
        play("dynaskin/slim", name, 10_000),
        play("dynaskin", name, 10_000),
      ]);
      expect(slim.largest).toBeGreaterThan(1e-3);
      expect(slim).toEqual(whole);
    },
    60_000,
  );

  it("says of an ONNX file how it can be played", async () => {
    const error = await expectError("network", () => load({ model: modelFiles() }));
    expect(error.message).toContain("dynaskin slim");
  });

  it("says of a bundle without lowered networks how to write them", async () => {
    const { body } = modelFiles();
    const bundle = JSON.parse(new TextDecoder().decode(readModelFile("bundle.json")));
    delete bundle.lowered;
    const address = `data:application/json,${encodeURIComponent(JSON.stringify(bundle))}`;
    const files = {
      bundle: address,
      body,
      predictor: lowered("predictor"),
      decoder: lowered("decoder"),
    };
    const error = await expectError("bundle", () => load({ model: files }));
    expect(error.message).toContain("names no lowered networks");
  });

  it("has the whole core beside it, once that is asked for", async () => {
    const slim = await load({ model: modelFolder() });
    await expectError("argument", () => loadWhole({ model: modelFolder(), body: slim.body }));
    const whole = await loadWhole({ model: modelFolder() });
    const bytes = new TextEncoder().encode("HIERARCHY");
    const error = await expectError("motion", () =>
      sdk.Motion.fromBvh(bytes, whole.createAvatar()),
    );
    expect(error.message).not.toContain("readMotion");
    const [one, other] = [slim.createAvatar(), whole.createAvatar()];
    const motion = sdk.Motion.procedural("hop", one);
    for (let tick = 0; tick < 120; tick += 1) {
      for (const avatar of [one, other]) avatar.step(motion.poseAt(1 + tick / 60), 1 / 60);
    }
    expect(Math.max(...one.offsets)).toBeGreaterThan(1e-3);
    expect(other.offsets).toEqual(one.offsets);
    for (const model of [slim, whole]) model.dispose();
  });

  it("says of motion files that they are not read here", async () => {
    const model = await load({ model: modelFolder() });
    const avatar = model.createAvatar();
    const bytes = new TextEncoder().encode("HIERARCHY");
    for (const read of ["fromFile", "fromBvh", "animations"] as const) {
      const error = await expectError("motion", () => sdk.Motion[read](bytes, avatar));
      expect(error.message).toContain("readMotion");
    }
    model.dispose();
  });

  it("takes lowered files one by one, and refuses a changed one", async () => {
    const [predictor, decoder] = [lowered("predictor"), lowered("decoder")];
    const files = {
      bundle: readModelFile("bundle.json"),
      body: readModelFile("body.glb"),
      predictor,
      decoder,
    };
    const model = await load({ model: files });
    expect(model.createAvatar().positions.length).toBeGreaterThan(0);
    model.dispose();
    decoder[5000] = (decoder[5000] ?? 0) ^ 1;
    await expectError("bundle", () => load({ model: files }));
  });
});

function lowered(network: "predictor" | "decoder"): Uint8Array {
  return readModelFile(`${network}.lowered`);
}
