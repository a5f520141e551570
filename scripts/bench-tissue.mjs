// npm run bench:tissue [-- AVATAR.glb ...]: what an avatar of somebody's own costs the processor, as Markdown tables.
// A frame beside the step, its tissue written as attributes and as a texture, in turns in one run: what an engine then
// does to hand the numbers to the graphics card is not in it. And once: to bind it on one thread, and to read the
// binding again.
import { readFileSync } from "node:fs";
import { basename, join } from "node:path";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { DEMO } from "./lib/paths.mjs";
import { main, say } from "./lib/run.mjs";

// GLTFLoader asks the page for it.
globalThis.self ??= globalThis;

/** The demo's examples. */
const OWN = ["lifter.glb", "runner.vrm"].map((name) => join(DEMO, "avatars", name));

const WARM_UP_FRAMES = 300;
const FRAMES = 2000;

const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

/** Milliseconds of one frame of each, medians over frames that take turns. */
function timeInTurns(tissues) {
  const rows = tissues.map(() => []);
  for (let frame = 0; frame < WARM_UP_FRAMES + FRAMES; frame += 1) {
    for (const [idx, tissue] of tissues.entries()) {
      const start = performance.now();
      tissue.show();
      if (frame >= WARM_UP_FRAMES) rows[idx].push(performance.now() - start);
    }
  }
  return rows.map(median);
}

const ROUNDS = 7;

/** Milliseconds of the processor that a task takes, median over some rounds after the first. */
async function processorMs(task) {
  const taken = [];
  for (let round = 0; round <= ROUNDS; round += 1) {
    const before = process.cpuUsage();
    await task();
    const { user, system } = process.cpuUsage(before);
    if (round > 0) taken.push((user + system) / 1000);
  }
  return median(taken);
}

/** What binding costs, as a row of a table. */
async function costOfBinding(file, { Binding, bindAvatar }, model) {
  const root = await read(file);
  const bind = () => bindAvatar(model, root, { depicts: "adult", worker: false });
  const binding = await bind();
  const bytes = binding.toBytes();
  const bindMs = await processorMs(bind);
  const readMs = await processorMs(() => Binding.fromBytes(bytes, model));
  const numbers = [bindMs.toFixed(0), (bytes.length / 1000).toFixed(0), readMs.toFixed(1)];
  return `| ${[basename(file), binding.report.vertices, ...numbers].join(" | ")} |`;
}

/** The avatar of a file, without its textures, which Node cannot read. */
async function read(file) {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).register((parser) => {
    parser.loadTexture = () => Promise.resolve(null);
    return { name: "no-textures" };
  });
  const { buffer } = new Uint8Array(readFileSync(file));
  return (await loader.parseAsync(buffer, "")).scene;
}

main(async () => {
  const sdk = new URL("../web/sdk/dist/", import.meta.url);
  const { load } = await import(new URL("index.js", sdk));
  const { AvatarTissue, Binding, bindAvatar } = await import(new URL("three/index.js", sdk));
  const given = process.argv.slice(2);
  const files = given.length > 0 ? given : OWN;
  const model = await load({ model: new URL("../models/female/", import.meta.url) });
  say("| avatar | moved vertices | attributes, ms | texture, ms | share |");
  say("|---|--:|--:|--:|--:|");
  for (const file of files) {
    const root = await read(file);
    const binding = await bindAvatar(model, root, { depicts: "adult", worker: false });
    const tissues = [];
    for (const write of ["attributes", "texture"]) {
      tissues.push(new AvatarTissue(model, await read(file), binding, { write }));
    }
    for (const tissue of tissues) tissue.update(1 / 60);
    const [attributes, texture] = timeInTurns(tissues);
    const numbers = [attributes.toFixed(4), texture.toFixed(4), (texture / attributes).toFixed(2)];
    say(`| ${[basename(file), tissues[0].movingVertices, ...numbers].join(" | ")} |`);
    for (const tissue of tissues) tissue.dispose();
  }
  say("\n| avatar | vertices | bound, ms of the processor | stored, kB | read, ms |");
  say("|---|--:|--:|--:|--:|");
  for (const file of files) say(await costOfBinding(file, { Binding, bindAvatar }, model));
});
