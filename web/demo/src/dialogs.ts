import { copyText } from "./clipboard.js";
import { letDialogsClose } from "./close-dialogs.js";
import { byId } from "./dom.js";
import { motionLabel } from "./motions.js";
import type { PageStore } from "./state.js";
import { showError } from "./toast.js";

/**
 * The overlays: keys, and the settings as code, which `code` gives when it is opened. All dialogs of the
 * page close by their button, by Escape and by a click beside them.
 */
export function bindDialogs(store: PageStore, code: () => Promise<string>): void {
  const keys = byId<HTMLDialogElement>("keys-dialog");
  const program = byId<HTMLDialogElement>("code-dialog");
  // The benchmark's table scrolls sideways where it is wider, and keys have to reach that.
  byId("benchmark-holder").tabIndex = 0;
  byId("keys-open").addEventListener("click", () => keys.showModal());
  for (const id of ["code-open", "below-code"]) {
    byId(id).addEventListener("click", async () => {
      try {
        byId<HTMLTextAreaElement>("code-text").value = await code();
        program.showModal();
      } catch (error) {
        showError("The program could not be loaded", error, () => byId(id).click());
      }
    });
  }
  byId("code-copy").addEventListener("click", async () => {
    const text = byId<HTMLTextAreaElement>("code-text").value;
    if (await copyText(text, "The program is on the clipboard.")) program.close();
  });
  byId("link-copy").addEventListener("click", () => {
    const { file, motion } = store.state;
    const note = file
      ? `${file.name} stays on this computer: the link on the clipboard plays ${motionLabel(motion)} instead, the motion of this page that is nearest to it.`
      : "The link to this very view is on the clipboard.";
    void copyText(location.href, note);
  });
  const share = byId<HTMLDialogElement>("share-dialog");
  for (const id of ["story-share", "lab-share"]) {
    byId(id).addEventListener("click", () => share.showModal());
  }
  for (const [id, original] of [
    ["share-link", "link-copy"],
    ["share-picture", "picture"],
    ["share-code", "code-open"],
  ] as const) {
    byId(id).addEventListener("click", () => {
      share.close();
      byId(original).click();
    });
  }
  letDialogsClose();
}
