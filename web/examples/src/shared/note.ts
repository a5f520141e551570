import type { Avatar } from "dynaskin";

/** Writes the line at the foot of the page, with a box that switches the tissue on and off. */
export function showNote(text: string, avatar: Avatar): void {
  const note = document.getElementById("note");
  if (!note) return;
  const label = document.createElement("label");
  const box = document.createElement("input");
  box.type = "checkbox";
  box.checked = true;
  box.addEventListener("change", () => {
    avatar.strength = box.checked ? 1 : 0;
  });
  label.append(box, " soft tissue");
  note.replaceChildren(text, label);
}

/** Tells the reader, instead of a blank page, what went wrong. */
export function showError(error: unknown): void {
  const note = document.getElementById("note");
  if (note) note.textContent = error instanceof Error ? error.message : String(error);
}
