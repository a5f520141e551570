/** Whether the controls are a sheet at the bottom; the same condition as in layout.css. */
export const narrowScreen = matchMedia("(max-width: 760px), (max-height: 560px)");
