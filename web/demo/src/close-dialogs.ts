/** All dialogs of a page close by their button, by Escape and by a click beside them. */
export function letDialogsClose(): void {
  for (const dialog of document.querySelectorAll("dialog")) {
    // A click beside the card lies on the dialog itself.
    dialog.addEventListener("click", (event) => {
      if (event.target === dialog) dialog.close();
    });
    dialog.querySelector("button.close")?.addEventListener("click", () => dialog.close());
  }
}
