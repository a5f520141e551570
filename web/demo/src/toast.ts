import { byId, create } from "./dom.js";

const SECONDS_SHOWN = 12;

/**
 * Says that something went wrong while the page goes on. What can be tried again stays until it is,
 * or until the message is closed.
 */
export function showError(title: string, error: unknown, tryAgain?: () => void): void {
  const action = tryAgain && { label: "Try again", run: tryAgain };
  show("errors", title, error instanceof Error ? error.message : String(error), action);
}

/** What can be done about a message. */
export interface Action {
  label: string;
  run: () => void;
}

/** Says something that is no error. With something to do about it, it stays until that is done. */
export function showNote(title: string, text: string, action?: Action): void {
  show("notes", title, text, action);
}

/** Takes away what was said of something that has been put right since. */
export function dismissErrors(): void {
  byId("errors").replaceChildren();
}

/** Errors interrupt a screen reader, notes wait for their turn. */
function show(areaId: "errors" | "notes", title: string, text: string, action?: Action): void {
  const close = create("button", { className: "close", type: "button", textContent: "✕" });
  close.setAttribute("aria-label", "Close this message");
  const toast = create("div", { className: `toast card${areaId === "notes" ? " note" : ""}` }, [
    create("strong", { textContent: title }),
    close,
    create("p", { textContent: text }),
  ]);
  close.addEventListener("click", () => toast.remove());
  if (action) {
    const again = create("button", {
      className: "ghost small",
      type: "button",
      textContent: action.label,
    });
    again.addEventListener("click", () => {
      toast.remove();
      action.run();
    });
    toast.append(again);
  } else {
    setTimeout(() => toast.remove(), SECONDS_SHOWN * 1000);
  }
  const area = byId(areaId);
  area.append(toast);
  while (area.childElementCount > 3) area.firstElementChild?.remove();
}
