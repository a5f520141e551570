import { byId } from "./dom.js";
import { showNote } from "./toast.js";

/**
 * Puts a text on the clipboard and says so with `note`. Where the browser does not let it, as on pages
 * without https, the text is shown, selected, to be copied by hand. Returns whether it was copied.
 */
export async function copyText(text: string, note: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = byId<HTMLTextAreaElement>("copy-text");
    area.value = text;
    byId<HTMLDialogElement>("copy-dialog").showModal();
    area.select();
    return false;
  }
  showNote("Copied", note);
  return true;
}
