import type { Motion } from "dynaskin";
import { byId, create } from "./dom.js";
import { messageOf, showError } from "./toast.js";

/** Takes away the message about the file that was refused last. */
let unsay = () => {};

/** Says what became of a file's joints, with the table when some found no counterpart. */
export function showFileReport(fileName: string, motion: Motion): void {
  const report = motion.jointReport;
  unsay();
  const area = byId("file-report");
  area.hidden = false;
  area.classList.remove("bad");
  if (!report) {
    area.replaceChildren(
      create("h3", { textContent: fileName }),
      create("p", {
        textContent:
          `${motion.durationSeconds.toFixed(1)} s of SMPL poses, played on this body's own shape. ` +
          "SMPL's joints are the body's: there are no names to match.",
      }),
      ...notesList(motion),
    );
    return;
  }
  const { mapped, missing, unmapped } = report;
  const rate = Math.round(1 / report.frameSeconds);
  area.replaceChildren(
    create("h3", { textContent: fileName }),
    create("p", {
      textContent:
        (motion.name ? `Animation “${motion.name}”, ` : "") +
        `${motion.durationSeconds.toFixed(1)} s at ${rate} Hz, in ${report.unit}. ` +
        `${mapped.length} of 24 joints found` +
        (missing.length > 0 ? `; no counterpart for ${missing.join(", ")}.` : "."),
    }),
    ...notesList(motion),
    jointTable(mapped, unmapped, missing.length > 0),
  );
}

/** What was found other than usual in a file, each as a sentence. */
function notesList(motion: Motion): HTMLElement[] {
  if (motion.notes.length === 0) return [];
  const items = motion.notes.map((note) =>
    create("li", { textContent: `${note.charAt(0).toUpperCase()}${note.slice(1)}.` }),
  );
  return [create("ul", {}, items)];
}

/** Takes away what was said of a file once something else plays. */
export function hideFileReport(): void {
  unsay();
  byId("file-report").hidden = true;
}

/**
 * Says why a file was refused, as `what`, and which joints it has, if any; what played goes on. The report is
 * brought into sight.
 */
export function showFileProblem(what: string, error: unknown, joints: string[]): void {
  const area = byId("file-report");
  unsay();
  area.hidden = false;
  area.classList.add("bad");
  area.replaceChildren(
    create("h3", { textContent: what }),
    create("p", { textContent: messageOf(error) }),
    ...(joints.length > 0 ? [namesTable(joints)] : []),
  );
  area.scrollIntoView({ block: "nearest" });
  unsay = showError(what, error);
}

function namesTable(joints: readonly string[]): HTMLElement {
  const head = create("tr", {}, [
    create("th", { textContent: "Joints in the file", scope: "col" }),
  ]);
  const rows = joints.map((name) => create("tr", {}, [create("td", { textContent: name })]));
  return create("details", { open: true }, [
    create("summary", { textContent: `Its joints (${joints.length})` }),
    create("table", {}, [head, ...rows]),
  ]);
}

function jointTable(
  mapped: readonly { joint: string; source: string }[],
  unmapped: readonly string[],
  open: boolean,
): HTMLElement {
  const row = (left: string, right: string) =>
    create("tr", {}, [create("td", { textContent: left }), create("td", { textContent: right })]);
  const head = create("tr", {}, [
    create("th", { textContent: "Body" }),
    create("th", { textContent: "File" }),
  ]);
  const rows = mapped.map(({ joint, source }) => row(joint.replaceAll("_", " "), source));
  if (unmapped.length > 0) rows.push(row("not used", unmapped.join(", ")));
  return create("details", { open }, [
    create("summary", { textContent: "Joints" }),
    create("table", {}, [head, ...rows]),
  ]);
}
