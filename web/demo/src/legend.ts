import { heatRamp } from "dynaskin/renderer";
import { byId, create } from "./dom.js";

/** What the heat map can show: its title, and the end of its scale in millimetres. */
export const HEAT_SCALES = {
  offset: { title: "Offset of the skin", rangeMm: 30 },
  error: { title: "Distance from ground truth", rangeMm: 15 },
} as const;

/** Draws the heat map's colours from 0 to the end of their scale. */
export function drawLegend(shown: keyof typeof HEAT_SCALES): void {
  const { title, rangeMm } = HEAT_SCALES[shown];
  byId("legend-title").textContent = `${title} (mm)`;
  const stops = heatRamp().map(([r, g, b]) => {
    const [red, green, blue] = [r, g, b].map((part) => Math.round(part * 255));
    return `rgb(${red} ${green} ${blue})`;
  });
  byId("legend-ramp").style.background = `linear-gradient(90deg, ${stops.join(", ")})`;
  const ticks = [0, rangeMm / 3, (rangeMm * 2) / 3].map((value) => `${Math.round(value)}`);
  byId("legend-ticks").replaceChildren(
    ...[...ticks, `${rangeMm}+`].map((textContent) => create("span", { textContent })),
  );
}
