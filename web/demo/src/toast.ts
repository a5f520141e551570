import { byId, create } from "./dom.js";

const SECONDS_SHOWN = 12;

/**
 * Says that something went wrong while the page goes on. What can be tried again stays until it is,
 * or until the message is closed. What is returned takes it away once it is true no more.
 */
export function showError(title: string, error: unknown, tryAgain?: () => void): () => void {
  const action = tryAgain && { label: "Try again", run: tryAgain };
  const toast = show("errors", title, messageOf(error), action);
  return () => toast.remove();
}

/** What an error says, as a sentence: those of the core begin and end as part of one. */
export function messageOf(error: unknown): string {
  const text = (error instanceof Error ? error.message : String(error)).trim();
  const end = /[.!?:…]$/.test(text) ? "" : ".";
  return `${text.charAt(0).toUpperCase()}${text.slice(1)}${end}`;
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

/** Says what is going on; what is returned takes it away when that ends. */
export function showWhile(title: string, text: string): () => void {
  const toast = show("notes", title, text, undefined, true);
  return () => toast.remove();
}

/** Errors interrupt a screen reader, notes wait for their turn. */
function show(
  areaId: "errors" | "notes",
  title: string,
  text: string,
  action?: Action,
  stays = action !== undefined,
): HTMLElement {
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
  }
  if (!stays) setTimeout(() => toast.remove(), SECONDS_SHOWN * 1000);
  const area = byId(areaId);
  area.append(toast);
  while (area.childElementCount > 3) area.firstElementChild?.remove();
  return toast;
}
