// Arguments of the wrong kind: each a sentence, and the avatar goes on.
import { readFileSync } from "node:fs";
import { type Avatar, load, type Model, Motion, restPose, VERSION } from "dynaskin";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { checkVersion } from "../src/core.js";
import { DynaSkinError as SourceError } from "../src/error.js";
import { expectError, loadModel, modelFiles, modelFolder } from "./support.js";

const TICK = 1 / 60;
let model: Model;
let avatar: Avatar;
let motion: Motion;

beforeAll(async () => {
  model = await loadModel();
  avatar = model.createAvatar();
  motion = Motion.procedural("run-in-place", avatar);
});
afterAll(() => {
  motion.dispose();
  avatar.dispose();
  model.dispose();
});

// What JavaScript lets through and types would not.
// biome-ignore lint/suspicious/noExplicitAny: the point of these tests
const odd = (value: unknown): any => value;

describe("odd arguments", () => {
  const setBelly = (belly: unknown) => avatar.setControls({ regions: { belly: odd(belly) } });
  const sentAway = () => {
    const bytes = new ArrayBuffer(9);
    structuredClone(bytes, { transfer: [bytes] });
    return bytes;
  };
  const longBigInts = () => new BigInt64Array(99);
  const calls: [string, () => unknown][] = [
    ["load()", () => load(odd(undefined))],
    ["load(null)", () => load(odd(null))],
    ["load a string", () => load(odd("models/female/"))],
    ["a model without files", () => load({ model: odd({}) })],
    ["a signal that is none", () => load({ model: modelFolder(), signal: odd("stop") })],
    ["onProgress of a number", () => load({ model: modelFolder(), onProgress: odd(1) })],
    ["onBody of a text", () => load({ model: modelFolder(), onBody: odd("body") })],
    ["files that are numbers", () => load({ model: { ...modelFiles(), body: odd(3) } })],
    ["a WebAssembly file that is null", () => load({ model: modelFolder(), wasm: odd(null) })],
    ["fromBvh of bytes that were sent away", () => Motion.fromBvh(sentAway(), avatar)],
    ["createAvatar(null)", () => model.createAvatar(odd(null))],
    ["createAvatar of a string", () => model.createAvatar(odd("tall"))],
    ["a shape of strings", () => model.createAvatar({ shape: odd(Array(10).fill("1")) })],
    ["a shape of big integers", () => model.createAvatar({ shape: odd(Array(10).fill(1n)) })],
    ["a shape that is a string", () => model.createAvatar({ shape: odd("0123456789") })],
    ["body.createAvatar(null)", () => model.body.createAvatar(odd(null))],
    ["setShape(null)", () => avatar.setShape(odd(null))],
    ["fromFile(null)", () => Motion.fromFile(odd(null), avatar)],
    ["fromBvh(null)", () => Motion.fromBvh(odd(null), avatar)],
    ["fromBvh of a string", () => Motion.fromBvh(odd("HIERARCHY"), avatar)],
    ["fromBvh without an avatar", () => Motion.fromBvh(new Uint8Array(9), odd(undefined))],
    ["procedural without an avatar", () => Motion.procedural("hop", odd(null))],
    ["procedural with null", () => Motion.procedural("hop", avatar, odd(null))],
    ["a tempo in letters", () => Motion.procedural("hop", avatar, { tempoHz: odd("2") })],
    ["poseAt a string", () => motion.poseAt(odd("1"))],
    ["poseAt a big integer", () => motion.poseAt(odd(1n))],
    ["step(null)", () => avatar.step(odd(null), TICK)],
    ["step of big integers", () => avatar.step(odd(longBigInts()), TICK)],
    ["step of strings", () => avatar.step(odd(Array(99).fill("0")), TICK)],
    ["step of a text of 99 letters", () => avatar.step(odd("0".repeat(99)), TICK)],
    ["step by a string", () => avatar.step(restPose(), odd("0.016"))],
    ["step by a big integer", () => avatar.step(restPose(), odd(1n))],
    ["step by nothing", () => avatar.step(restPose(), odd(undefined))],
    ["a negative step", () => avatar.step(restPose(), -TICK)],
    ["a step of a date", () => avatar.step(restPose(), Date.now())],
    ["strength in letters", () => odd(Object.assign(avatar, { strength: "1" }))],
    ["scale as a big integer", () => odd(Object.assign(avatar, { scale: 2n }))],
    ["a gain in letters", () => avatar.setRegionGain("belly", odd("2"))],
    ["setControls(null)", () => avatar.setControls(odd(null))],
    ["controls of a region that are null", () => setBelly(null)],
    ["controls of a region that are a number", () => setBelly(2)],
    [
      "a source of poses that does not exist",
      () => odd(Object.assign(avatar, { poseSource: "webcam" })),
    ],
    ["a detail that is a number", () => odd(Object.assign(avatar, { detail: 1 }))],
    ["a distance in letters", () => odd(Object.assign(avatar, { distanceM: "near" }))],
    ["a mistyped control", () => avatar.setControls(odd({ stength: 2 }))],
    ["a mistyped control of a region", () => setBelly({ stifness: 2 })],
    ["setControls(5)", () => avatar.setControls(odd(5))],
    ["restore(null)", () => avatar.restore(odd(null))],
  ];
  it.each(calls)("%s is refused, and the avatar goes on", async (_what, call) => {
    const other = model.createAvatar();
    avatar.reset();
    for (const frame of [60, 61, 62]) {
      avatar.step(motion.poseAt(frame * TICK), TICK);
      other.step(motion.poseAt(frame * TICK), TICK);
    }
    await expectError("argument", call);
    avatar.step(motion.poseAt(63 * TICK), TICK);
    other.step(motion.poseAt(63 * TICK), TICK);
    expect(avatar.positions.slice()).toEqual(other.positions.slice());
    other.dispose();
  });
});

describe("switches", () => {
  it("take what is true in JavaScript for true", () => {
    for (const value of ["on", 1, {}, "", 0, null]) {
      Object.assign(avatar, { dynamics: value, visible: value });
      expect([avatar.dynamics, avatar.visible], String(value)).toEqual(
        Array(2).fill(Boolean(value)),
      );
    }
    Object.assign(avatar, { dynamics: true, visible: true });
  });
});

describe("versions", () => {
  const read = (file: string) => readFileSync(new URL(`../../../${file}`, import.meta.url), "utf8");

  it("are the same everywhere", () => {
    expect(JSON.parse(read("web/sdk/package.json")).version).toBe(VERSION);
    expect(JSON.parse(read("package.json")).version).toBe(VERSION);
    const cargo = /\[workspace\.package\]\s+version = "([^"]+)"/.exec(read("Cargo.toml"));
    expect(cargo?.[1]).toBe(VERSION);
  });

  it("of core and package must agree", () => {
    checkVersion(VERSION);
    const check = () => checkVersion("9.9.9");
    expect(check).toThrow(SourceError);
    expect(check).toThrow(/core is version 9\.9\.9.*package is version/);
  });

  it("of a bundle that this build does not know is refused", async () => {
    const files = modelFiles({}, (bundle) => {
      bundle.version = 3;
    });
    const error = await expectError("bundle", () => load({ model: files }));
    expect(error.message).toContain("update dynaskin");
  });
});

describe("loading while a core runs", () => {
  it("does not ignore a bad WebAssembly file", async () => {
    const load2 = (wasm: Uint8Array) => () => load({ model: modelFolder(), wasm });
    await expectError("wasm", load2(new Uint8Array(100)));
    await expectError("wasm", load2(new TextEncoder().encode("<!doctype html>")));
    const missing = new URL("missing.wasm", modelFolder());
    await expectError("fetch", () => load({ model: modelFolder(), wasm: missing }));
    const again = await loadModel();
    again.dispose();
  });

  it("passes on what onProgress throws, and blames no file", async () => {
    const mine = new Error("my progress bar is broken");
    const onProgress = () => {
      throw mine;
    };
    await expect(load({ model: modelFolder(), onProgress })).rejects.toBe(mine);
    const response = new Response(JSON.stringify({}));
    const files = { ...modelFiles(), bundle: response };
    await expect(load({ model: files, onProgress })).rejects.toBe(mine);
    const again = await loadModel();
    again.dispose();
  });
});
