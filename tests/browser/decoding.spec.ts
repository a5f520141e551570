// Avatars that the graphics card decodes look as those that the CPU decodes.
import { test } from "@playwright/test";
import { expectDecoding } from "./decoding.js";

test("WebGL2 decodes as the CPU does, and leaves to it what it cannot do", ({ page }) =>
  expectDecoding(page, "webgl2"));
