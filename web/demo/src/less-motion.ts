/** Whether the visitor's system asks for less motion; may change while the page is open. */
export const lessMotion = matchMedia("(prefers-reduced-motion: reduce)");
