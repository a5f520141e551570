import { type Controls, REGION_NAMES } from "dynaskin";
import { actorLabel, isMethod } from "./actors.js";
import { storyFigure } from "./chapters.js";
import { findMotion, motionOptions } from "./motions.js";
import type { Settings } from "./settings.js";
import { TISSUE_PROPERTIES } from "./tissue.js";

/** What plays instead of the settings' motion, if anything does. */
export interface PlayedInstead {
  /** Name of a file that was opened. */
  fileName: string | null;
  /** The clip of the simulator: the motion it was made for, and the shape of its body. */
  clip: { motion: string; tempoHz: number; heightM: number; shape: readonly number[] } | null;
}

/**
 * A page that shows what this one shows of the right actor, in the SDK's terms; `controls` are that actor's, null before
 * it is there.
 */
export function codeFor(
  settings: Readonly<Settings>,
  played: PlayedInstead,
  controls: Controls | null,
): string {
  const program = programOf(settings, played, controls).map((line) => (line ? `    ${line}` : ""));
  return `<!doctype html>
<html lang="en">
  <meta charset="utf-8" />
  <title>Soft tissue that moves</title>
  <style>canvas { position: fixed; inset: 0; width: 100%; height: 100% }</style>
  <canvas></canvas>
  <script type="importmap">
    {
      "imports": {
        "dynaskin": "./node_modules/dynaskin/dist/index.js",
        "dynaskin/renderer": "./node_modules/dynaskin/dist/renderer.js",
        "dynaskin-${settings.sex}": "./node_modules/dynaskin-${settings.sex}/index.js"
      }
    }
  </script>
  <script type="module">
${program.join("\n")}
  </script>
</html>
`;
}

/** The lines of the page's script. */
function programOf(
  settings: Readonly<Settings>,
  played: PlayedInstead,
  controls: Controls | null,
): string[] {
  const { sex, right, look } = settings;
  const source = sourceOf(settings, played);
  const lines = [
    `import { load, ${source.name} } from "dynaskin";`,
    `import { ${sex} } from "dynaskin-${sex}";`,
    `import { createRenderer } from "dynaskin/renderer";`,
    "",
    `const model = await load({ model: ${sex} });`,
  ];
  let from = "model";
  if (isMethod(right)) {
    from = "compared";
    lines.push(
      "// In a clone of dynaskin's repository.",
      `const compared = await load({ model: "./models/${sex}/methods/${right}/", body: model.body });`,
    );
  } else if (right !== "dynaskin") {
    from = "model.body";
    lines.push(`// ${actorLabel(right)}: an avatar without networks.`);
  }
  return [
    ...lines,
    `const avatar = ${from}.createAvatar({ shape: ${shapeText(settings, played)} });`,
    ...tuningLines(settings, controls),
    ...source.made,
    "",
    `const renderer = await createRenderer(document.querySelector("canvas"));`,
    "renderer.resize(innerWidth, innerHeight, devicePixelRatio);",
    "renderer.setCamera({ eyeWorldM: [1.4, 1.2, 4.4], targetWorldM: [0, 1, 0], fovYRadians: 0.6 });",
    "const body = renderer.addBody(model.body);",
    `body.setLook({ sculpture: ${look === "sculpture"}, draped: true });`,
    "",
    "const pose = new Float64Array(99); // translation, then 24 quaternions x, y, z, w",
    "let beforeMs = performance.now();",
    "requestAnimationFrame(function frame(nowMs) {",
    "  const dtSeconds = Math.max(0, nowMs - beforeMs) / 1000;",
    "  beforeMs = nowMs;",
    `  ${source.posed}`,
    "  avatar.step(pose, dtSeconds);",
    "  body.update(avatar);",
    "  renderer.render();",
    "  requestAnimationFrame(frame);",
    "});",
  ];
}

/** The story's body in words, others in coefficients. */
function shapeText({ chapter, sex, shape }: Readonly<Settings>, played: PlayedInstead): string {
  if (chapter) {
    const words = Object.entries(storyFigure(sex));
    return `{ ${words.map(([name, value]) => `${name}: ${+value.toFixed(2)}`).join(", ")} }`;
  }
  const numbers = played.fileName === null && played.clip ? played.clip.shape : shape;
  return `[${numbers.map((value) => +value.toFixed(2)).join(", ")}]`;
}

function tuningLines(
  { clothes, clip, dynamics, strength, tissue }: Readonly<Settings>,
  controls: Controls | null,
): string[] {
  const lines: string[] = [];
  if (clothes === "sportswear" && !clip) lines.push(`avatar.setControls("sportswear");`);
  const changed = REGION_NAMES.flatMap((region) => {
    const own = TISSUE_PROPERTIES.filter((property) => (tissue[property][region] ?? 1) !== 1);
    const values = own.map(
      (property) => `${property}: ${+(controls?.regions[region][property] ?? 1).toFixed(2)}`,
    );
    return own.length > 0 ? [`${JSON.stringify(region)}: { ${values.join(", ")} }`] : [];
  });
  if (changed.length > 0) {
    lines.push(`avatar.setControls({ regions: { ${changed.join(", ")} } });`);
  }
  if (!dynamics || strength !== 1) lines.push(`avatar.strength = ${dynamics ? strength : 0};`);
  return lines;
}

/** How the poses are made, and how one is asked for. */
interface PoseSource {
  /** The class of the SDK that is imported. */
  name: string;
  made: string[];
  posed: string;
}

function sourceOf(
  { motion, tempoHz, heightM }: Readonly<Settings>,
  played: PlayedInstead,
): PoseSource {
  const posed = "motion.poseAt((nowMs / 1000) % motion.durationSeconds, pose);";
  if (played.fileName !== null) {
    const made = [
      `const file = await fetch(${JSON.stringify(`./${played.fileName}`)}); // beside the page`,
      "const motion = Motion.fromFile(await file.arrayBuffer(), avatar);",
    ];
    return { name: "Motion", made, posed };
  }
  const byFormula = (name: string, tempo: number, height: number): PoseSource => ({
    name: "Motion",
    made: [
      `const motion = Motion.procedural("${name}", avatar, { tempoHz: ${tempo}, heightM: ${height} });`,
    ],
    posed,
  });
  const { clip } = played;
  if (clip) {
    const { name, made } = byFormula(clip.motion, clip.tempoHz, clip.heightM);
    return { name, made: ["// The motion that the clip was simulated for.", ...made], posed };
  }
  const choice = findMotion(motion);
  if (choice) {
    const options = motionOptions(choice, tempoHz, heightM);
    return byFormula(choice.name, options.tempoHz, options.heightM);
  }
  return {
    name: "Puppet",
    made: [
      "const puppet = new Puppet(avatar);",
      `// While a hand pulls: puppet.hold("pelvis", [0.1, 0, 0]), in metres; then puppet.release().`,
    ],
    posed: "puppet.step(dtSeconds, pose);",
  };
}
