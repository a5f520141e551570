// Avatars with meshes and bones of their own, in both engines.
import { test } from "@playwright/test";
import { expectTissue } from "./avatars.js";

test("an avatar is bound and moves in three.js with WebGLRenderer", ({ page }) =>
  expectTissue(page, "three", false));

test("an avatar is bound and moves in Babylon.js with WebGL", ({ page }) =>
  expectTissue(page, "babylon", false));
