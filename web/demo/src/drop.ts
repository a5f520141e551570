import { byId } from "./dom.js";
import { showNote } from "./toast.js";

/** Takes files that are dropped anywhere on the page or chosen with the button. */
export function acceptFiles(open: (file: File) => void): void {
  const veil = byId("drop");
  let depth = 0;
  const hasFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
  const setDepth = (next: number) => {
    depth = Math.max(0, next);
    veil.hidden = depth === 0;
  };
  addEventListener("dragenter", (event) => {
    if (hasFiles(event)) setDepth(depth + 1);
  });
  addEventListener("dragleave", () => setDepth(depth - 1));
  addEventListener("dragover", (event) => {
    if (hasFiles(event)) event.preventDefault();
  });
  addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    setDepth(0);
    const [file, ...others] = event.dataTransfer?.files ?? [];
    if (!file) return;
    open(file);
    if (others.length === 0) return;
    showNote(
      "One file at a time",
      `${others.length + 1} were dropped; only the first, ${file.name}, is opened.`,
    );
  });
  const input = byId<HTMLInputElement>("file");
  byId("open-file").addEventListener("click", () => input.click());
  input.addEventListener("change", () => {
    const file = input.files?.[0];
    // Cleared, so that the same file can be chosen again.
    input.value = "";
    if (file) open(file);
  });
}
