// The code of the pages in docs/recipes, run as it stands there.
import { mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { type Avatar, Motion, type Pose, restPose } from "dynaskin";
import { afterAll, describe, expect, it } from "vitest";
import { largestOffset, loadModel } from "./support.js";

const PAGES = new URL("../../../docs/recipes/", import.meta.url);
const EXTRACTED = new URL("../../../test-results/recipes/", import.meta.url);
const TICK = 1 / 60;
const model = await loadModel();

afterAll(() => model.dispose());

/** The only block of code of a page. */
function codeOf(name: string): string {
  const page = readFileSync(new URL(`${name}.md`, PAGES), "utf8");
  const blocks = [...page.matchAll(/^```js\n([^]*?)^```$/gm)].map(([, code = ""]) => code);
  expect(blocks.length, `blocks of code in ${name}.md`).toBe(1);
  return blocks[0] ?? "";
}

/** What the code of a page exports. */
async function recipe<Exports>(name: string): Promise<Exports> {
  const file = fileURLToPath(new URL(`${name}.mjs`, EXTRACTED));
  mkdirSync(EXTRACTED, { recursive: true });
  writeFileSync(file, codeOf(name));
  return (await import(/* @vite-ignore */ file)) as Exports;
}

/** How much the tissue shakes: watched after every frame, in metres. */
class Shaking {
  readonly #avatar: Avatar;
  #last: Float32Array[] = [];
  #squares = 0;
  #count = 0;
  /** Largest offset that was seen. */
  largestM = 0;

  constructor(avatar: Avatar) {
    this.#avatar = avatar;
  }

  watch(): void {
    const now = this.#avatar.offsets.slice();
    const [before, last] = this.#last;
    if (before && last) {
      for (const [idx, metres] of now.entries()) {
        this.#squares += (metres - 2 * (last[idx] ?? 0) + (before[idx] ?? 0)) ** 2;
      }
      this.#count += now.length;
    }
    this.largestM = Math.max(this.largestM, largestOffset(now));
    this.#last = [last ?? now, now];
  }

  /** Root mean square of second differences from frame to frame. */
  get rmsM(): number {
    return Math.sqrt(this.#squares / Math.max(1, this.#count));
  }
}

/** Evenly spread numbers from 0 to 1, the same in every run. */
function randomNumbers(seed: number): () => number {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

it("each page has one block of at most 30 lines", () => {
  const names = readdirSync(PAGES).filter((name) => name.endsWith(".md"));
  expect(names.length).toBeGreaterThan(0);
  for (const name of names) {
    const lines = codeOf(name.replace(/\.md$/, "")).trimEnd().split("\n");
    expect(lines.length, name).toBeLessThanOrEqual(30);
    for (const line of lines) expect(line.length, `${name}: ${line}`).toBeLessThanOrEqual(100);
  }
});

describe("network-avatar", async () => {
  const { sendPose, networkAvatar } = await recipe<{
    sendPose(socket: { send(data: ArrayBuffer): void }, pose: Pose): void;
    networkAvatar(
      model: unknown,
      socket: EventTarget,
    ): { avatar: Avatar; frame(deltaSeconds: number): void };
  }>("network-avatar");

  /** Plays a hop of 4 s, and 2 s of standing still, sent at 15 Hz with arrivals late by 0 to 30 ms. */
  function play(change: (avatar: Avatar) => void = () => {}) {
    const socket = new EventTarget();
    const { avatar, frame } = networkAvatar(model, socket);
    change(avatar);
    const motion = Motion.procedural("hop", avatar, { durationSeconds: 4 });
    const random = randomNumbers(7);
    const sent: { at: number; data: ArrayBuffer }[] = [];
    for (let message = 0; message < 90; message += 1) {
      const send = (data: ArrayBuffer) => sent.push({ at: message / 15 + random() * 0.03, data });
      sendPose({ send }, motion.poseAt(message / 15));
    }
    const [moving, still] = [new Shaking(avatar), new Shaking(avatar)];
    const latenciesMs: number[] = [];
    for (let tick = 0; tick < 360; tick += 1) {
      while (sent[0] && sent[0].at <= tick / 60) {
        socket.dispatchEvent(new MessageEvent("message", { data: sent.shift()?.data }));
      }
      frame(TICK);
      if (tick < 270) moving.watch();
      if (tick > 330) still.watch();
      if (tick > 60 && tick < 200) latenciesMs.push(avatar.timings.source.latencyMs);
    }
    motion.dispose();
    return { avatar, frame, socket, moving, still, latenciesMs };
  }

  it("moves the tissue evenly, though poses come at 15 Hz and late", () => {
    const { avatar, moving, still, latenciesMs } = play();
    const held = play((other) => {
      other.poseSource = "as-given";
    });
    for (const ms of latenciesMs) expect(ms).toBeGreaterThan(60);
    for (const ms of latenciesMs) expect(ms).toBeLessThan(180);
    expect(moving.largestM).toBeGreaterThan(0.002);
    expect(moving.rmsM).toBeLessThan(0.5 * held.moving.rmsM);
    expect(still.rmsM).toBeLessThan(1e-5);
    avatar.dispose();
    held.avatar.dispose();
  });

  it("stays as it was where a message is no pose, and goes on with the next", () => {
    const { avatar, frame, socket } = play();
    const before = avatar.skinMatrices.slice();
    for (const data of [
      new ArrayBuffer(3),
      new Float32Array(99).fill(Number.NaN).buffer,
      "hello",
    ]) {
      socket.dispatchEvent(new MessageEvent("message", { data }));
      frame(TICK);
      expect(avatar.skinMatrices).toEqual(before);
    }
    const pose = restPose();
    pose[1] = 0.01;
    sendPose({ send: (data) => socket.dispatchEvent(new MessageEvent("message", { data })) }, pose);
    frame(TICK);
    expect(avatar.skinMatrices).not.toEqual(before);
    avatar.dispose();
  });
});
