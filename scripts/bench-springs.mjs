// npm run bench:springs: dynaskin beside the spring bones of @pixiv/three-vrm-springbone on the same
// skeleton in one run, as a table in docs/springs.md.
import { readFileSync, writeFileSync } from "node:fs";
import { cpus } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { BONE_LENGTH_M, DRAG } from "./bench/springs/figure.mjs";
import { MOTIONS, measureCost, measureMotion } from "./bench/springs/measure.mjs";
import { MODELS, ROOT } from "./lib/paths.mjs";
import { main, say, step } from "./lib/run.mjs";
import { serve } from "./lib/serve.mjs";
import { findChromium } from "./toolchain.mjs";

const PAGE = join(ROOT, "docs", "springs.md");
const MODEL = "female";

const IMPORTS = {
  "@pixiv/three-vrm-springbone":
    "/node_modules/@pixiv/three-vrm-springbone/lib/three-vrm-springbone.module.js",
  dynaskin: "/web/sdk/dist/index.js",
  "dynaskin/three": "/web/sdk/dist/three/index.js",
  three: "/node_modules/three/build/three.module.js",
  "three/addons/": "/node_modules/three/examples/jsm/",
};

async function costInChromium(stiffness) {
  const executablePath = findChromium();
  if (!executablePath) throw new Error("Chromium is not installed.");
  const { chromium } = await import("@playwright/test");
  const server = await serve();
  const args = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"];
  const browser = await chromium.launch({ executablePath, args });
  try {
    const page = await browser.newPage();
    await page.route("**/springs", (route) =>
      route.fulfill({
        contentType: "text/html",
        // Isolated, so that performance.now() steps by 5 µs.
        headers: {
          "Cross-Origin-Opener-Policy": "same-origin",
          "Cross-Origin-Embedder-Policy": "require-corp",
        },
        body: `<!doctype html><script type="importmap">${JSON.stringify({ imports: IMPORTS })}</script>`,
      }),
    );
    await page.goto(`${server.url}/springs`);
    const cost = await page.evaluate(
      async ([model, strength]) => {
        const { measureCost: measure } = await import("/scripts/bench/springs/measure.mjs");
        return measure(new URL(model, location.href).href, strength);
      },
      [`/models/${MODEL}/`, stiffness],
    );
    return { ...cost, version: browser.version() };
  } finally {
    await browser.close();
    server.close();
  }
}

const versionOf = (name) =>
  JSON.parse(readFileSync(join(ROOT, "node_modules", name, "package.json"), "utf8")).version;

const mm = (value) => (value < 0.05 ? "0" : value.toFixed(1));
const seconds = (value) => (value === 0 ? "at once" : `${value.toFixed(2)} s`);

function rows({ springs, dynaskin }, costs) {
  const rate = (peer, rateHz) => peer.rates.find((row) => row.rateHz === rateHz);
  const difference = (peer, rateHz) => {
    const { largestMm, meanMm } = rate(peer, rateHz);
    return `${mm(largestMm)} (${mm(meanMm)})`;
  };
  return [
    ...costs.map(({ where, springsMs, dynaskinMs }) => [
      `cost of an avatar and frame, ${where} (ms)`,
      springsMs.toFixed(3),
      dynaskinMs.toFixed(2),
    ]),
    [
      "what is moved",
      `${springs.moved} bones`,
      `${dynaskin.moved.toLocaleString("en")} soft vertices`,
    ],
    [
      "furthest from rest at 60 Hz, all motions (mm)",
      mm(rate(springs, 60).peakMm),
      mm(rate(dynaskin, 60).peakMm),
    ],
    ...[30, 144].map((rateHz) => [
      `${rateHz} Hz against 60 Hz, same instants: largest (mean) difference (mm)`,
      difference(springs, rateHz),
      difference(dynaskin, rateHz),
    ]),
    [
      "teleport by 5 m, standing: peak (mm)",
      mm(springs.teleport.peakMm),
      mm(dynaskin.teleport.peakMm),
    ],
    [
      "settled within 1 mm after",
      seconds(springs.teleport.settleSeconds),
      seconds(dynaskin.teleport.settleSeconds),
    ],
    [
      "30 s pause in a hop: jump of the first frame after it (mm)",
      mm(springs.pause.jumpMm),
      mm(dynaskin.pause.jumpMm),
    ],
    ["still to go after that frame (mm)", mm(springs.pause.peakMm), mm(dynaskin.pause.peakMm)],
    [
      "settled within 1 mm after",
      seconds(springs.pause.settleSeconds),
      seconds(dynaskin.pause.settleSeconds),
    ],
  ];
}

function pageOf(measured, costs, chromiumVersion) {
  const { stiffness } = measured;
  const table = rows(measured, costs).map((row) => `| ${row.join(" | ")} |`);
  const [cpu] = cpus();
  return `# Beside spring bones

Written by \`npm run bench:springs\`, which runs both on the same skeleton in the same run: dynaskin
through \`dynaskin/three\`, and the spring bones of \`@pixiv/three-vrm-springbone\`
${versionOf("@pixiv/three-vrm-springbone")}. Costs depend on the machine; here Node ${process.versions.node} and
Chromium ${chromiumVersion} on ${cpus().length} cores (${cpu?.model.trim() ?? "unknown"}), three.js ${versionOf("three")}. The rest does not.

| | spring bones | dynaskin |
|---|--:|--:|
${table.join("\n")}

**How the spring bones are set up.** One joint for each breast on spine3 and for each buttock on the
pelvis, each ${BONE_LENGTH_M * 100} cm long from inside the body to the skin's outermost place, without colliders and
gravity. The drag is the library's own ${DRAG}. The stiffness, of a row of values from 0.05 to 4, is
the one at which the tip swings as far as dynaskin's skin in a hop at 60 Hz: ${stiffness.chest} at the chest,
${stiffness.buttocks} at the buttocks. Nothing is called by hand at teleports and pauses, on neither side.

**What is compared.** The tips of the spring bones, and all vertices of the same two regions of
dynaskin's body, as distances in millimetres from their place at rest on the skeleton. Frame rates: the
motions ${MOTIONS.join(", ")}, 8 s each, at every sixth of a second, which all rates show. The teleport
happens between two frames of a body that stands; the pause is one step of 30 s in the middle of a hop,
after which the body stays as it was.

**How to read it.** Spring bones cost next to nothing and move a handful of points, which a rigger places
and tunes; that is enough for hair, ears and skirts. What they show depends on the frame rate, because
the pull towards rest and the drag are applied once a frame. A teleport throws them as far as the bone is
long, unless the page calls \`reset()\`. After a pause they are nearer to rest in one frame, which is seen
as a jump; dynaskin begins where it was and fades out over 0.2 s.
`;
}

main(async () => {
  const modelUrl = pathToFileURL(join(MODELS, MODEL, "/")).href;
  const measured = await step("Motions in Node", () => measureMotion(modelUrl));
  const costs = await step("Costs in Node and Chromium", async () => [
    { where: "Node", ...(await measureCost(modelUrl, measured.stiffness)) },
    { where: "Chromium", ...(await costInChromium(measured.stiffness)) },
  ]);
  writeFileSync(PAGE, pageOf(measured, costs, costs[1].version));
  say(readFileSync(PAGE, "utf8"));
  say("This is now docs/springs.md.");
});
