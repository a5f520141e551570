// Engines and the renderer blend dual quaternions on the graphics card.
import { test } from "@playwright/test";
import { expectSkinnings } from "./skinnings.js";

test("three.js with WebGLRenderer skins as the CPU does", ({ page }) =>
  expectSkinnings(page, "three", "compareInThree"));

for (const material of ["pbr", "standard"]) {
  test(`Babylon.js skins as the CPU does, with a ${material} material`, ({ page }) =>
    expectSkinnings(page, "babylon", "compareInBabylon", material));
}

test("the renderer with WebGL2 skins as the CPU does", ({ page }) =>
  expectSkinnings(page, "renderer", "compareInRenderer", "webgl2"));
