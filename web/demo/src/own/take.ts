import { copyText } from "../clipboard.js";
import { byId, create } from "../dom.js";
import type { BoundAvatar } from "./bound-avatar.js";

/** Lets the visitor take along the binding and the program. */
export function bindTaking(present: () => { file: File; bound: BoundAvatar } | null): void {
  byId("own-download").addEventListener("click", () => {
    const taken = present();
    if (!taken) return;
    // A copy of its own: a Blob takes no buffer that may be shared.
    const bytes = new Uint8Array(taken.bound.binding.toBytes());
    const href = URL.createObjectURL(new Blob([bytes], { type: "application/octet-stream" }));
    const download = `${taken.file.name.replace(/\.[^.]*$/, "")}.binding`;
    create("a", { href, download }).click();
    setTimeout(() => URL.revokeObjectURL(href), 10_000);
  });
  byId("own-copy").addEventListener("click", () => {
    const code = byId<HTMLTextAreaElement>("own-code").value;
    void copyText(code, "The program is on the clipboard.");
  });
}
