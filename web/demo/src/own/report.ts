import type { BindingReport } from "dynaskin/three";
import { create } from "../dom.js";

const percent = (share: number) => `${Math.round(100 * share)} %`;
const words = (name: string) => name.replaceAll("_", " ");
const capital = (text: string) => text.charAt(0).toUpperCase() + text.slice(1);
/** As a sentence: what the core says begins small and ends without a stop. */
export const sentence = (text: string) =>
  `${capital(text.trim())}${/[.!?]$/.test(text.trim()) ? "" : "."}`;

/** What binding found, as sentences. */
export function sentencesOf(report: BindingReport): string[] {
  const { bones, missing, proportions, shareClose, medianM, vertices, moving } = report;
  const joints = bones.length + missing.length;
  const { statureM } = proportions;
  return [
    `${bones.length} of the body's ${joints} joints have a bone.` +
      (missing.length > 0 ? ` Without one: ${missing.map(words).join(", ")}.` : ""),
    statureM === null
      ? "The unit of its file is unknown, so its stature is not known."
      : `It is ${statureM.toFixed(2)} m tall.`,
    `${percent(shareClose)} of its skin lies within 2 cm of the fitted body; half of it within ` +
      `${(1000 * medianM).toFixed(0)} mm.`,
    `${moving.toLocaleString("en")} of ${vertices.toLocaleString("en")} vertices move.`,
    ...report.regionsOff.map(({ region, reason }) =>
      sentence(`${words(region)} does not move: ${reason}`),
    ),
    ...(report.doubleMotion.length > 0
      ? [
          `${report.doubleMotion.join(", ")} already move breasts or buttocks, as spring bones do. ` +
            "The tissue replaces them here: they are held still.",
        ]
      : []),
    ...report.notes.map(sentence),
  ];
}

/** The report: sentences, and the table of bones. */
export function reportElements(report: BindingReport, bound: string): HTMLElement[] {
  const items = [...sentencesOf(report), bound].map((textContent) => create("li", { textContent }));
  const row = (tag: "td" | "th", left: string, right: string) =>
    create(
      "tr",
      {},
      [left, right].map((textContent) => create(tag, { textContent })),
    );
  const table = create("table", {}, [
    row("th", "Joint of the body", "Bone of the avatar"),
    ...report.bones.map(({ joint, bone }) => row("td", words(joint), bone)),
  ]);
  return [
    create("ul", {}, items),
    create("details", {}, [create("summary", { textContent: "Bones" }), table]),
  ];
}
