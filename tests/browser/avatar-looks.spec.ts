// What engines make of an avatar's surface beside drawing it, with WebGL.
import { test } from "@playwright/test";
import {
  expectClones,
  expectFlatMemory,
  expectLooks,
  expectRefusals,
  expectRefusedWrites,
  expectWrites,
} from "./avatar-looks.js";

for (const engine of ["three", "babylon"] as const) {
  const stage = { engine, webgpu: false };
  test(`${engine}: outline, shadow, morph targets and rays take the tissue`, ({ page }) =>
    expectLooks(page, stage));
  test(`${engine}: clones of an avatar move by themselves`, ({ page }) =>
    expectClones(page, stage));
  test(`${engine}: refusals change nothing`, ({ page }) => expectRefusals(page, stage));
  test(`${engine}: the vertex stage shows what attributes show`, ({ page }) =>
    expectWrites(page, stage));
  test(`${engine}: materials without such a vertex stage are refused`, ({ page }) =>
    expectRefusedWrites(page, stage));
  // Binding is the same in both, and takes longer than all the rest.
  test(`${engine}: 200 avatars leave no memory behind`, ({ page }) =>
    expectFlatMemory(page, stage, engine === "three"));
}
