import { actorLabel, isMethod } from "./actors.js";
import { findMotion, motionOptions } from "./motions.js";
import type { Settings } from "./settings.js";

/** What the sliders of the tissue say; they are not in the settings. */
export interface Tuning {
  /** Factor on all offsets. */
  strength: number;
  /** Factors on the offsets of regions. */
  gains: ReadonlyMap<string, number>;
}

/** The program that shows what the page shows of the right actor, in the SDK's terms. */
export function codeFor(settings: Settings, { strength, gains }: Tuning): string {
  const { sex, right, motion, tempoHz, heightM, dynamics } = settings;
  const rounded = (values: readonly number[]) => values.map((value) => +value.toFixed(2));
  const folder = `/models/${sex}/`;
  const shape = `{ shape: [${rounded(settings.shape).join(", ")}] }`;
  const lines = [
    `import { load, Motion } from "dynaskin";`,
    "",
    `const model = await load({ model: "${folder}" });`,
  ];
  let source = "model";
  if (isMethod(right)) {
    source = "compared";
    lines.push(
      `const compared = await load({ model: "${folder}methods/${right}/", body: model.body });`,
    );
  } else if (right !== "dynaskin") {
    source = "model.body";
    lines.push(`// ${actorLabel(right)}: an avatar without networks.`);
  }
  lines.push(`const avatar = ${source}.createAvatar(${shape});`);
  if (settings.clothes === "sportswear" && !settings.clip) {
    lines.push(`avatar.setControls("sportswear");`);
  }
  for (const [region, gain] of gains) {
    if (gain !== 1) lines.push(`avatar.setRegionGain("${region}", ${gain});`);
  }
  if (!dynamics || strength !== 1) lines.push(`avatar.strength = ${dynamics ? strength : 0};`);
  const options = motionOptions(findMotion(motion), tempoHz, heightM);
  lines.push(
    `const motion = Motion.procedural("${motion}", avatar, { tempoHz: ${options.tempoHz}, heightM: ${options.heightM} });`,
    "const pose = new Float64Array(99); // translation, then 24 quaternions x, y, z, w",
    "",
    "export function frame(timeSeconds, dtSeconds) {",
    "  motion.poseAt(timeSeconds % motion.durationSeconds, pose);",
    "  avatar.step(pose, dtSeconds);",
    "  return { positions: avatar.positions, normals: avatar.normals }; // before skinning",
    "}",
  );
  return `${lines.join("\n")}\n`;
}
