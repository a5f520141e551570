// What importing an entry does to a server: nothing. Each in a process of its own.
import { execFile } from "node:child_process";
import { promisify } from "node:util";
import { build, type Rolldown } from "vite";
import { describe, expect, it } from "vitest";
import { modelFolder } from "./support.js";

const runFile = promisify(execFile);

/** Notes every call that an import has no business to make, and every new global name. */
const WATCH = `
  const calls = [];
  const watch = (owner, name) => {
    const original = owner[name];
    owner[name] = (...args) => { calls.push(name); return original.apply(owner, args); };
  };
  for (const name of ["fetch", "setTimeout", "setInterval", "atob"]) watch(globalThis, name);
  for (const name of ["compile", "instantiate", "validate"]) watch(WebAssembly, name);
  for (const name of ["log", "info", "warn", "error", "debug"]) watch(console, name);
  const report = (result) => process.stdout.write(JSON.stringify({ calls, ...result }));
`;

async function runWatched(code: string): Promise<Record<string, unknown>> {
  const args = ["--input-type=module", "--eval", WATCH + code];
  const { stdout, stderr } = await runFile(process.execPath, args, { cwd: import.meta.dirname });
  expect(stderr).toBe("");
  return JSON.parse(stdout) as Record<string, unknown>;
}

describe("importing in plain Node", () => {
  it.each([
    ["dynaskin", ""],
    ["dynaskin/inline", ""],
    ["dynaskin/slim", ""],
    ["dynaskin/worker", ""],
    ["dynaskin/renderer", ""],
    // The engine's own import may do what it likes.
    ["dynaskin/three", 'await import("three");'],
    [
      "dynaskin/babylon",
      'await import("@babylonjs/core/Meshes/mesh.js"); await import("@babylonjs/core/Buffers/buffer.js");',
    ],
  ])("%s touches nothing, prints nothing and ends", async (entry, engine) => {
    const { calls, added, names } = await runWatched(`
      ${engine}
      calls.length = 0;
      const before = new Set(Reflect.ownKeys(globalThis));
      const names = Object.keys(await import("${entry}"));
      const added = Reflect.ownKeys(globalThis).filter((name) => !before.has(name)).map(String);
      report({ added, names });
    `);
    expect(calls).toEqual([]);
    expect(added).toEqual([]);
    expect(names).not.toEqual([]);
  });
});

describe("bundling", () => {
  it("keeps all of the worker's script, which exports nothing", async () => {
    const built = await build({
      root: import.meta.dirname,
      configFile: false,
      logLevel: "silent",
      build: { write: false, rolldownOptions: { input: "application.js" } },
      plugins: [
        {
          name: "an application",
          resolveId: (id) => (id === "application.js" ? `${import.meta.dirname}/${id}` : null),
          load: (id) =>
            id.endsWith("/application.js") ? 'import "dynaskin/worker/thread";' : null,
        },
      ],
    });
    const { output } = built as Rolldown.RolldownOutput;
    const [{ code }] = output;
    expect(code.length).toBeGreaterThan(20_000);
    expect(code).toContain("addEventListener");
  });
});

describe("the console", () => {
  it("stays empty while an avatar is loaded, moved, refused and disposed of", async () => {
    const { calls, refused, stepped } = await runWatched(`
      const { load, Motion, restPose } = await import("dynaskin");
      const model = await load({ model: "${modelFolder().href}" });
      const avatar = model.createAvatar();
      const motion = Motion.procedural("jump", avatar);
      for (let frame = 0; frame < 60; frame += 1) avatar.step(motion.poseAt(frame / 60), 1 / 60);
      avatar.step(restPose(), 30);
      let refused;
      try { avatar.step(restPose().fill(NaN), 1 / 60); } catch (error) { refused = error.code; }
      const stepped = avatar.positions.length;
      motion.dispose(); avatar.dispose(); model.dispose();
      report({ refused, stepped });
    `);
    const printed = (calls as string[]).filter((name) => name in console);
    expect(printed).toEqual([]);
    expect(refused).toBe("pose");
    expect(stepped).toBe(6890 * 3);
  });
});
