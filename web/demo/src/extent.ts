import type { Avatar } from "dynaskin";
import type { Place } from "./layer.js";
import type { View } from "./view.js";

/** What a body takes of the picture, in CSS pixels from its top left corner. */
export interface Extent {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

/** What bodies take of the picture that stand so far from where their poses are. */
export function extentsOf(
  avatars: readonly Avatar[],
  places: readonly Place[],
  view: View,
): Extent[] {
  return avatars.map((avatar, idx) => {
    const { positions } = avatar.skinned();
    const [asideM, aheadM] = places[idx] ?? [0, 0];
    const [xs, ys]: [number[], number[]] = [[], []];
    for (let at = 0; at < positions.length; at += 3) {
      const [x = 0, y = 0, z = 0] = positions.subarray(at, at + 3);
      const { xPx, yPx } = view.project([x + asideM, y, z + aheadM]);
      xs.push(xPx);
      ys.push(yPx);
    }
    const [left, right] = [Math.min(...xs), Math.max(...xs)];
    return { left, right, top: Math.min(...ys), bottom: Math.max(...ys) };
  });
}

/** The largest distance in the picture between where two avatars have the same vertex, in CSS pixels. */
export function largestGapPx(one: Avatar, other: Avatar, view: View): number {
  const project = view.projector();
  // A copy: both may lie in the same memory, which grows.
  const from = one.skinned().positions.slice();
  const to = other.skinned().positions;
  let largest = 0;
  for (let at = 0; at < from.length; at += 3) {
    const [x = 0, y = 0, z = 0] = from.subarray(at, at + 3);
    const [toX = 0, toY = 0, toZ = 0] = to.subarray(at, at + 3);
    const [xPx, yPx] = project(x, y, z);
    const [toXPx, toYPx] = project(toX, toY, toZ);
    if (xPx < 0 || yPx < 0 || xPx > innerWidth || yPx > innerHeight) continue;
    largest = Math.max(largest, Math.hypot(toXPx - xPx, toYPx - yPx));
  }
  return largest;
}
