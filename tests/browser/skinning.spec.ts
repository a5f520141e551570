// Engines and the renderer blend dual quaternions on the graphics card.
import { test } from "@playwright/test";
import { expectSkinnings } from "./skinnings.js";

test("three.js with WebGLRenderer skins as the CPU does", ({ page }) =>
  expectSkinnings(page, "three", "compareInThree"));

test("Babylon.js skins as the CPU does", ({ page }) =>
  expectSkinnings(page, "babylon", "compareInBabylon"));

test("the renderer with WebGL2 skins as the CPU does", ({ page }) =>
  expectSkinnings(page, "renderer", "compareInRenderer", "webgl2"));
