/** Tells when a button is held down: with a pointer, or with Space or Enter. */
export function bindHold(button: HTMLElement, hold: (held: boolean) => void): void {
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    hold(true);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
    button.addEventListener(end, () => hold(false));
  }
  const isPress = (event: KeyboardEvent) => event.key === " " || event.key === "Enter";
  button.addEventListener("keydown", (event) => {
    if (!isPress(event)) return;
    event.preventDefault();
    event.stopPropagation();
    hold(true);
  });
  button.addEventListener("keyup", (event) => {
    if (isPress(event)) hold(false);
  });
  button.addEventListener("blur", () => hold(false));
  button.addEventListener("contextmenu", (event) => event.preventDefault());
}
