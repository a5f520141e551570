import { heatRamp } from "dynaskin/renderer";
import { byId, create } from "./dom.js";

/** Draws the heat map's colours from 0 to `rangeMm` millimetres. */
export function drawLegend(rangeMm: number): void {
  const stops = heatRamp().map(([r, g, b]) => {
    const [red, green, blue] = [r, g, b].map((part) => Math.round(part * 255));
    return `rgb(${red} ${green} ${blue})`;
  });
  byId("legend-ramp").style.background = `linear-gradient(90deg, ${stops.join(", ")})`;
  const ticks = [0, rangeMm / 3, (rangeMm * 2) / 3].map((value) => `${Math.round(value)}`);
  byId("legend-ticks").replaceChildren(
    ...[...ticks, `${rangeMm}+ mm`].map((textContent) => create("span", { textContent })),
  );
}
