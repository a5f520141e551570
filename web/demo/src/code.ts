import { type Controls, REGION_NAMES } from "dynaskin";
import { actorLabel, isMethod } from "./actors.js";
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
 * The program that shows what the page shows of the right actor, in the SDK's terms; `controls` are
 * that actor's, null before it is there.
 */
export function codeFor(
  settings: Readonly<Settings>,
  played: PlayedInstead,
  controls: Controls | null,
): string {
  const { sex, right } = settings;
  const folder = `/models/${sex}/`;
  const shape = played.fileName === null && played.clip ? played.clip.shape : settings.shape;
  const numbers = shape.map((value) => +value.toFixed(2));
  const source = sourceOf(settings, played);
  const lines = [
    `import { load, ${source.name} } from "dynaskin";`,
    "",
    `const model = await load({ model: "${folder}" });`,
  ];
  let from = "model";
  if (isMethod(right)) {
    from = "compared";
    lines.push(
      `const compared = await load({ model: "${folder}methods/${right}/", body: model.body });`,
    );
  } else if (right !== "dynaskin") {
    from = "model.body";
    lines.push(`// ${actorLabel(right)}: an avatar without networks.`);
  }
  lines.push(
    `const avatar = ${from}.createAvatar({ shape: [${numbers.join(", ")}] });`,
    ...tuningLines(settings, controls),
    ...source.made,
    "const pose = new Float64Array(99); // translation, then 24 quaternions x, y, z, w",
    "",
    "export function frame(timeSeconds, dtSeconds) {",
    `  ${source.posed}`,
    "  avatar.step(pose, dtSeconds);",
    "  return { positions: avatar.positions, normals: avatar.normals }; // before skinning",
    "}",
  );
  return `${lines.join("\n")}\n`;
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
  const posed = "motion.poseAt(timeSeconds % motion.durationSeconds, pose);";
  if (played.fileName !== null) {
    const made = [
      `const file = await fetch(${JSON.stringify(`/motions/${played.fileName}`)});`,
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
