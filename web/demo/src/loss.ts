import { showError } from "./toast.js";

/** How long to wait before the graphics card is asked for again. */
const PAUSE_MS = 1000;
const ATTEMPTS = 5;

/** Layers that are lost at the moment: both share one message. */
let losses = 0;

function overlay(): HTMLElement {
  const present = document.getElementById("loss");
  if (present) return present;
  const made = document.createElement("div");
  made.id = "loss";
  made.setAttribute("role", "status");
  const title = document.createElement("strong");
  title.textContent = "The graphics card was lost";
  const rest = document.createElement("span");
  rest.textContent = "The picture comes back by itself; nothing you set is forgotten.";
  made.append(title, rest);
  document.body.append(made);
  return made;
}

/**
 * Shows that the graphics card is lost until `recover` succeeds. Returns false where it did not after
 * several attempts; the page then says to reload.
 */
export async function showLoss(recover: () => Promise<void>): Promise<boolean> {
  losses += 1;
  overlay();
  try {
    for (let attempt = 1; ; attempt += 1) {
      try {
        await recover();
        return true;
      } catch (error) {
        if (attempt === ATTEMPTS) {
          showError("The graphics card was lost and did not come back; reload the page", error);
          return false;
        }
        await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
      }
    }
  } finally {
    losses -= 1;
    if (losses === 0) overlay().remove();
  }
}
