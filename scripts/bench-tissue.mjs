// npm run bench:tissue [-- AVATAR.glb ...]: what an avatar of somebody's own costs the processor a frame beside the
// step, its tissue written as attributes and as a texture, in turns in one run; as a Markdown table. What an engine
// then does to hand the numbers to the graphics card is not in it.
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
  const { AvatarTissue, bindAvatar } = await import(new URL("three/index.js", sdk));
  const files = process.argv.slice(2);
  const model = await load({ model: new URL("../models/female/", import.meta.url) });
  say("| avatar | moved vertices | attributes, ms | texture, ms | share |");
  say("|---|--:|--:|--:|--:|");
  for (const file of files.length > 0 ? files : OWN) {
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
});
