import { byId } from "../dom.js";
import type { Studio } from "./studio.js";

/** Pixels over which a press is a drag. */
const DRAG_PX = 5;

/** Calls `click` where the canvas is clicked or tapped, and not where it is dragged. */
export function bindClicks(canvas: HTMLElement, click: (x: number, y: number) => void): void {
  let [x, y] = [0, 0];
  canvas.addEventListener("pointerdown", (event) => {
    [x, y] = [event.clientX, event.clientY];
  });
  canvas.addEventListener("click", (event) => {
    if (Math.hypot(event.clientX - x, event.clientY - y) < DRAG_PX) {
      click(event.clientX, event.clientY);
    }
  });
}

/** Moves the divider with the pointer and the arrow keys. */
export function bindDivider(studio: Studio): void {
  const divider = byId("own-divider");
  const set = (split: number) => {
    studio.split = Math.min(1, Math.max(0, split));
    const percent = Math.round(100 * studio.split);
    divider.style.left = `${percent}%`;
    divider.setAttribute("aria-valuenow", `${percent}`);
  };
  divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
  divider.addEventListener("pointermove", (event) => {
    if (!divider.hasPointerCapture(event.pointerId)) return;
    const { left, width } = byId("own-stage").getBoundingClientRect();
    set((event.clientX - left) / width);
  });
  const steps: Record<string, (split: number) => number> = {
    ArrowLeft: (split) => split - 0.05,
    ArrowRight: (split) => split + 0.05,
    Home: () => 0,
    End: () => 1,
  };
  divider.addEventListener("keydown", ({ key }) => {
    const step = steps[key];
    if (step) set(step(studio.split));
  });
}
