// Crowds that the graphics card of an engine decodes look as those that the CPU decodes.
import { test } from "@playwright/test";
import { expectCard } from "./card.js";

test("three.js with WebGLRenderer draws what its card decodes", ({ page }) =>
  expectCard(page, "three", "playInThree"));

test("Babylon.js draws what its card decodes", ({ page }) =>
  expectCard(page, "babylon", "playInBabylon"));
