// The shadow passes of the engines see the tissue too.
import { test } from "@playwright/test";
import { expectShadows } from "./shadows.js";

test("three.js with WebGLRenderer throws the tissue's shadow", ({ page }) =>
  expectShadows(page, "three", false));

test("Babylon.js throws the tissue's shadow", ({ page }) => expectShadows(page, "babylon", false));
